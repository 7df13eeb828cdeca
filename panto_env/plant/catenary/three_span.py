"""Three-span catenary (paper 2, section 2.1, Eqs 1-6): one equivalent wire, in modal form.

The wire is anchored at both ends of the three spans and stands on springs K_S at the two supports
between them. The pantograph is always in the central span: when it leaves it, the deflection of the
second and third span is moved to the first and second, the third starts at rest, and the modal
coordinates follow by least squares.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...backend import implements, inlined
from ...base.arrays import Array, Index, one_thread
from ...base.settings import Between
from ..line_condition import DrawnLine
from ..numerics import Numerics, Runs
from ..state import ENDING
from .protocol import (
    NOTHING,
    CatenaryKind,
    CatenaryModel,
    LineView,
    StartPoint,
    advance_wire,
    apply_force,
    check_speeds,
    ending_by_wire,
    look_at_contact,
    place_contact,
    record_wire,
    refuse_defects,
    rise_at_contact,
)
from .schema import CatenaryData, Wire

MARGIN = 2.0  # m, of the table beyond the central span: a step may end past the support


class ThreeSpanLine(NamedTuple):
    """Constants of the line; modes are scaled to unit modal mass."""

    span: float  # m
    time_step: float  # s
    shape: Array  # (points, modes): mode shapes about the central span (1/sqrt(kg))
    spacing: float  # of the points (m)
    propagate: Array  # (4, modes): exact free motion over a step: q <- q, v; v <- q, v
    impulse: Array  # (2, modes): change of q and v by 1 N of modal force over a step
    half_step: Array  # (3, modes): q at mid-step <- q, v at the step's start, 1 N of modal force
    softness: Array  # (modes,): 1 / omega^2 (s^2)
    at_support: Array  # (2, modes): mode shapes at the two supports
    project: Array  # (modes, modes): modal coordinates in the next span from those in this one
    free_uplift: float  # room for the uplift at a support (m)


class ThreeSpanWire(NamedTuple):
    """State of the wire in all lanes."""

    modal: Array  # (lanes, 2, modes): coordinates and their rates
    contact_shape: Array  # (lanes, collectors, modes): mode shapes at the contact points
    scratch: Array  # (lanes, 2, modes)
    central_span: Index  # (lanes,): number of the central span along the line


class ThreeSpanData(CatenaryData):
    """One equivalent tensioned wire on springs, three spans long (paper 2, section 2.1)."""

    kind: Literal["three_span"] = "three_span"
    wire: Wire
    suspension_stiffness: Annotated[float, Between(10, 1e8, "N/m")] = Field(
        description="spring K_S at each support (N/m)"
    )
    modes: Annotated[int, Between(3, 400)] = Field(description="number of vibration modes kept")
    damping_ratio: Annotated[float, Between(0, 0.99)] = Field(description="damping ratio of each mode (-)")


@inlined
def read_shape(line, wire, lane, x, shape):
    """Write the mode shapes at x (m along the line), about the central span, to ``shape``, (modes,)."""
    local = x - wire.central_span[lane] * line.span + MARGIN
    ratio = min(max(local / line.spacing, 0.0), line.shape.shape[0] - 1.001)
    k = int(ratio)
    for m in range(shape.size):
        shape[m] = line.shape[k, m] + (ratio - k) * (line.shape[k + 1, m] - line.shape[k, m])


@implements(advance_wire, ThreeSpanLine)
def _advance(line, wire, lane):
    q, v = wire.modal[lane, 0], wire.modal[lane, 1]
    for m in range(q.size):
        coordinate, rate = q[m], v[m]
        q[m] = line.propagate[0, m] * coordinate + line.propagate[1, m] * rate
        v[m] = line.propagate[2, m] * coordinate + line.propagate[3, m] * rate


@inlined
def deflection(shape, q):
    """Height (m) of the wire at a place, from its mode shapes there and the modal coordinates."""
    height = 0.0
    for m in range(q.size):
        height += shape[m] * q[m]
    return height


@inlined
def project(line, wire, lane):
    """Project the wire's shape and rates onto the three spans about the next one."""
    modal, before = wire.modal[lane], wire.scratch[lane]
    size = modal.shape[1]
    for k in range(2):
        for m in range(size):
            before[k, m] = modal[k, m]
        for m in range(size):
            total = 0.0
            for j in range(size):
                total += line.project[m, j] * before[k, j]
            modal[k, m] = total
    wire.central_span[lane] += 1


@implements(place_contact, ThreeSpanLine)
def _place(line, wire, lane, contact, x):
    if contact == 0 and x >= (wire.central_span[lane] + 1) * line.span:
        project(line, wire, lane)
    modal, shape = wire.modal[lane], wire.contact_shape[lane, contact]
    read_shape(line, wire, lane, x, shape)
    middle = 0.0
    for m in range(shape.size):
        middle += shape[m] * (line.half_step[0, m] * modal[0, m] + line.half_step[1, m] * modal[1, m])
    return deflection(shape, modal[0]), middle


@implements(rise_at_contact, ThreeSpanLine)
def _rise(line, wire, lane, contact, x0, x1):
    q, v, shape = wire.modal[lane, 0], wire.modal[lane, 1], wire.scratch[lane, 0]
    read_shape(line, wire, lane, x1, shape)
    rise = deflection(shape, q) - 0.5 * line.time_step * deflection(shape, v)
    read_shape(line, wire, lane, x0, shape)
    return rise - (deflection(shape, q) - 0.5 * line.time_step * deflection(shape, v))


@implements(look_at_contact, ThreeSpanLine)
def _look(line, wire, lane, contact, x):
    shape, at_end, at_middle = wire.contact_shape[lane, contact], 0.0, 0.0
    for m in range(shape.size):
        at_end += shape[m] * line.impulse[0, m] * shape[m]
        at_middle += shape[m] * line.half_step[2, m] * shape[m]
    return deflection(shape, wire.modal[lane, 0]), at_end, at_middle, 0.0


@implements(apply_force, ThreeSpanLine)
def _apply(line, wire, lane, contact, x, force):
    modal, shape = wire.modal[lane], wire.contact_shape[lane, contact]
    for m in range(shape.size):
        modal[0, m] += line.impulse[0, m] * shape[m] * force
        modal[1, m] += line.impulse[1, m] * shape[m] * force


@inlined
def support_uplift(line, wire, lane, side):
    """Uplift (m) at the support before the central span (side 0) or behind it (1)."""
    total = 0.0
    for m in range(line.at_support.shape[1]):
        total += line.at_support[side, m] * wire.modal[lane, 0, m]
    return total


@implements(ending_by_wire, ThreeSpanLine)
def _ending(line, wire, lane):
    for side in range(2):
        if support_uplift(line, wire, lane, side) > line.free_uplift:
            return ENDING.STOP
    return ENDING.NONE


@implements(record_wire, ThreeSpanLine)
def _record(line, wire, lane, uplift, tension):
    for side in range(2):
        support = wire.central_span[lane] - 1 + side
        if 0 <= support < uplift.size:
            uplift[support] = support_uplift(line, wire, lane, side)


SHAPE_SPACING = 0.025  # m, of the table of mode shapes, interpolated linearly
VIEW_POINTS = 361  # number of points of the three spans in a picture
TIME_STEP = 2.5e-3  # default time step (s): tests/plant/test_three_span.py shows how figures converge


class ThreeSpan(CatenaryModel):
    """Paper 2's line; the wire has mass, but neither droppers nor an end. Its height at mid-step is exact."""

    def __init__(
        self, data: ThreeSpanData, *, lanes: int, collectors: int, spans: int, numerics: Numerics, runs: Runs
    ) -> None:
        """Build the line; there is no grid, and modes propagate exactly over any time step.

        Raises InputError for conditions with defects.
        """
        refuse_defects(data, runs.conditions)
        self.wave_speed = data.wire.wave_speed
        check_speeds(data.name, self.wave_speed, runs.speeds)
        self.time_step = numerics.time_step or runs.carried_step(TIME_STEP)
        runs.check_wave(self.time_step)
        self._data = data
        with one_thread():
            frequency, self._vectors = modes(data)
            self.line: Any = _constants(data, frequency, self._vectors, self.time_step)
        self.wire: Any = ThreeSpanWire(
            modal=np.zeros((lanes, 2, data.modes)),
            contact_shape=np.zeros((lanes, collectors, data.modes)),
            scratch=np.zeros((lanes, 2, data.modes)),
            central_span=np.zeros(lanes, dtype=np.int64),
        )
        self.contact_gain = contact_gain(self.line)
        alignment = data.alignment(spans)
        self.usual_end = alignment.length
        self.supports = alignment.support(np.arange(1, spans))
        compliance = float(self.line.at_support[0] ** 2 @ self.line.softness)
        self.start_point = StartPoint(0.0, compliance, 0.0)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane at rest under a force (N) at the starting point."""
        self.wire.modal[lane, 0] = self.line.at_support[0] * self.line.softness * force
        self.wire.modal[lane, 1] = 0.0
        self.wire.central_span[lane] = 0

    @cached_property
    def _view_shapes(self) -> Array:
        places = np.linspace(0.0, 3 * self._data.span_length, VIEW_POINTS)
        with one_thread():
            return mode_shapes(self._data, self._vectors, places)

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of the three spans about the train; the model has no sag of the wire."""
        span, before = self.line.span, float(self.wire.central_span[lane] - 1)
        x = before * span + np.linspace(0.0, 3 * span, VIEW_POINTS)
        inside = (x >= begin) & (x <= end)
        height = self._view_shapes[inside] @ self.wire.modal[lane, 0]
        supports = span * (before + np.array([1.0, 2.0]))
        supports = supports[(supports >= begin) & (supports <= end)]
        return NOTHING._replace(x=x[inside], contact=height, supports=supports)


def modes(data: ThreeSpanData) -> tuple[Array, Array]:
    """Angular frequencies (rad/s), (modes,), and the modes in the basis of sines, (sines, modes).

    The basis sin(k pi xi / 3L), scaled to unit mass, has twice as many functions as modes are kept.
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
    with one_thread():  # several threads may change the sign of a mode
        squared, vectors = np.linalg.eigh(stiffness)
    return np.sqrt(squared[: data.modes]), vectors[:, : data.modes]


def mode_shapes(data: ThreeSpanData, vectors: Array, positions: Array) -> Array:
    """Mode shapes Phi (Eq. 3), (positions, modes), at positions (m) along the three spans."""
    length = 3 * data.span_length
    k = np.arange(1, len(vectors) + 1)
    sines = np.sin(np.outer(positions, k) * np.pi / length)
    return np.asarray(np.sqrt(2 / (data.wire.mass * length)) * sines @ vectors)


def _constants(data: ThreeSpanData, frequency: Array, vectors: Array, time_step: float) -> ThreeSpanLine:
    span = data.span_length
    points = int(np.ceil((span + 2 * MARGIN) / SHAPE_SPACING)) + 1
    positions = span - MARGIN + SHAPE_SPACING * np.arange(points)

    # Least squares over points closer than a quarter of the shortest wave kept.
    everywhere = np.linspace(0, 3 * span, 8 * data.modes + 1)
    moved = mode_shapes(data, vectors, everywhere + span)
    moved[everywhere > 2 * span + 1e-9] = 0.0
    project = np.linalg.lstsq(mode_shapes(data, vectors, everywhere), moved, rcond=None)[0]
    free, forced = _propagation(frequency, data.damping_ratio, time_step)
    free_half, forced_half = _propagation(frequency, data.damping_ratio, time_step / 2)
    return ThreeSpanLine(
        span=span,
        time_step=time_step,
        shape=mode_shapes(data, vectors, positions),
        spacing=SHAPE_SPACING,
        propagate=free,
        impulse=forced,
        half_step=np.array([free_half[0], free_half[1], forced_half[0]]),
        softness=1 / frequency**2,
        at_support=mode_shapes(data, vectors, np.array([span, 2 * span])),
        project=project,
        free_uplift=data.free_uplift,
    )


def _propagation(frequency: Array, ratio: float, time_step: float) -> tuple[Array, Array]:
    """Exact step of q'' + 2 ratio omega q' + omega^2 q = f with constant f: (4, modes) and (2, modes)."""
    damped = frequency * np.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * frequency * time_step)
    cosine, sine = decay * np.cos(damped * time_step), decay * np.sin(damped * time_step)
    lean = ratio * frequency / damped
    free = np.array(
        [cosine + lean * sine, sine / damped, -(frequency**2) * sine / damped, cosine - lean * sine]
    )
    return free, np.array([(1 - free[0]) / frequency**2, free[1]])


def contact_gain(line: ThreeSpanLine) -> float:
    """Inverse of the stiffness (m/N) from which a contact law that reads the wire at mid-step is unstable.

    The first unstable motion changes its sign in each step, z = -1: there a force gives a mode the height
    half_step (z - A)^-1 impulse at mid-step, with A the mode's exact step.
    """
    steps = np.moveaxis(line.propagate.reshape(2, 2, -1), -1, 0)
    moved = np.linalg.solve(-np.eye(2) - steps, line.impulse.T[:, :, None])[:, :, 0]
    alternating = np.sum(line.half_step[:2].T * moved, axis=1) + line.half_step[2]
    return max(0.0, float(np.max(line.shape**2 @ -alternating)))


__all__ = ["KIND", "ThreeSpan", "ThreeSpanData"]

KIND = CatenaryKind(ThreeSpanData, ThreeSpan)
