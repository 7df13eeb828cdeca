"""The control step of all lanes, from action to observation, in one kernel call."""

from __future__ import annotations

from ..backend import inlined, kernel, new_block, new_blocks, open_packed
from ..plant.catenary.protocol import ending_by_wire
from ..plant.sensors import take_first_readings, take_readings
from ..plant.state import BLOCK_ROWS, CONTACTS, PLACE, ROW
from ..plant.step import lanes_of_one_variant, load, record_blocks, step_blocks, store
from ..plant.valid_range import ENDING
from .observation import observe
from .reward import add_sample_to_terms, begin_terms, charge_early_end, compute_reward
from .running_figures import add_control_step_to_figures, add_sample_to_figures
from .state import TASK_BLOCK_ROWS, TASK_ROW


@inlined
def command(episode, blocks, begin, count):
    """Clip the actions of a block; the forces that they ask for, on the first contact's pantograph."""
    for c in range(blocks.shape[0]):
        for place in range(2):
            for i in range(count):
                blocks[c, ROW.COMMAND + place, i] = 0.0
    for a in range(episode.places.size):
        row = ROW.COMMAND + PLACE.HEAD if episode.places[a] == PLACE.HEAD else ROW.COMMAND + PLACE.FRAME
        action = episode.action[begin : begin + count, a]
        for i in range(count):
            action[i] = min(max(action[i], -1.0), 1.0)
            blocks[0, row, i] = action[i] * episode.force_limit


@inlined
def end_episodes(line, wire, episode, block, task, begin, count):
    """Whether episodes end here, and whether any of them does."""
    ended = False
    terminated = episode.terminated[begin : begin + count]
    truncated = episode.truncated[begin : begin + count]
    endings = episode.ending[begin : begin + count]
    for i in range(count):
        ending = ending_by_wire(line, wire, begin + i)
        if task[TASK_ROW.LOSS_STEPS_IN_A_ROW, i] >= episode.loss_limit:
            ending = ENDING.LOSS
        if not abs(block[ROW.STATE, i]) <= episode.head_range:  # nor is NaN
            ending = ENDING.HEAD
        endings[i] = ending
        terminated[i] = ending != ENDING.NONE
        truncated[i] = block[ROW.STEP, i] >= task[TASK_ROW.END, i]
        if terminated[i]:
            charge_early_end(episode, block, task, i)
        ended = ended or terminated[i] or truncated[i]
    return ended


@inlined
def lanes_not_idle(idle, begin, limit):
    """How many lanes from ``begin`` on, which is one, are not idle, up to a limit."""
    count = 1
    while count < limit and not idle[begin + count]:
        count += 1
    return count


@kernel
def control_steps(packed, steps, first, last):
    """Control steps of the lanes from ``first`` to before ``last`` under ``episode.action``.

    Of lanes that go abreast none makes a further one once an episode of them has ended.
    packed: line, wire, pantographs, actuators, run, sensors, samples, episode and running figures.
    """
    line, wire, pantographs, actuators, run, sensors, samples, episode, running = open_packed(packed)
    blocks, task = new_blocks(line, CONTACTS, BLOCK_ROWS), new_block(line, TASK_BLOCK_ROWS)
    block = blocks[0]
    begin = first
    while begin < last:
        if episode.idle[begin]:
            for a in range(episode.places.size):
                episode.action[begin, a] = 0.0
            begin += 1
            continue
        count = lanes_of_one_variant(pantographs, begin, min(blocks.shape[2], last - begin))
        count = lanes_not_idle(episode.idle, begin, count)
        for c in range(blocks.shape[0]):
            load(run.table[c], blocks[c], ROW.STEP, begin, count)
        load(episode.table, task, 0, begin, count)
        load(running.table, task[TASK_ROW.FILTER_STATE :], 0, begin, count)
        command(episode, blocks, begin, count)
        for _ in range(steps):
            begin_terms(block, task, count)
            for step in range(1, episode.control_steps + 1):
                step_blocks(line, wire, pantographs, actuators, run, blocks, begin, count)
                record_blocks(line, wire, samples, blocks, begin, count)
                add_sample_to_terms(block, task, count)
                add_sample_to_figures(running, samples, block, task, begin, count)
                take_readings(sensors, step, block, task[TASK_ROW.READING :], begin, count)
            compute_reward(episode, block, task, begin, count)
            add_control_step_to_figures(task, count)
            if end_episodes(line, wire, episode, block, task, begin, count):
                break
        store(task[TASK_ROW.FILTER_STATE :], running.table, begin, count)
        observe(episode, sensors, block, task, begin, count)
        for c in range(blocks.shape[0]):
            store(blocks[c], run.table[c], begin, count)
        store(task, episode.table, begin, count)
        begin += count


@kernel
def observe_start(packed, first, last):
    """Observations of the lanes from ``first`` to before ``last`` at their start; packed: as above."""
    line, _, pantographs, _, run, sensors, _, episode, _ = open_packed(packed)
    block, task = new_block(line, BLOCK_ROWS), new_block(line, TASK_BLOCK_ROWS)
    begin = first
    while begin < last:
        count = lanes_of_one_variant(pantographs, begin, min(block.shape[1], last - begin))
        load(run.table[0], block, 0, begin, count)
        take_first_readings(sensors, block, task[TASK_ROW.READING :], begin, count)
        observe(episode, sensors, block, task, begin, count)
        begin += count
