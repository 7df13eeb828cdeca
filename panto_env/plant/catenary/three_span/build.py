"""A three-span catenary for a number of lanes: modes, their exact step, and its state."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ....base.arrays import Array, one_thread
from ...line_condition import DrawnLine
from ...numerics import Numerics, Runs
from ..protocol import StartPoint, check_speeds, refuse_defects
from ..view import NOTHING, LineView
from .arrays import MARGIN, ThreeSpanLine, ThreeSpanWire
from .schema import ThreeSpanData

SHAPE_SPACING = 0.025  # m, of the table of mode shapes, interpolated linearly
VIEW_POINTS = 361
"""Number of points of the three spans in a picture."""
TIME_STEP = 2.5e-3
"""Default time step (s): tests/plant/test_three_span.py shows how figures converge."""


class ThreeSpan:
    """Paper 2's line; the wire has mass, but neither droppers nor an end."""

    massless: bool = False
    wires_per_collector: int = 1
    contact_share: float = 0.0  # its height at mid-step is exact
    grid: Mapping[str, float] = {}
    length: float = np.inf  # the line has no end

    def __init__(
        self,
        data: ThreeSpanData,
        *,
        lanes: int,
        collectors: int,
        spans: int,
        numerics: Numerics,
        runs: Runs,
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
        self.wire: Any = _at_rest(lanes, collectors, data.modes)
        self.contact_gain = contact_gain(self.line)
        alignment = data.alignment(spans)
        self.usual_end = alignment.length
        self.supports: Array = alignment.support(np.arange(1, spans))
        self.droppers: Array = np.zeros(0)
        compliance = float(self.line.at_support[0] ** 2 @ self.line.softness)
        self.start_point = StartPoint(0.0, compliance, 0.0)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put one lane at rest under a force (N) at the starting point."""
        self.wire.modal[lane, 0] = self.line.at_support[0] * self.line.softness * force
        self.wire.modal[lane, 1] = 0.0
        self.wire.central_span[lane] = 0

    def rest_tension(self, lane: int) -> Array:
        """No tension: the equivalent wire has no droppers."""
        return np.zeros(0)

    @cached_property
    def _view_shapes(self) -> Array:
        """Mode shapes at the points of a picture, (points, modes)."""
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


def _at_rest(lanes: int, collectors: int, size: int) -> ThreeSpanWire:
    return ThreeSpanWire(
        modal=np.zeros((lanes, 2, size)),
        contact_shape=np.zeros((lanes, collectors, size)),
        scratch=np.zeros((lanes, 2, size)),
        central_span=np.zeros(lanes, dtype=np.int64),
    )
