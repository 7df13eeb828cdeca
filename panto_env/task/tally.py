"""Figures of an episode kept as it runs, where a batch has too many lanes to keep its samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..metrics import Figures, low_pass_sections
from ..plant.coupling import FRAME_FORCE, HEAD_FORCE, fetch, store
from ..plant.jit import part

# Columns of the sums.
COUNT, DEVIATION, SQUARE, MAX, MIN, LOST, COST, EFFORT, RATE = range(9)
SUMS = 9


class Tally(NamedTuple):
    """Running sums of all lanes; arrays of no lanes keep nothing."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (2 sections,): its state settled at 1 N
    filter: Array  # (2 sections, lanes): its state
    sums: Array  # (SUMS, lanes)
    forces: Array  # (2, lanes): actuator forces of the last sample (N)
    peak: Array  # (lanes, supports): largest uplift (m)


def tally(lanes: int, supports: int, time_step: float) -> Tally:
    """Sums of ``lanes`` lanes, none for 0."""
    sections, settled = low_pass_sections(time_step) if lanes else (np.zeros((0, 6)), np.zeros((0, 2)))
    return Tally(
        sections=sections,
        settled=settled.ravel(),
        filter=np.zeros((settled.size, lanes)),
        sums=np.zeros((SUMS, lanes)),
        forces=np.zeros((2, lanes)),
        peak=np.zeros((lanes, supports)),
    )


def clear(tally: Tally, lane: int) -> None:
    """Begin anew in one lane."""
    tally.sums[:, lane] = 0.0
    tally.sums[MAX, lane], tally.sums[MIN, lane] = -np.inf, np.inf
    tally.peak[lane] = -np.inf


@part
def load_tally(tally, scores, begin, count):
    """Fetch the sums of a block."""
    for k in range(tally.filter.shape[0]):
        fetch(tally.filter[k], scores.filter[k], begin, count)
    for k in range(SUMS):
        fetch(tally.sums[k], scores.sums[k], begin, count)
    for c in range(2):
        fetch(tally.forces[c], scores.forces[c], begin, count)


@part
def store_tally(tally, scores, begin, count):
    """Put them back."""
    for k in range(tally.filter.shape[0]):
        store(scores.filter[k], tally.filter[k], begin, count)
    for k in range(SUMS):
        store(scores.sums[k], tally.sums[k], begin, count)
    for c in range(2):
        store(scores.forces[c], tally.forces[c], begin, count)


@part
def count_sample(tally, scores, samples, block, begin, count):
    """Add the sample of the step that a block has just made."""
    state, filtered, sums, sample = scores.filter, scores.filtered, scores.sums, block.sample
    for i in range(count):
        filtered[i] = block.force[i]
    for k in range(tally.sections.shape[0]):  # direct form II transposed
        b0, b1, b2 = tally.sections[k, 0], tally.sections[k, 1], tally.sections[k, 2]
        a1, a2 = tally.sections[k, 4], tally.sections[k, 5]
        settled_0, settled_1 = tally.settled[2 * k], tally.settled[2 * k + 1]
        for i in range(count):
            first = sums[COUNT, i] == 0.0
            s0 = settled_0 * block.force[i] if first else state[2 * k, i]
            s1 = settled_1 * block.force[i] if first else state[2 * k + 1, i]
            out = b0 * filtered[i] + s0
            state[2 * k, i] = b1 * filtered[i] - a1 * out + s1
            state[2 * k + 1, i] = b2 * filtered[i] - a2 * out
            filtered[i] = out
    for i in range(count):
        more = 0.0 if sums[COUNT, i] == 0.0 else 1.0
        frame, head = sample[FRAME_FORCE, i], sample[HEAD_FORCE, i]
        jump, pair_jump = frame - scores.forces[0, i], head - scores.forces[1, i]
        sums[RATE, i] += more * (jump * jump + pair_jump * pair_jump)
        sums[EFFORT, i] += frame * frame + head * head
        scores.forces[0, i] = frame
        scores.forces[1, i] = head
    for i in range(count):
        deviation = filtered[i] - scores.nominal[i]
        sums[COUNT, i] += 1.0
        sums[DEVIATION, i] += deviation
        sums[SQUARE, i] += deviation * deviation
        sums[MAX, i] = max(sums[MAX, i], filtered[i])
        sums[MIN, i] = min(sums[MIN, i], filtered[i])
        sums[LOST, i] += 1.0 if block.force[i] <= 0.0 else 0.0
    for s in range(tally.peak.shape[1]):
        for i in range(count):
            peak, uplift = tally.peak[begin + i], samples.uplift[begin + i, 0]
            peak[s] = max(peak[s], uplift[s])


def figures(
    tally: Tally, lane: int, nominal: float, stride: float, time_step: float, supports: Array
) -> Figures:
    """Figures of one lane's run so far; supports: their positions (m)."""
    sums = tally.sums[:, lane]
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
