"""Figures of an episode, updated during the run."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..backend import NOT_NEGATIVE, inlined
from ..base.arrays import Array
from ..metrics.low_pass import low_pass_sections
from ..plant.state import ROW, Row
from .safety import add_to_limits
from .state import NOW, TASK_ROW, TaskRow


class RunningFigures(NamedTuple):
    """Arrays for the figures of all lanes, besides the rows of ``TaskRow``."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (2 sections,): its state settled at 1 N
    peak: Array  # (lanes, supports): maximum uplift (m)


def running_figures(lanes: int, supports: int, time_step: float) -> RunningFigures:
    """Arrays for the running figures of all lanes; time_step: s."""
    sections, settled = low_pass_sections(time_step)
    return RunningFigures(sections.copy(), settled.flatten(), np.zeros((lanes, supports)))


def no_figures(rows: int) -> Array:
    """Values of a number of rows of ``TaskRow`` at the start of an episode, (rows,)."""
    values = np.zeros(rows)
    values[TaskRow.MAX], values[TaskRow.MIN] = -np.inf, np.inf
    return values


def figures_so_far(
    table: Array,
    peak: Array,
    run: Array,
    supports: Array,
    time_step: float,
    ahead: Callable[[Array], Array],
    behind: Array,
) -> dict[str, Array]:
    """The ``Figures`` of runs so far, by name, (runs,) each.

    table: (runs, rows of TaskRow). peak: (runs, supports). run: (runs, rows of Row). supports: their
    positions (m). time_step: s. ahead: from numbers of steps, (runs, n), to the lead of the trains over
    steady ones (m), (runs, n). behind: distance of the collectors behind the first ones (m), (runs,).
    """
    stride, steps = run[:, Row.STRIDE], run[:, Row.STEP]
    samples = table[:, TaskRow.SAMPLES]
    shift = table[:, TaskRow.DEVIATION] / samples
    mean = run[:, Row.NOMINAL_FORCE] + shift
    std = np.sqrt(np.maximum(table[:, TaskRow.SQUARED_DEVIATION] / samples - shift**2, 0.0))
    begin = steps - samples
    shifted = ahead(np.stack([begin, steps], axis=1)).T
    # Positions of the first and last sample: half a step before each end.
    first = (begin - 0.5) * stride + shifted[0] - behind
    last = (steps - 0.5) * stride + shifted[1] - behind
    passed = (supports > first[:, None] - 1e-6) & (supports < last[:, None] + 1e-6)
    largest = np.max(np.where(passed, peak, -np.inf), axis=1, initial=-np.inf)
    changes = np.maximum(samples - 1, 1.0)
    return {
        "mean": mean,
        "std": std,
        "statistical_max": mean + 3 * std,
        "statistical_min": mean - 3 * std,
        "max": table[:, TaskRow.MAX],
        "min": table[:, TaskRow.MIN],
        "max_uplift": np.where(passed.any(axis=1), largest, np.nan),
        "contact_loss": 100 * table[:, TaskRow.ALL_LOSS_STEPS] / samples,
        "cost_function": table[:, TaskRow.ALL_COST],
        "effort": np.sqrt(table[:, TaskRow.SQUARED_EFFORT] / samples),
        "effort_rate": np.sqrt(table[:, TaskRow.SQUARED_CHANGE] / changes) / time_step,
        "distance": samples * stride + (shifted[1] - shifted[0]),
    }


@inlined
def low_pass(running, task, force):
    """Contact force (N) behind EN 50317's filter, second-order sections in direct form II transposed."""
    value, states = force, task[TASK_ROW.FILTER_STATE :]
    if task[TASK_ROW.FILTERED] == 0.0:  # the filter begins settled at the first sample
        for k in range(running.settled.size):
            states[k] = running.settled[k] * force
    for k in range(running.sections.shape[0]):
        b0, b1, b2 = running.sections[k, 0], running.sections[k, 1], running.sections[k, 2]
        a1, a2 = running.sections[k, 4], running.sections[k, 5]
        state = states[2 * k :]
        out = b0 * value + state[0]
        state[0] = b1 * value - a1 * out + state[1]
        state[1] = b2 * value - a2 * out
        value = out
    task[TASK_ROW.FILTERED] += 1.0
    return value


@inlined
def add_sample_to_figures(running, samples, own, task, now, lane, own_peak):
    """Add a plant step; own_peak: row of the collector in ``RunningFigures.peak``.

    Before what counts only the filter and the uplift go on.
    """
    highest = 0.0
    filtered, nominal_force = low_pass(running, task, own[ROW.CONTACT_FORCE]), own[ROW.NOMINAL_FORCE]
    if running.peak.shape[1] > 0:
        row = min(int(own[ROW.STEP]), samples.uplift.shape[1] - 1) & NOT_NEGATIVE
        peak, uplift = running.peak[own_peak], samples.uplift[lane, row]
        for s in range(peak.size):
            peak[s] = max(peak[s], uplift[s])
            highest = max(highest, uplift[s])
    add_to_limits(task, now, filtered, highest)
    if own[ROW.STEP] <= task[TASK_ROW.COUNTED_FROM]:
        return
    between = 0.0 if task[TASK_ROW.SAMPLES] == 0.0 else 1.0  # a change lies between two samples
    frame, head = own[ROW.FRAME_FORCE], own[ROW.HEAD_FORCE]
    frame_change, head_change = frame - now[NOW.FRAME_BEFORE], head - now[NOW.HEAD_BEFORE]
    task[TASK_ROW.SQUARED_CHANGE] += between * (frame_change * frame_change + head_change * head_change)
    task[TASK_ROW.SQUARED_EFFORT] += frame * frame + head * head
    task[TASK_ROW.SAMPLES] += 1.0
    deviation = filtered - nominal_force
    task[TASK_ROW.DEVIATION] += deviation
    task[TASK_ROW.SQUARED_DEVIATION] += deviation * deviation
    task[TASK_ROW.MAX] = max(filtered, task[TASK_ROW.MAX])
    task[TASK_ROW.MIN] = min(filtered, task[TASK_ROW.MIN])


@inlined
def add_control_step_to_figures(task, now):
    """Add the cost and the losses of a control step."""
    task[TASK_ROW.ALL_COST] += now[NOW.STRIDE] * (0.5 * now[NOW.COST])
    task[TASK_ROW.ALL_LOSS_STEPS] += now[NOW.LOSS_STEPS]
