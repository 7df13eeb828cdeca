"""Periodic stiffness (paper 3, Eqs 1-5): a massless spring k(x) = k_m (1 + eps cos(2 pi x / L))."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from ....backend.block import WIDTH
from ....backend.compile import PART, part
from ....base.arrays import Array
from ... import step as coupling
from ...numerics import Numerics
from ...trigonometry import cosine_of_turns
from .schema import PeriodicStiffnessData

TIME_STEP = 5e-3
"""Unless told otherwise (s): forces within 0.2 % of the peak (tests/test_periodic_stiffness.py)."""


class PeriodicLine(NamedTuple):
    """Constants of the line."""

    mean: float  # k_m (N/m)
    variation: float  # epsilon (-)
    spans: float  # 1 / L, spans a metre (1/m)


WIDTH[PeriodicLine] = 64


class PeriodicWire(NamedTuple):
    """A massless wire has no state; Numba wants a field."""

    nothing: NDArray[np.float64]


def wave_speed(data: PeriodicStiffnessData) -> float:
    """Speed of waves along the wire (m/s): no wave runs along a spring."""
    return np.inf


def line_length(data: PeriodicStiffnessData, spans: int) -> float:
    """How far a run can go (m): the line has no end."""
    return np.inf


def line_end(data: PeriodicStiffnessData, spans: int) -> float:
    """How far a run goes unless told otherwise (m)."""
    return spans * data.span_length


def time_step(data: PeriodicStiffnessData, numerics: Numerics) -> float:
    """Time step (s) asked for, or the usual one."""
    return numerics.time_step or TIME_STEP


def build(data: PeriodicStiffnessData, spans: int, numerics: Numerics) -> PeriodicLine:
    """Constants of the line; there is no grid, and any time step will do."""
    return PeriodicLine(data.mean_stiffness, data.stiffness_variation, 1 / data.span_length)


def at_rest(line: PeriodicLine, lanes: int) -> PeriodicWire:
    """State of all lanes."""
    return PeriodicWire(np.zeros(lanes))


def start_point(line: PeriodicLine) -> tuple[float, float, float]:
    """Height (m), compliance of the wire, and of a massless spring (m/N), where a run starts."""
    return 0.0, 0.0, 1.0 / (line.mean * (1.0 + line.variation))


def settle(line: PeriodicLine, wire: PeriodicWire, lane: int, force: float) -> None:
    """Put one lane at rest under a force (N) at the starting point."""


def supports(data: PeriodicStiffnessData, spans: int) -> NDArray[np.float64]:
    """Positions (m) of the supports whose uplift is recorded: a spring has none."""
    return np.zeros(0)


def droppers(data: PeriodicStiffnessData, spans: int) -> NDArray[np.float64]:
    """Positions (m) of the droppers."""
    return np.zeros(0)


def static_tension(data: PeriodicStiffnessData, spans: int) -> Array:
    """Static tension (N) of the droppers."""
    return np.zeros(0)


@part
def stiffness(line, x):
    """Stiffness k (N/m) at x (m)."""
    return line.mean * (1.0 + line.variation * cosine_of_turns(line.spans * x))


@overload(coupling.move_wire, jit_options=PART)
def _move_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not PeriodicLine:
        return None

    def move(line, wire, lane, x0, x1, force):
        return 0.0, 0.0, 1.0 / stiffness(line, x1)

    return move


@overload(coupling.load_wire, jit_options=PART)
def _load_wire(line, wire, lane, x0, x1, force):
    if getattr(line, "instance_class", None) is not PeriodicLine:
        return None
    return lambda line, wire, lane, x0, x1, force: None


@overload(coupling.record_wire, jit_options=PART)
def _record_wire(line, wire, lane, uplift, tension):
    if getattr(line, "instance_class", None) is not PeriodicLine:
        return None
    return lambda line, wire, lane, uplift, tension: None
