"""The control step of all lanes, from action to observation, in one kernel call."""

from __future__ import annotations

import math

from ..backend import inlined, kernel, open_packed
from ..plant.alignment import between_supports
from ..plant.catenary.protocol import ending_by_wire
from ..plant.sensors import take_first_readings, take_readings
from ..plant.state import PLACE, ROW
from ..plant.step import record_lane, step_lane
from ..plant.train import mean_stride, position
from ..plant.valid_range import ENDING, LARGEST_HEIGHT
from .observation import begin_history, entry_of, prepare_entries, remember
from .reward import (
    add_sample_to_terms,
    begin_terms,
    compute_reward,
    early_end_charge,
    forget_reward,
    steps_left,
)
from .running_figures import add_control_step_to_figures, add_sample_to_figures
from .safety import compute_cost
from .state import CONTROLLED, FLAG, NOW, RESULT, RESULT_ROWS, TASK_ROW


@inlined
def take_action(run, episode, own, task, now, lane):
    """Clip a lane's action, and set the requested forces and the reward's terms for the action.

    With a washout the slow average of the actuator's force is subtracted first, so that the action can't move
    the mean contact force.
    """
    for c in range(len(run.distance)):
        for place in (PLACE.FRAME, PLACE.HEAD):
            run.table[c, lane, ROW.COMMAND + place] = 0.0
    now[NOW.EFFORT] = 0.0
    now[NOW.RATE] = 0.0
    for a in range(episode.places.size):
        action, acted = min(1.0, max(-1.0, episode.action[lane, a])), episode.places[a]
        if episode.washout_share > 0.0:
            row = TASK_ROW.WASHED_OUT + acted
            task[row] += episode.washout_share * own[ROW.FRAME_FORCE + acted] * (1.0 / episode.force_limit)
            action = min(1.0, max(-1.0, action - task[row]))
        change = 0.5 * (action - task[TASK_ROW.ACTION + a])
        now[NOW.EFFORT] += action * action
        now[NOW.RATE] += change * change
        task[TASK_ROW.ACTION + a] = action
        own[ROW.COMMAND + acted] = action * episode.force_limit


@inlined
def end_episode(line, wire, run, episode, own, task, values, flags, lane):
    """Whether a lane's episode ends here; an early end is charged to reward and cost."""
    ending = ending_by_wire(line, wire, lane)
    if task[TASK_ROW.LOSS_STEPS_IN_A_ROW] >= episode.loss_limit:
        ending = ENDING.LOSS
    height = own[ROW.STATE]
    if episode.levels.size > 0:
        x = position(run, CONTROLLED, lane, own[ROW.STEP])
        height -= between_supports(episode.alignment, episode.levels, x)
    if not abs(height) <= episode.head_range:
        ending = ENDING.HEAD
    if not abs(own[ROW.STATE]) <= LARGEST_HEIGHT:  # nor is NaN
        ending = ENDING.DIVERGED
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
def write_sample(run, own, values, lane):
    """Write a lane's last sample into its results."""
    values[RESULT.CONTACT_FORCE] = own[ROW.CONTACT_FORCE]
    values[RESULT.HEAD_HEIGHT] = own[ROW.HEAD_HEIGHT]
    values[RESULT.WIRE_HEIGHT] = own[ROW.WIRE_HEIGHT]
    values[RESULT.FRAME_FORCE] = own[ROW.FRAME_FORCE]
    values[RESULT.HEAD_FORCE] = own[ROW.HEAD_FORCE]
    values[RESULT.POSITION] = position(run, CONTROLLED, lane, own[ROW.STEP])


@inlined
def control_lane(packed, entries, values, flags, lane):
    """Make control steps in one lane, none beyond the end of its episode, and write its results, each (n,).

    Returns whether its episode has ended.
    """
    line, wire, pantographs, actuators, run, sensors, samples, episode, running = open_packed(packed)
    own, task, now = run.table[CONTROLLED, lane], episode.table[lane], episode.now[lane]
    take_action(run, episode, own, task, now, lane)
    ended = False
    for _ in range(episode.steps[lane]):
        if own[ROW.STEP] >= task[TASK_ROW.END]:
            break  # beyond the end there are neither line nor rows of samples
        counts = own[ROW.STEP] >= task[TASK_ROW.COUNTED_FROM]
        begin_terms(task, now)
        now[NOW.STRIDE] = mean_stride(run, CONTROLLED, lane, float(episode.control_steps))
        for step in range(1, episode.control_steps + 1):
            force, frame, head = own[ROW.CONTACT_FORCE], own[ROW.FRAME_FORCE], own[ROW.HEAD_FORCE]
            step_lane(line, wire, pantographs, actuators, run, lane)
            record_lane(line, wire, run, samples, lane)
            add_sample_to_terms(own, task, now, force)
            add_sample_to_figures(running, samples, own, task, now, frame, head, lane)
            take_readings(sensors, CONTROLLED, step, own, now[NOW.READING :], lane)
        compute_reward(episode, own, task, now, values)
        compute_cost(episode, now, values)
        if counts:
            add_control_step_to_figures(task, now)
        else:
            forget_reward(values)
        ended = end_episode(line, wire, run, episode, own, task, values, flags, lane)
        if ended:
            break
    prepare_entries(episode, sensors, run, own, now, lane)
    diverged = task[TASK_ROW.ENDING] == ENDING.DIVERGED
    for k in range(entries.size):
        entry = entry_of(episode, own, task, now, k)
        entries[k] = 0.0 if diverged else entry
    remember(episode, task, now)
    write_sample(run, own, values, lane)
    return ended


@inlined
def all_finite(action):
    """Whether all actions, (lanes, actions), are finite."""
    for lane in range(action.shape[0]):
        for a in range(action.shape[1]):
            if not math.isfinite(action[lane, a]):
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
        if not episode.idle[lane] and control_lane(packed, entries[lane], values[lane], flags[lane], lane):
            answer = 1
    return answer


@kernel
def observe_start(packed, entries, values, flags, first, last):
    """Write the results of lanes at their start, except idle ones; arguments as in ``control_steps``."""
    _, _, _, _, run, sensors, _, episode, _ = open_packed(packed)
    for lane in range(first, last):
        if not episode.idle[lane]:
            own, task, now = run.table[CONTROLLED, lane], episode.table[lane], episode.now[lane]
            take_first_readings(sensors, CONTROLLED, own, now[NOW.READING :], lane)
            prepare_entries(episode, sensors, run, own, now, lane)
            begin_history(episode, task, now)
            for k in range(entries.shape[1]):
                entries[lane, k] = entry_of(episode, own, task, now, k)
            for k in range(RESULT_ROWS):
                values[lane, k] = 0.0
            write_sample(run, own, values[lane], lane)
            for k in range(flags.shape[1]):
                flags[lane, k] = False
