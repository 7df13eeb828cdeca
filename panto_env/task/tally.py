"""Figures of an episode kept as it runs, where a batch has too many lanes to keep its samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..metrics import Figures, low_pass_sections
from ..plant import coupling
from ..plant.jit import part

# Columns of the sums.
COUNT, DEVIATION, SQUARE, MAX, MIN, LOST, COST, EFFORT, RATE = range(9)


class Tally(NamedTuple):
    """Running sums of all lanes; arrays of no lanes keep nothing."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (sections, 2): its state settled at 1 N
    filter: Array  # (lanes, sections, 2): its state
    sums: Array  # (lanes, 9)
    forces: Array  # (lanes, 2): actuator forces of the last sample (N)
    peak: Array  # (lanes, supports): largest uplift (m)


def tally(lanes: int, supports: int, time_step: float) -> Tally:
    """Sums of ``lanes`` lanes, none for 0."""
    sections, settled = low_pass_sections(time_step) if lanes else (np.zeros((0, 6)), np.zeros((0, 2)))
    return Tally(
        sections=sections,
        settled=settled,
        filter=np.zeros((lanes, *settled.shape)),
        sums=np.zeros((lanes, 9)),
        forces=np.zeros((lanes, 2)),
        peak=np.zeros((lanes, supports)),
    )


def clear(tally: Tally, lane: int) -> None:
    """Begin anew in one lane."""
    tally.sums[lane] = 0.0
    tally.sums[lane, MAX], tally.sums[lane, MIN] = -np.inf, np.inf
    tally.peak[lane] = -np.inf


@part
def count(tally, episode, run, samples, lane):
    """Add the samples of the control step that one lane has just made."""
    if tally.sums.shape[0] == 0:
        return
    sums, state, sections = tally.sums[lane], tally.filter[lane], tally.sections
    rows, nominal = samples.channels.shape[1], episode.nominal[lane]
    n = run.step[lane]
    for i in range(n - episode.control_steps + 1, n + 1):
        row = samples.channels[lane, i % rows]
        force = row[coupling.CONTACT_FORCE]
        frame, head = row[coupling.FRAME_FORCE], row[coupling.HEAD_FORCE]
        if sums[COUNT] == 0:
            for k in range(state.shape[0]):
                state[k, 0] = tally.settled[k, 0] * force
                state[k, 1] = tally.settled[k, 1] * force
        else:
            sums[RATE] += (frame - tally.forces[lane, 0]) ** 2 + (head - tally.forces[lane, 1]) ** 2
        filtered = force
        for k in range(state.shape[0]):  # direct form II transposed
            b0, b1, b2 = sections[k, 0], sections[k, 1], sections[k, 2]
            a1, a2 = sections[k, 4], sections[k, 5]
            out = b0 * filtered + state[k, 0]
            state[k, 0] = b1 * filtered - a1 * out + state[k, 1]
            state[k, 1] = b2 * filtered - a2 * out
            filtered = out
        sums[COUNT] += 1.0
        sums[DEVIATION] += filtered - nominal
        sums[SQUARE] += (filtered - nominal) ** 2
        sums[MAX] = max(sums[MAX], filtered)
        sums[MIN] = min(sums[MIN], filtered)
        sums[LOST] += 1.0 if force <= 0 else 0.0
        sums[EFFORT] += frame**2 + head**2
        tally.forces[lane, 0], tally.forces[lane, 1] = frame, head
        for s in range(tally.peak.shape[1]):
            tally.peak[lane, s] = max(tally.peak[lane, s], samples.uplift[lane, i % rows, s])
    sums[COST] += episode.terms[lane, 0]


def figures(
    tally: Tally, lane: int, nominal: float, stride: float, time_step: float, supports: Array
) -> Figures:
    """Figures of one lane's run so far; supports: their positions (m)."""
    sums = tally.sums[lane]
    samples = sums[COUNT]
    shift = sums[DEVIATION] / samples
    mean, std = nominal + shift, float(np.sqrt(max(sums[SQUARE] / samples - shift**2, 0.0)))
    passed = tally.peak[lane, : len(supports)][supports < (samples - 0.5) * stride + 1e-6]
    return Figures(
        mean=float(mean),
        std=std,
        statistical_max=float(mean + 3 * std),
        statistical_min=float(mean - 3 * std),
        max=float(sums[MAX]),
        min=float(sums[MIN]),
        max_uplift=float(passed.max()) if passed.size else float("nan"),
        contact_loss=float(100 * sums[LOST] / samples),
        cost_function=float(sums[COST]),
        effort=float(np.sqrt(sums[EFFORT] / samples)),
        effort_rate=float(np.sqrt(sums[RATE] / (samples - 1)) / time_step) if samples > 1 else 0.0,
        distance=float(samples * stride),
    )
