"""Figures of an episode, kept as it runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..backend.compile import part
from ..base.arrays import Array
from ..metrics.figures import Figures
from ..metrics.low_pass import low_pass_sections
from ..plant.step import FORCE, FRAME_FORCE, HEAD_FORCE, STEP, lane_table
from .rows import (
    COUNT,
    DEVIATION,
    EFFORTS,
    FILTER,
    FILTERED,
    FORCES,
    LOSSES,
    MAX,
    MIN,
    NOMINAL,
    RATES,
    SQUARE,
    TALLIED,
    TOTAL,
)


class Tally(NamedTuple):
    """Running sums of all lanes."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (2 sections,): its state settled at 1 N
    lanes: Array  # (TALLIED - FILTER, lanes): the rows of ``scores``
    peak: Array  # (lanes, supports): largest uplift (m)


def tally(lanes: int, supports: int, time_step: float) -> Tally:
    """Sums of ``lanes`` lanes."""
    sections, settled = low_pass_sections(time_step)
    return Tally(
        sections=sections.copy(),
        settled=settled.flatten(),
        lanes=lane_table(TALLIED - FILTER, lanes),
        peak=np.zeros((lanes, supports)),
    )


def clear(tally: Tally, lane: int) -> None:
    """Begin anew in one lane."""
    tally.lanes[:, lane] = 0.0
    tally.lanes[MAX - FILTER, lane], tally.lanes[MIN - FILTER, lane] = -np.inf, np.inf
    tally.peak[lane] = -np.inf


@part
def count_sample(tally, samples, block, scores, begin, count):
    """Add the sample of the step that a block has just made."""
    for i in range(count):
        scores[FILTERED, i] = block[FORCE, i]
    for k in range(tally.sections.shape[0]):  # direct form II transposed
        b0, b1, b2 = tally.sections[k, 0], tally.sections[k, 1], tally.sections[k, 2]
        a1, a2 = tally.sections[k, 4], tally.sections[k, 5]
        settled_0, settled_1 = tally.settled[2 * k], tally.settled[2 * k + 1]
        state = scores[FILTER + 2 * k : FILTER + 2 * k + 2]
        for i in range(count):
            first = scores[COUNT, i] == 0.0
            s0 = settled_0 * block[FORCE, i] if first else state[0, i]
            s1 = settled_1 * block[FORCE, i] if first else state[1, i]
            value = scores[FILTERED, i]
            out = b0 * value + s0
            state[0, i] = b1 * value - a1 * out + s1
            state[1, i] = b2 * value - a2 * out
            scores[FILTERED, i] = out
    for i in range(count):
        filtered, nominal = scores[FILTERED, i], scores[NOMINAL, i]
        more = 0.0 if scores[COUNT, i] == 0.0 else 1.0
        frame, head = block[FRAME_FORCE, i], block[HEAD_FORCE, i]
        jump, pair_jump = frame - scores[FORCES, i], head - scores[FORCES + 1, i]
        scores[RATES, i] += more * (jump * jump + pair_jump * pair_jump)
        scores[EFFORTS, i] += frame * frame + head * head
        scores[FORCES, i] = frame
        scores[FORCES + 1, i] = head
        scores[COUNT, i] += 1.0
        scores[DEVIATION, i] += filtered - nominal
        scores[SQUARE, i] += (filtered - nominal) * (filtered - nominal)
        scores[MAX, i] = max(scores[MAX, i], filtered)
        scores[MIN, i] = min(scores[MIN, i], filtered)
    for s in range(tally.peak.shape[1]):
        for i in range(count):
            row = min(int(block[STEP, i]), samples.uplift.shape[1] - 1)
            tally.peak[begin + i, s] = max(tally.peak[begin + i, s], samples.uplift[begin + i, row, s])


def figures(
    tally: Tally, lane: int, nominal: float, stride: float, time_step: float, supports: Array
) -> Figures:
    """Figures of one lane's run so far; supports: their positions (m)."""
    sums = np.concatenate((np.zeros(FILTER), tally.lanes[:, lane]))
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
        contact_loss=float(100 * sums[LOSSES] / samples),
        cost_function=float(sums[TOTAL]),
        effort=float(np.sqrt(sums[EFFORTS] / samples)),
        effort_rate=float(np.sqrt(sums[RATES] / (samples - 1)) / time_step) if samples > 1 else 0.0,
        distance=float(samples * stride),
    )
