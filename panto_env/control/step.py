"""Kernels of a control step: actions, plant steps, figures, endings, results."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..backend import NOT_NEGATIVE, inlined, kernel, open_packed
from ..base.arrays import Array
from ..plant.alignment import between_supports
from ..plant.catenary.protocol import ending_by_wire
from ..plant.sensors import take_first_readings, take_readings
from ..plant.state import ENDING, LARGEST_HEIGHT, PLACE, ROW
from ..plant.step import record_lane, step_lane
from ..plant.train import mean_stride, place_on_line, position
from .faults import spoil_command, spoil_readings
from .memory import keep_front
from .observation import (
    begin_averages,
    begin_history,
    entry_of,
    go_on_with_averages,
    prepare_entries,
    remember,
    use_noise,
)
from .reward import (
    add_sample_to_terms,
    add_to_limits,
    begin_terms,
    compute_cost,
    compute_reward,
    early_end_charge,
    forget_reward,
    steps_left,
)
from .state import FLAG, NOW, RESULT, RESULT_ROWS, TASK_ROW


class RunningFigures(NamedTuple):
    """Arrays for the figures of all lanes, besides the rows of ``TaskRow``."""

    sections: Array  # (sections, 6): EN 50317's filter, second-order sections
    settled: Array  # (2 sections,): its state settled at 1 N
    peak: Array  # (lanes, supports): maximum uplift (m)


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
        row = min(int(own[ROW.STEP]), samples.uplift.shape[2] - 1) & NOT_NEGATIVE
        peak, uplift = running.peak[own_peak], samples.uplift[lane, :, row]
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


@inlined
def take_action(episode, own, task, now, lane, row):
    """Clip an action, and set the requested forces and the reward's terms for the action.

    With a washout the slow average of the actuator's force is subtracted first, so that the action can't move
    the mean contact force.
    """
    for place in (PLACE.FRAME, PLACE.HEAD):
        own[ROW.COMMAND + place] = 0.0
    now[NOW.EFFORT] = 0.0
    now[NOW.RATE] = 0.0
    for a in range(episode.places.size):
        action, acted = min(1.0, max(-1.0, episode.action[row, a])), episode.places[a]
        if episode.washout_share > 0.0:
            washed_out = TASK_ROW.WASHED_OUT + acted
            task[washed_out] += (
                episode.washout_share * own[ROW.FRAME_FORCE + acted] * (1.0 / episode.force_limit)
            )
            action = min(1.0, max(-1.0, action - task[washed_out]))
        change = 0.5 * (action - task[TASK_ROW.ACTION + a])
        now[NOW.EFFORT] += action * action
        now[NOW.RATE] += change * change
        task[TASK_ROW.ACTION + a] = action
        own[ROW.COMMAND + acted] = action * episode.force_limit
    if episode.faults.table.shape[1] > 0:
        spoil_command(episode.faults, own, lane, row)


@inlined
def ending_of_head(run, episode, collector, lane, ending):
    """Why a run ends because of a collector's head; ``ending`` unless it does."""
    own = run.table[collector, lane]
    height = own[ROW.STATE]
    if run.levels.size > 0:
        x = place_on_line(run, collector, lane, own[ROW.STEP])
        height -= between_supports(run.alignment, run.levels, x)
    if not abs(height) <= episode.head_range:
        ending = ENDING.HEAD
    if not abs(own[ROW.STATE]) <= LARGEST_HEIGHT:  # nor is NaN
        ending = ENDING.DIVERGED
    return ending


@inlined
def ending_of(line, wire, run, episode, lane):
    """Why a lane's run ends here; ``ENDING.NONE`` unless it does early."""
    agents, ending = len(episode.controlled), ending_by_wire(line, wire, lane)
    for a in range(agents):
        if episode.table[lane * agents + a, TASK_ROW.LOSS_STEPS_IN_A_ROW] >= episode.loss_limit:
            ending = ENDING.LOSS
    for c in range(len(run.distance)):
        ending = ending_of_head(run, episode, c, lane, ending)
    return ending


@inlined
def end_episode(episode, own, task, values, flags, ending):
    """Whether a controlled collector's episode ends here; an early end is charged to reward and cost."""
    early, at_end = ending > 0, own[ROW.STEP] >= task[TASK_ROW.END]
    if ending == ENDING.DIVERGED:
        forget_reward(values)
    left = steps_left(episode, own, task) if early else 0.0
    values[RESULT.REWARD] -= early_end_charge(episode, own, task, left) if early else 0.0
    values[RESULT.COST] += left * episode.cost_weights[0]
    task[TASK_ROW.ENDING] = ending
    flags[FLAG.TERMINATED] = early
    flags[FLAG.TRUNCATED] = at_end and not early
    return early or at_end


@inlined
def write_sample(run, collector, own, values, lane):
    """Write a collector's last sample into its results."""
    values[RESULT.CONTACT_FORCE] = own[ROW.CONTACT_FORCE]
    values[RESULT.HEAD_HEIGHT] = own[ROW.HEAD_HEIGHT]
    values[RESULT.WIRE_HEIGHT] = own[ROW.WIRE_HEIGHT]
    values[RESULT.FRAME_FORCE] = own[ROW.FRAME_FORCE]
    values[RESULT.HEAD_FORCE] = own[ROW.HEAD_FORCE]
    values[RESULT.POSITION] = position(run, collector, lane, own[ROW.STEP])


@inlined
def plant_steps(line, wire, pantographs, actuators, run, sensors, samples, episode, running, lane):
    """Make the plant steps of a control step in one lane, and add up what its collectors do."""
    agents = len(episode.controlled)
    for step in range(1, episode.control_steps + 1):
        for a in range(agents):
            own, now = run.table[episode.controlled[a], lane], episode.now[lane * agents + a]
            now[NOW.FORCE_BEFORE] = own[ROW.CONTACT_FORCE]
            now[NOW.FRAME_BEFORE] = own[ROW.FRAME_FORCE]
            now[NOW.HEAD_BEFORE] = own[ROW.HEAD_FORCE]
        step_lane(line, wire, pantographs, actuators, run, lane)
        record_lane(line, wire, run, samples, lane)
        for a in range(agents):
            c, row = episode.controlled[a], lane * agents + a
            own, task, now = run.table[c, lane], episode.table[row], episode.now[row]
            add_sample_to_terms(own, task, now)
            add_sample_to_figures(running, samples, own, task, now, lane, row)
            take_readings(sensors, c, step, own, now[NOW.READING :], lane)
            if episode.front.ahead.size > 0 and not front_is_controlled(episode, a):
                c = episode.front.collector[a]
                take_readings(sensors, c, step, run.table[c, lane], episode.front.reading[row], lane)
    if episode.front.ahead.size > 0:
        for a in range(agents):
            row = lane * agents + a
            if front_is_controlled(episode, a):
                reading = episode.now[row - 1, NOW.READING :]
            else:
                reading = episode.front.reading[row]
            keep_front(episode, sensors, run, reading, a, lane, row)


@inlined
def front_is_controlled(episode, agent):
    """Whether the pantograph in front of a controlled one is the controlled one before it."""
    return agent > 0 and episode.controlled[agent - 1] == episode.front.collector[agent]


@inlined
def control_lane(packed, entries, values, flags, lane):
    """Make control steps in one lane, none beyond the end of its episode, and write its results.

    Each of its controlled collectors has a row of results. Returns whether its episode has ended.
    """
    line, wire, pantographs, actuators, run, sensors, samples, episode, running = open_packed(packed)
    agents, ended = len(episode.controlled), False
    for a in range(agents):
        row = lane * agents + a
        own, task, now = run.table[episode.controlled[a], lane], episode.table[row], episode.now[row]
        take_action(episode, own, task, now, lane, row)
    for _ in range(episode.steps[lane]):
        if run.table[0, lane, ROW.STEP] >= episode.table[lane * agents, TASK_ROW.END]:
            break  # beyond the end there are neither line nor rows of samples
        for a in range(agents):
            now = episode.now[lane * agents + a]
            begin_terms(episode.table[lane * agents + a], now)
            now[NOW.STRIDE] = mean_stride(run, episode.controlled[a], lane, float(episode.control_steps))
        plant_steps(line, wire, pantographs, actuators, run, sensors, samples, episode, running, lane)
        ending = ending_of(line, wire, run, episode, lane)
        for a in range(agents):
            row = lane * agents + a
            own, task, now = run.table[episode.controlled[a], lane], episode.table[row], episode.now[row]
            if episode.faults.table.shape[1] > 0:
                spoil_readings(episode.faults, own, now[NOW.READING :], lane, row)
            go_on_with_averages(episode, now, row)
            compute_reward(episode, own, task, now, values[row])
            compute_cost(episode, now, values[row])
            if own[ROW.STEP] > task[TASK_ROW.COUNTED_FROM]:
                add_control_step_to_figures(task, now)
            else:
                forget_reward(values[row])
            ended = end_episode(episode, own, task, values[row], flags[row], ending)
        if ended:
            break
    for a in range(agents):
        c, row = episode.controlled[a], lane * agents + a
        own, task, now = run.table[c, lane], episode.table[row], episode.now[row]
        prepare_entries(episode, sensors, run, own, now, a, lane, row)
        diverged = task[TASK_ROW.ENDING] == ENDING.DIVERGED
        for k in range(entries.shape[1]):
            entry = entry_of(episode, own, task, now, k)
            entries[row, k] = 0.0 if diverged else entry
        remember(episode, task, now)
        write_sample(run, c, own, values[row], lane)
    use_noise(sensors, lane)
    return ended


@inlined
def all_finite(action):
    """Whether all actions, (rows, actions), are finite."""
    for row in range(action.shape[0]):
        for a in range(action.shape[1]):
            if not math.isfinite(action[row, a]):
                return False
    return True


@kernel
def control_steps(packed, entries, values, flags, first, last):
    """Make control steps in the lanes from ``first`` to before ``last`` under ``episode.action``.

    Returns 0 where no episode has ended, 1 where one has, and -1, without a step, where an action is not
    finite. Results go to entries, values and flags, as in ``Results``. Idle lanes are skipped. packed: line,
    wire, pantographs, actuators, run, sensors, samples, episode, running figures.
    """
    _, _, _, _, _, _, _, episode, _ = open_packed(packed)
    if not all_finite(episode.action):
        return -1
    answer = 0
    for lane in range(first, last):
        if not episode.idle[lane] and control_lane(packed, entries, values, flags, lane):
            answer = 1
    return answer


@kernel
def observe_start(packed, entries, values, flags, first, last):
    """Write the results of lanes at their start, except idle ones; arguments as in ``control_steps``."""
    _, _, _, _, run, sensors, _, episode, _ = open_packed(packed)
    agents = len(episode.controlled)
    for lane in range(first, last):
        if not episode.idle[lane]:
            for a in range(agents):
                c, row = episode.controlled[a], lane * agents + a
                own, task, now = run.table[c, lane], episode.table[row], episode.now[row]
                take_first_readings(sensors, c, own, now[NOW.READING :], lane)
                if episode.faults.table.shape[1] > 0:
                    spoil_readings(episode.faults, own, now[NOW.READING :], lane, row)
                begin_averages(episode, now, row)
                prepare_entries(episode, sensors, run, own, now, a, lane, row)
                begin_history(episode, task, now)
                for k in range(entries.shape[1]):
                    entries[row, k] = entry_of(episode, own, task, now, k)
                for k in range(RESULT_ROWS):
                    values[row, k] = 0.0
                write_sample(run, c, own, values[row], lane)
                for k in range(flags.shape[1]):
                    flags[row, k] = False
            use_noise(sensors, lane)
