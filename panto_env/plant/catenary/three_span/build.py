"""Three-span catenary (paper 2, section 2.1, Eqs 1-6): one equivalent wire, in modal form.

The wire is anchored at both ends of the three spans and stands on springs K_S at the two supports
between them. The pantograph is always in the central span: when it leaves it, the deflection of the
second and third span is moved to the first and second, the third starts at rest, and the modal
coordinates follow by least squares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from ....backend.compile import PART, part
from ....base.arrays import Array
from ... import step as coupling
from ...numerics import Numerics
from .schema import ThreeSpanData

SHAPE_SPACING = 0.025  # m, of the table of mode shapes, interpolated linearly
MARGIN = 2.0  # m, of the table beyond the central span: a step may end past the support


TIME_STEP = 2.5e-3
"""Unless told otherwise (s): tests/test_three_span.py shows how figures converge."""


class ThreeSpanLine(NamedTuple):
    """Constants of the line; modes are scaled to unit modal mass."""

    span: float  # m
    shape: Array  # (points, modes): mode shapes about the central span (1/sqrt(kg))
    spacing: float  # of the points (m)
    propagate: Array  # (4, modes): exact free motion over a step: q <- q, v; v <- q, v
    impulse: Array  # (2, modes): change of q and v by 1 N of modal force over a step
    soft: Array  # (modes,): 1 / omega^2 (s^2)
    at_support: Array  # (2, modes): mode shapes at the two supports
    project: Array  # (modes, modes): modal coordinates in the next span from those in this one


class ThreeSpanWire(NamedTuple):
    """Moving state of all lanes."""

    modal: Array  # (lanes, 2, modes): coordinates and their rates
    shape_0: Array  # (lanes, modes): mode shapes at mid-step, scratch
    moved: Array  # (lanes, 2, modes): scratch of the projection
    span_now: NDArray[np.int64]  # (lanes,): number of the central span along the line


def wave_speed(data: ThreeSpanData) -> float:
    """Speed of waves along the wire (m/s)."""
    return float(np.sqrt(data.wire.tension / data.wire.mass))


def line_length(data: ThreeSpanData, spans: int) -> float:
    """How far a run can go (m): the line has no end."""
    return np.inf


def line_end(data: ThreeSpanData, spans: int) -> float:
    """How far a run goes unless told otherwise (m)."""
    return spans * data.span_length


def modes(data: ThreeSpanData) -> tuple[Array, Array]:
    """Angular frequencies (rad/s), (modes,), and the modes in the basis of sines, (sines, modes).

    The basis sin(k pi xi / 3L), scaled to unit mass, is twice as large as the modes kept.
    """
    length = 3 * data.span_length
    k = np.arange(1, 2 * data.modes + 1)
    wavenumber = k * np.pi / length
    wire = data.wire
    stiffness = np.diag(wire.tension * wavenumber**2 + wire.bending_stiffness * wavenumber**4) / wire.mass
    scale = np.sqrt(2 / (wire.mass * length))
    for position in (data.span_length, 2 * data.span_length):
        sines = scale * np.sin(wavenumber * position)
        stiffness += data.suspension_stiffness * np.outer(sines, sines)
    squared, vectors = np.linalg.eigh(stiffness)
    return np.sqrt(squared[: data.modes]), vectors[:, : data.modes]


def mode_shapes(data: ThreeSpanData, vectors: Array, positions: Array) -> Array:
    """Mode shapes Phi (Eq. 3), (positions, modes), at positions (m) along the three spans."""
    length = 3 * data.span_length
    k = np.arange(1, len(vectors) + 1)
    sines = np.sin(np.outer(positions, k) * np.pi / length)
    return np.asarray(np.sqrt(2 / (data.wire.mass * length)) * sines @ vectors)


def time_step(data: ThreeSpanData, numerics: Numerics) -> float:
    """Time step (s) asked for, or the usual one."""
    return numerics.time_step or TIME_STEP


def build(data: ThreeSpanData, spans: int, numerics: Numerics) -> ThreeSpanLine:
    """Constants of the line; there is no grid, and modes propagate exactly over any time step (s)."""
    frequency, vectors = modes(data)
    span = data.span_length
    points = int(np.ceil((span + 2 * MARGIN) / SHAPE_SPACING)) + 1
    positions = span - MARGIN + SHAPE_SPACING * np.arange(points)

    # Least squares over points closer than a quarter of the shortest wave kept.
    everywhere = np.linspace(0, 3 * span, 8 * data.modes + 1)
    moved = mode_shapes(data, vectors, everywhere + span)
    moved[everywhere > 2 * span + 1e-9] = 0.0
    project = np.linalg.lstsq(mode_shapes(data, vectors, everywhere), moved, rcond=None)[0]
    free, forced = _propagation(frequency, data.damping_ratio, time_step(data, numerics))
    return ThreeSpanLine(
        span=span,
        shape=mode_shapes(data, vectors, positions),
        spacing=SHAPE_SPACING,
        propagate=free,
        impulse=forced,
        soft=1 / frequency**2,
        at_support=mode_shapes(data, vectors, np.array([span, 2 * span])),
        project=project,
    )


def _propagation(frequency: Array, ratio: float, time_step: float) -> tuple[Array, Array]:
    """Exact step of q'' + 2 ratio omega q' + omega^2 q = f, f held: (4, modes) and (2, modes)."""
    damped = frequency * np.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * frequency * time_step)
    cosine, sine = decay * np.cos(damped * time_step), decay * np.sin(damped * time_step)
    lean = ratio * frequency / damped
    free = np.array(
        [cosine + lean * sine, sine / damped, -(frequency**2) * sine / damped, cosine - lean * sine]
    )
    return free, np.array([(1 - free[0]) / frequency**2, free[1]])


def at_rest(line: ThreeSpanLine, lanes: int) -> ThreeSpanWire:
    """State of all lanes, at rest."""
    size = len(line.soft)
    return ThreeSpanWire(
        modal=np.zeros((lanes, 2, size)),
        shape_0=np.zeros((lanes, size)),
        moved=np.zeros((lanes, 2, size)),
        span_now=np.zeros(lanes, dtype=np.int64),
    )


def start_point(line: ThreeSpanLine) -> tuple[float, float, float]:
    """Height (m), compliance of the wire, and of a massless spring (m/N), where a run starts."""
    return 0.0, float(line.at_support[0] ** 2 @ line.soft), 0.0


def settle(line: ThreeSpanLine, wire: ThreeSpanWire, lane: int, force: float) -> None:
    """Put one lane at rest under a force (N) at the starting point."""
    wire.modal[lane, 0] = line.at_support[0] * line.soft * force
    wire.modal[lane, 1] = 0.0
    wire.span_now[lane] = 0


def supports(data: ThreeSpanData, spans: int) -> Array:
    """Positions (m) of the supports whose uplift is recorded while the train is beside them."""
    return data.span_length * np.arange(1, spans)


def droppers(data: ThreeSpanData, spans: int) -> Array:
    """Positions (m) of the droppers: the equivalent wire has none."""
    return np.zeros(0)


def static_tension(data: ThreeSpanData, spans: int) -> Array:
    """Static tension (N) of the droppers."""
    return np.zeros(0)


@part
def read_shape(line, wire, lane, x, out):
    """Mode shapes at x (m along the line), seen from the central span, into ``out``."""
    local = x - wire.span_now[lane] * line.span + MARGIN
    ratio = min(max(local / line.spacing, 0.0), line.shape.shape[0] - 1.001)
    k = int(ratio)
    for m in range(out.size):
        out[m] = line.shape[k, m] + (ratio - k) * (line.shape[k + 1, m] - line.shape[k, m])


@overload(coupling.move_wire, jit_options=PART)
def _move_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not ThreeSpanLine:
        return None

    def move(line, wire, lane, x0, x1, force):
        q, v = wire.modal[lane, 0], wire.modal[lane, 1]
        for m in range(q.size):
            position, rate = q[m], v[m]
            q[m] = line.propagate[0, m] * position + line.propagate[1, m] * rate
            v[m] = line.propagate[2, m] * position + line.propagate[3, m] * rate
        middle, end = wire.shape_0[lane], wire.moved[lane, 0]
        read_shape(line, wire, lane, 0.5 * (x0 + x1), middle)
        read_shape(line, wire, lane, x1, end)
        height, compliance = 0.0, 0.0
        for m in range(q.size):
            height += end[m] * q[m]
            compliance += end[m] * line.impulse[0, m] * middle[m]
        return height, compliance, 0.0

    return move


@overload(coupling.load_wire, jit_options=PART)
def _load_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not ThreeSpanLine:
        return None

    def load(line, wire, lane, x0, x1, force):
        modal, shape = wire.modal[lane], wire.shape_0[lane]
        for m in range(shape.size):
            modal[0, m] += line.impulse[0, m] * shape[m] * force
            modal[1, m] += line.impulse[1, m] * shape[m] * force
        if x1 >= (wire.span_now[lane] + 1) * line.span:
            moved = wire.moved[lane]
            for k in range(2):
                for m in range(shape.size):
                    moved[k, m] = modal[k, m]
                for m in range(shape.size):
                    total = 0.0
                    for j in range(shape.size):
                        total += line.project[m, j] * moved[k, j]
                    modal[k, m] = total
            wire.span_now[lane] += 1

    return load


@overload(coupling.record_wire, jit_options=PART)
def _record_wire(line, wire, lane, uplift, tension):
    if getattr(line, "instance_class", None) is not ThreeSpanLine:
        return None

    def record(line, wire, lane, uplift, tension):
        for side in range(2):
            support = wire.span_now[lane] - 1 + side
            if 0 <= support < uplift.size:
                total = 0.0
                for m in range(line.at_support.shape[1]):
                    total += line.at_support[side, m] * wire.modal[lane, 0, m]
                uplift[support] = total

    return record
