"""Trace of one pass for the page: the contact force along two spans, and its spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from panto_env import Trajectory
from panto_env.base.arrays import Array
from panto_env.metrics.low_pass import CUTOFF, zero_phase_low_pass
from panto_env.metrics.spectrum import amplitudes
from panto_env.plant.alignment import Spans

from .settings import Line

STRIDE = 0.5
"""Distance (m) between points of a trace, unless the train is so slow that a peak would be missed."""
PER_PERIOD = 4
"""Points of a trace per period of the low-pass's cut-off frequency."""


@dataclass(frozen=True)
class Trace:
    """One policy's pass under the first seed; n points, m frequencies; rounded, for drawing only."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seed: int
    position: tuple[float, ...]  # (n,): equally spaced along the last two evaluated spans (m)
    force: tuple[float, ...]  # (n,): contact force, low-passed at 20 Hz without delay (N)
    frequency: tuple[float, ...]  # (m,): up to 20 Hz (Hz)
    amplitude: tuple[float, ...]  # (m,): of the unfiltered contact force over all evaluated spans (N)


def trace(run: Trajectory, spans: Spans, policy: str, line: Line) -> Trace:
    """Trace of a run that is evaluated over ``spans``, first and last, counted from 1.

    policy, line: with the benchmark's names for them; a run holds the names of the catalogue entries.
    """
    first, last = spans
    begin, end = run.alignment.limits((max(first, last - 1), last))
    stride = min(STRIDE, run.speed / (PER_PERIOD * CUTOFF))
    position = np.linspace(begin, end, round((end - begin) / stride) + 1)
    force = zero_phase_low_pass(run.contact_force, run.time_step)
    frequency, amplitude = amplitudes(run.contact_force[run.inside(spans)], run.time_step)
    shown = frequency <= CUTOFF
    return Trace(
        policy=policy,
        catenary=line.catenary,
        pantograph=line.pantograph,
        speed_kmh=run.speed_kmh,
        seed=run.seed,
        position=_rounded(position, 2),
        force=_rounded(np.interp(position, run.position, force), 2),
        frequency=_rounded(frequency[shown], 4),
        amplitude=_rounded(amplitude[shown], 4),
    )


def _rounded(values: Array, decimals: int) -> tuple[float, ...]:
    return tuple(values.round(decimals).tolist())
