"""Figures of an episode, kept as it runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..backend import inlined, lane_table
from ..base.arrays import Array
from ..metrics.figures import Figures
from ..metrics.low_pass import low_pass_sections
from ..plant.state import PLACE, ROW
from .state import EPISODE_ROWS, FIGURE_ROWS, TASK_ROW, TERM, TaskRow


class RunningFigures(NamedTuple):
    """Running sums of all lanes."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (2 sections,): its state settled at 1 N
    table: Array  # (FIGURE_ROWS, lanes): rows of ``TaskRow`` from FILTER_STATE on
    peak: Array  # (lanes, supports): largest uplift (m)

    def clear(self, lane: int) -> None:
        """Begin anew in one lane."""
        self.table[:, lane] = 0.0
        self.table[TaskRow.MAX - EPISODE_ROWS, lane] = -np.inf
        self.table[TaskRow.MIN - EPISODE_ROWS, lane] = np.inf
        self.peak[lane] = -np.inf

    def figures(
        self,
        lane: int,
        nominal_force: float,
        stride: float,
        time_step: float,
        supports: Array,
        steps: float,
    ) -> Figures:
        """Figures of one lane's run so far; supports: their positions (m); steps: since the line's start."""

        def row(name: TaskRow) -> float:
            return float(self.table[name - EPISODE_ROWS, lane])

        samples = row(TaskRow.SAMPLES)
        shift = row(TaskRow.DEVIATION) / samples
        mean = nominal_force + shift
        std = float(np.sqrt(max(row(TaskRow.SQUARED_DEVIATION) / samples - shift**2, 0.0)))
        peak = self.peak[lane, : len(supports)]
        first, last = (steps - samples - 0.5) * stride, (steps - 0.5) * stride  # where the train was
        passed = peak[(supports > first - 1e-6) & (supports < last + 1e-6)]
        rate = np.sqrt(row(TaskRow.SQUARED_CHANGE) / (samples - 1)) / time_step if samples > 1 else 0.0
        return Figures(
            mean=float(mean),
            std=std,
            statistical_max=float(mean + 3 * std),
            statistical_min=float(mean - 3 * std),
            max=row(TaskRow.MAX),
            min=row(TaskRow.MIN),
            max_uplift=float(passed.max()) if passed.size else float("nan"),
            contact_loss=float(100 * row(TaskRow.ALL_LOSS_STEPS) / samples),
            cost_function=row(TaskRow.ALL_COST),
            effort=float(np.sqrt(row(TaskRow.SQUARED_EFFORT) / samples)),
            effort_rate=float(rate),
            distance=float(samples * stride),
        )


def running_figures(lanes: int, supports: int, time_step: float) -> RunningFigures:
    """Sums of ``lanes`` lanes."""
    sections, settled = low_pass_sections(time_step)
    return RunningFigures(
        sections=sections.copy(),
        settled=settled.flatten(),
        table=lane_table(FIGURE_ROWS, lanes),
        peak=np.zeros((lanes, supports)),
    )


@inlined
def add_sample_to_figures(running, samples, block, task, begin, count):
    """Add the sample of the plant step that a block has just made."""
    for i in range(count):
        task[TASK_ROW.FILTERED_FORCE, i] = block[ROW.FORCE, i]
    for k in range(running.sections.shape[0]):  # direct form II transposed
        b0, b1, b2 = running.sections[k, 0], running.sections[k, 1], running.sections[k, 2]
        a1, a2 = running.sections[k, 4], running.sections[k, 5]
        settled_0, settled_1 = running.settled[2 * k], running.settled[2 * k + 1]
        state = task[TASK_ROW.FILTER_STATE + 2 * k : TASK_ROW.FILTER_STATE + 2 * k + 2]
        for i in range(count):
            first = task[TASK_ROW.SAMPLES, i] == 0.0
            s0 = settled_0 * block[ROW.FORCE, i] if first else state[0, i]
            s1 = settled_1 * block[ROW.FORCE, i] if first else state[1, i]
            value = task[TASK_ROW.FILTERED_FORCE, i]
            out = b0 * value + s0
            state[0, i] = b1 * value - a1 * out + s1
            state[1, i] = b2 * value - a2 * out
            task[TASK_ROW.FILTERED_FORCE, i] = out
    for i in range(count):
        filtered, nominal_force = task[TASK_ROW.FILTERED_FORCE, i], block[ROW.NOMINAL_FORCE, i]
        between = 0.0 if task[TASK_ROW.SAMPLES, i] == 0.0 else 1.0  # a change lies between two samples
        frame, head = block[ROW.FRAME_FORCE, i], block[ROW.HEAD_FORCE, i]
        frame_change = frame - task[TASK_ROW.LAST_ACTUATOR_FORCE + PLACE.FRAME, i]
        head_change = head - task[TASK_ROW.LAST_ACTUATOR_FORCE + PLACE.HEAD, i]
        task[TASK_ROW.SQUARED_CHANGE, i] += between * (
            frame_change * frame_change + head_change * head_change
        )
        task[TASK_ROW.SQUARED_EFFORT, i] += frame * frame + head * head
        task[TASK_ROW.LAST_ACTUATOR_FORCE + PLACE.FRAME, i] = frame
        task[TASK_ROW.LAST_ACTUATOR_FORCE + PLACE.HEAD, i] = head
        task[TASK_ROW.SAMPLES, i] += 1.0
        task[TASK_ROW.DEVIATION, i] += filtered - nominal_force
        task[TASK_ROW.SQUARED_DEVIATION, i] += (filtered - nominal_force) * (filtered - nominal_force)
        task[TASK_ROW.MAX, i] = max(task[TASK_ROW.MAX, i], filtered)
        task[TASK_ROW.MIN, i] = min(task[TASK_ROW.MIN, i], filtered)
    for s in range(running.peak.shape[1]):
        for i in range(count):
            row = min(int(block[ROW.STEP, i]), samples.uplift.shape[1] - 1)
            running.peak[begin + i, s] = max(running.peak[begin + i, s], samples.uplift[begin + i, row, s])


@inlined
def add_control_step_to_figures(task, count):
    """Add the cost and the losses of the control step that a block has just made."""
    for i in range(count):
        task[TASK_ROW.ALL_COST, i] += task[TASK_ROW.TERM + TERM.COST_FUNCTION, i]
        task[TASK_ROW.ALL_LOSS_STEPS, i] += task[TASK_ROW.LOSS_STEPS, i]
