"""The control step of all lanes, from action to observation, in one kernel call."""

from __future__ import annotations

from ..backend import (
    HELPER,
    LEADER,
    any_of,
    choose,
    columns,
    columns_across,
    found_anywhere,
    hand_out,
    inlined,
    kernel,
    larger,
    magnitude,
    new_columns,
    next_share,
    number_at,
    open_packed,
    put_across,
    results_of,
    rows_from,
    share_done,
    smaller,
    width_of,
)
from ..plant.catenary.protocol import ending_by_wire
from ..plant.drift import mean_stride, position_after
from ..plant.sensors import take_first_readings, take_readings
from ..plant.state import CONTACTS, PLACE, ROW, SCRATCH, SCRATCH_ROWS
from ..plant.step import new_scratch, record_group, step_group
from ..plant.valid_range import ENDING, LARGEST_HEIGHT
from .observation import begin_history, entry_of, prepare_entries, remember
from .reward import add_sample_to_terms, begin_terms, compute_reward, early_end_charge
from .running_figures import add_control_step_to_figures, add_sample_to_figures
from .state import FLAG, NOW, NOW_ROWS, RESULT, RESULT_ROWS, TASK_ROW


@inlined
def take_action(line, episode, task, now, scratch, lane):
    """Clip the actions of a group; the forces that they ask for, and the reward's terms of them."""
    for c in range(CONTACTS):
        scratch[0][c * SCRATCH_ROWS + SCRATCH.COMMAND + PLACE.FRAME] = 0.0
        scratch[0][c * SCRATCH_ROWS + SCRATCH.COMMAND + PLACE.HEAD] = 0.0
    now[NOW.EFFORT] = 0.0
    now[NOW.RATE] = 0.0
    asked = columns_across(line, episode.action, lane)
    for a in range(episode.places.size):
        action = smaller(larger(asked[a], -1.0), 1.0)
        change = 0.5 * (action - task[TASK_ROW.ACTION + a])
        now[NOW.EFFORT] += action * action
        now[NOW.RATE] += change * change
        task[TASK_ROW.ACTION + a] = action
        force = action * episode.force_limit
        if episode.places[a] == PLACE.FRAME:
            scratch[0][SCRATCH.COMMAND + PLACE.FRAME] = force
        else:
            scratch[0][SCRATCH.COMMAND + PLACE.HEAD] = force


@inlined
def end_episodes(line, wire, episode, own, task, values, flags, lane):
    """Whether episodes end here; those that end early pay for it."""
    ending = 0.0 * own[ROW.STEP] + ending_by_wire(line, wire, lane)
    ending = choose(task[TASK_ROW.LOSS_STEPS_IN_A_ROW] >= episode.loss_limit, ENDING.LOSS, ending)
    ending = choose(magnitude(own[ROW.STATE]) <= episode.head_range, ending, ENDING.HEAD)
    ending = choose(magnitude(own[ROW.STATE]) <= LARGEST_HEIGHT, ending, ENDING.DIVERGED)  # nor is NaN
    early, at_end = ending > 0.0, own[ROW.STEP] >= task[TASK_ROW.END]
    for k in range(RESULT.REWARD, RESULT.CONTACT_FORCE):  # reward and its terms
        values[k] = choose(ending == ENDING.DIVERGED, 0.0, values[k])
    values[RESULT.REWARD] -= choose(early, early_end_charge(episode, own, task), 0.0)
    task[TASK_ROW.ENDING] = ending
    put_across(flags, FLAG.TERMINATED, lane, early)
    put_across(flags, FLAG.TRUNCATED, lane, choose(early, 0.0, choose(at_end, 1.0, 0.0)) > 0.0)
    anywhere = any_of(early) or any_of(at_end)
    return anywhere and (width_of(line) == 1 or any_ended(episode, flags, lane, width_of(line)))


@inlined
def any_ended(episode, flags, lane, count):
    """Whether the episode of any of so many lanes from one on has ended, but of those that are idle."""
    ended = False
    for i in range(lane, lane + count):
        if not episode.idle[i]:
            ended = ended or flags[FLAG.TERMINATED, i] or flags[FLAG.TRUNCATED, i]
    return ended


@inlined
def tell(run, own, told, lane):
    """Write what is told of the last sample of a group."""
    told[RESULT.CONTACT_FORCE] = own[ROW.CONTACT_FORCE]
    told[RESULT.HEAD_HEIGHT] = own[ROW.HEAD_HEIGHT]
    told[RESULT.WIRE_HEIGHT] = own[ROW.WIRE_HEIGHT]
    told[RESULT.FRAME_FORCE] = own[ROW.FRAME_FORCE]
    told[RESULT.HEAD_FORCE] = own[ROW.HEAD_FORCE]
    told[RESULT.POSITION] = position_after(run, own, own[ROW.STEP], lane)


@inlined
def at_end(own, task):
    """Whether a lane that goes by itself has come to the end of its episode."""
    return number_at(own, ROW.STEP, 0) >= number_at(task, TASK_ROW.END, 0)


@inlined
def control_group(packed, scratch, now, entry, entries, values, flags, lane):
    """Control steps of the group of lanes that begins at ``lane``, none beyond the end of an episode.

    Returns whether an episode has ended. entry: room for one row.
    """
    line, wire, pantographs, actuators, run, sensors, samples, episode, running, _ = open_packed(packed)
    own, task = columns(line, run.table[0], lane), columns(line, episode.table, lane)
    told = columns_across(line, values, lane)
    take_action(line, episode, task, now, scratch, lane)
    ended = False
    for _ in range(episode.steps[lane]):
        if width_of(line) == 1 and at_end(own, task):
            break  # no step beyond it, whoever asks: there are neither line nor rows of samples
        begin_terms(task, now)
        now[NOW.STRIDE] = mean_stride(run, own, float(episode.control_steps), lane)
        for step in range(1, episode.control_steps + 1):
            force, frame, head = own[ROW.CONTACT_FORCE], own[ROW.FRAME_FORCE], own[ROW.HEAD_FORCE]
            step_group(line, wire, pantographs, actuators, run, scratch, lane)
            record_group(line, wire, run, samples, lane)
            add_sample_to_terms(own, task, now, force)
            add_sample_to_figures(running, samples, own, task, frame, head, lane)
            take_readings(sensors, step, own, rows_from(now, NOW.READING), lane)
        compute_reward(episode, own, task, now, told)
        add_control_step_to_figures(task, now, told)
        ended = end_episodes(line, wire, episode, own, task, told, flags, lane)
        if ended:
            break
    prepare_entries(episode, sensors, run, own, now, lane)
    for k in range(entries.shape[0]):
        seen = entry_of(episode, own, task, now, k, entry)
        put_across(entries, k, lane, choose(task[TASK_ROW.ENDING] == ENDING.DIVERGED, 0.0, seen))
    remember(episode, task, now)
    tell(run, own, told, lane)
    return ended


@inlined
def all_idle(episode, lane, count):
    """Whether all of so many lanes from one on are idle."""
    idle = True
    for i in range(count):
        idle = idle and episode.idle[lane + i]
    return idle


@inlined
def all_finite(line, action):
    """Whether all actions, (actions, lanes of whole groups), are finite."""
    total = 0.0 * columns_across(line, action, 0)[0]  # nan where one is not
    for lane in range(0, action.shape[1], width_of(line)):
        asked = columns_across(line, action, lane)
        for a in range(action.shape[0]):
            total += 0.0 * asked[a]
    return not any_of(choose(total == 0.0, 0.0, 1.0) > 0.0)


@kernel
def control_steps(packed, entries, values, flags, first, last, size, role, patience):
    """Control steps of the lanes from ``first`` to before ``last`` under ``episode.action``.

    Returns 0 where no episode has ended, 1 where one has, and -1, having done nothing, where an action is not
    finite. Results go to entries, values and flags, as of ``Results``. A lane that is idle stays as it is,
    unless another one of its group is not. size, role, patience: of shares, as of ``LaneThreads``.
    packed: line, wire, pantographs, actuators, run, sensors, samples, episode, running figures, shares.
    """
    line, _, _, _, _, _, _, episode, _, shares = open_packed(packed)
    scratch, now, entry = new_scratch(line), new_columns(line, NOW_ROWS), new_columns(line, 1)
    if role != HELPER and not all_finite(line, episode.action):
        return -1
    if role == LEADER:
        hand_out(shares, first, last, size, entries, values, flags)
    taken, ended = 0, False
    while True:
        begin, end = next_share(shares, role, taken, patience, first, last, size)
        if begin < 0:
            break
        taken += 1
        entries, values, flags = results_of(shares, role, entries, values, flags)
        for lane in range(begin, end, width_of(line)):
            if not all_idle(episode, lane, width_of(line)):
                here = control_group(packed, scratch, now, entry, entries, values, flags, lane)
                ended = ended or here
        share_done(shares, role, ended)
    return 1 if found_anywhere(shares, role, ended) else 0


@kernel
def observe_start(packed, entries, values, flags, first, last):
    """Results of the lanes from ``first`` to before ``last`` at their start, but of idle ones; as above."""
    line, _, _, _, run, sensors, _, episode, _, _ = open_packed(packed)
    now, told = new_columns(line, NOW_ROWS), new_columns(line, RESULT_ROWS)
    seen, entry = new_columns(line, 1), new_columns(line, 1)
    width = width_of(line)
    for lane in range(first - first % width, last, width):
        own, task = columns(line, run.table[0], lane), columns(line, episode.table, lane)
        take_first_readings(sensors, own, rows_from(now, NOW.READING), lane)
        prepare_entries(episode, sensors, run, own, now, lane)
        begin_history(episode, task, now, lane)
        for k in range(entries.shape[0]):
            seen[0] = entry_of(episode, own, task, now, k, entry)
            for i in range(width):
                if not episode.idle[lane + i]:
                    entries[k, lane + i] = number_at(seen, 0, i)
        for k in range(RESULT_ROWS):
            told[k] = 0.0
        tell(run, own, told, lane)
        for i in range(width):
            if not episode.idle[lane + i]:
                for k in range(RESULT_ROWS):
                    values[k, lane + i] = number_at(told, k, i)
                for k in range(flags.shape[0]):
                    flags[k, lane + i] = False
