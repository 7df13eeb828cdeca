"""A pantograph with its actuator under the mean line, as a linear system of low order.

A point force F that travels along a string of tension T and mass mu per metre moves its contact point with
the velocity F / (2 sqrt(T mu)) at any speed: waves carry energy away, as a dashpot does. (From the string's
equation in the moving frame: waves ahead and behind have the wave numbers omega / (c - v) and
omega / (c + v), and the jump of slope at the point balances the force.) Below a few hertz the supports hold
the wires: this is a spring in parallel with the dashpot, the mean over the span of the static stiffness of a
string between two supports, 6 T / s. Both wires are modelled as one string.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.control.observation import Context
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.single import SingleData
from panto_env.plant.pantograph.schema import STRIP_STIFFNESS, matrices

DELAY, LAG = 0.010, 0.015
"""Delay of actuator and sensors together, and lag of the actuator (s), from the presets "realistic"."""
RATE = 2500.0  # limit of the actuator's rate (N/s), likewise
SHORTEST_LAG = 1e-3  # minimum lag (s); a smaller one is replaced by it, which makes no difference at 100 Hz
OUTPUTS = ("contact force", "head displacement", "frame displacement", "head velocity", "frame velocity")
"""Outputs of the model, in order (N, m, m/s), named as the entries of the observation."""


@dataclass(frozen=True)
class MeanLine:
    """Mean line as felt at the contact point: a damper and a spring."""

    damper: float  # N s/m
    spring: float  # N/m


def mean_line(context: Context) -> MeanLine:
    """Mean line of an episode, from closed forms. Raises InputError for a line without wires."""
    line = context.catenary
    if isinstance(line, SingleData):
        return mean_of_single(line)
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError(
            f"The line '{line.name}' has no wires with mass and tension, which this policy needs for its "
            "model; choose a line of kind 'flexible' or 'single', or another policy."
        )
    wires = line.every_wire
    tension, mass = sum(wire.tension for wire in wires), sum(wire.mass for wire in wires)
    return MeanLine(2 * float(np.sqrt(tension * mass)), 6 * tension / line.alignment().mean_length)


def mean_of_single(line: SingleData) -> MeanLine:
    """Mean line of a single wire or a rail.

    The damper is that of a wave two spans long, which bending carries too. The spring is the inverse of the
    mean yield between supports that do not move, in series with theirs: of a string L / 6 T, of a beam that
    goes on over its supports about L^3 / 180 EI (L^3 / 90 EI if hinged there, L^3 / 420 EI if held).
    """
    wire, length = line.contact_wire, line.alignment().mean_length
    pull = wire.tension + wire.bending_stiffness * (np.pi / length) ** 2
    spring = 6 * wire.tension / length + 180 * wire.bending_stiffness / length**3
    return MeanLine(2 * float(np.sqrt(pull * wire.mass)), 1 / (1 / spring + 1 / line.support.stiffness))


@dataclass(frozen=True)
class LineModel:
    """Linear model x' = a x + b u, outputs = c x + d u, with u = [command (N), height of the wire (m)].

    State: displacements and velocities of the masses, head first (m, m/s), uplift of the wire at the contact
    point (m), the actuator's force (N). The command acts after ``delay``, which is not in a and b.
    """

    a: Array  # (states, states)
    b: Array  # (states, 2)
    c: Array  # (5, states): OUTPUTS
    d: Array  # (5, 2)
    delay: float  # s

    def response(self, frequency: Array) -> NDArray[np.complex128]:
        """Response of the contact force to a command (N/N), complex, (n,), at frequencies (Hz)."""
        s = 2j * np.pi * np.asarray(frequency, dtype=float)
        eye = np.eye(len(self.a))
        force = [self.c[0] @ np.linalg.solve(each * eye - self.a, self.b[:, 0]) for each in s]
        return np.asarray(np.array(force) * np.exp(-s * self.delay))


class Sampled:
    """A model in discrete time; its state also holds the commands within the delay, the newest last.

    It is sampled at a controller's interval (s), with commands and heights held in between.
    """

    def __init__(self, model: LineModel, interval: float) -> None:
        whole = int(model.delay / interval + 1e-9)
        rest = model.delay - whole * interval
        size, late = len(model.a), whole + (rest > 1e-9)
        transition, new, height = _held(model, interval - rest)
        before, old, height_before = _held(model, rest)
        self.a = np.zeros((size + late, size + late))
        self.a[:size, :size] = transition @ before
        self.b = np.zeros(size + late)
        # The command changes once within a step, unless the delay is a whole number of steps.
        for ago, gain in ((whole, new), (whole + 1, transition @ old)):
            if ago == 0:
                self.b[:size] += gain
            elif ago <= late:
                self.a[:size, size + late - ago] += gain
        if late:
            self.a[size : size + late - 1, size + 1 :] = np.eye(late - 1)
            self.b[-1] = 1.0
        self.height = np.concatenate([transition @ height_before + height, np.zeros(late)])
        self.c = np.hstack([model.c, np.zeros((len(model.c), late))])
        self.d_height = model.d[:, 1]
        self.size = size + late
        """Number of states."""

    def response(self, turns: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Outputs for a periodic command of 1 N, complex, (5, n); turns: e^(i w T) of an interval, (n,)."""
        eye = np.eye(self.size)
        columns = [self.c @ np.linalg.solve(each * eye - self.a, self.b) for each in turns]
        return np.array(columns).T


def line_model(context: Context, line: MeanLine, delay: float = DELAY, lag: float = LAG) -> LineModel:
    """Model of an episode's pantograph under a mean line; delay of actuator and sensors, lag: s."""
    a, b = matrices(context.pantograph)
    masses = len(context.pantograph.masses)
    size = 2 * masses + 2
    wire, actuator = size - 2, size - 1
    stiffness = context.pantograph.contact_stiffness
    spring = STRIP_STIFFNESS if stiffness == "rigid" else float(stiffness)
    force = np.zeros(size)
    force[0], force[wire] = spring, -spring
    whole = np.zeros((size, size))
    whole[:wire, :wire] = a
    whole[:wire] += np.outer(b[:, 0], force)
    whole[:wire, actuator] = b[:, 1 + context.channels[0]]
    whole[wire] = force / line.damper
    whole[wire, wire] -= line.spring / line.damper
    whole[actuator, actuator] = -1 / max(lag, SHORTEST_LAG)
    inputs = np.zeros((size, 2))
    inputs[actuator, 0] = 1 / max(lag, SHORTEST_LAG)
    inputs[:wire, 1] = -spring * b[:, 0]
    inputs[wire, 1] = -spring / line.damper
    outputs = np.zeros((len(OUTPUTS), size))
    outputs[0] = force
    for row, state in enumerate((0, masses - 1, masses, 2 * masses - 1), start=1):
        outputs[row, state] = 1.0
    direct = np.zeros((len(OUTPUTS), 2))
    direct[0, 1] = -spring
    return LineModel(whole, inputs, outputs, direct, delay)


def _held(model: LineModel, time: float) -> tuple[Array, Array, Array]:
    """Transition matrix over a time (s), and the effects of a command and of a height held over it."""
    from scipy.linalg import expm

    size = len(model.a)
    both = np.zeros((size + 2, size + 2))
    both[:size, :size], both[:size, size:] = model.a, model.b
    whole = expm(both * time)
    return whole[:size, :size], whole[:size, size], whole[:size, size + 1]
