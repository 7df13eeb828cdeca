"""The control step of all lanes, from action to observation, in one kernel call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..backend.block import stack
from ..backend.compile import kernel, part
from ..backend.packed import open_held
from ..base.arrays import Array, Index
from ..plant.actuators.lagged import FRAME, HEAD
from ..plant.step import (
    BLOCK_ROWS,
    COMMAND,
    CONTACT_FORCE,
    FORCE,
    FRAME_HEIGHT,
    FRAME_VELOCITY,
    HEAD_HEIGHT,
    HEAD_VELOCITY,
    STATE,
    STEP,
    alike,
    load,
    record_block,
    step_block,
    store,
)
from .observation import observe
from .reward import judge, judge_sample
from .rows import (
    BEFORE,
    COST,
    END,
    FILTER,
    GONE,
    LOSSES,
    LOST,
    READING,
    READINGS,
    REWARD,
    SCORE_ROWS,
    TERM,
    TOTAL,
)
from .running_figures import count_sample

Flags = NDArray[np.bool_]
# Channels of a sample that the sensors read, in the order of the observation's entries.
SENSED = (HEAD_HEIGHT, FRAME_HEIGHT, HEAD_VELOCITY, FRAME_VELOCITY, CONTACT_FORCE)


class Episode(NamedTuple):
    """What the task knows of all lanes."""

    action: Array  # (lanes, actions): the present one, -1..1
    last_action: Array  # (lanes, actions): the one before
    channels: Index  # (actions,): where each action acts, FRAME or HEAD
    force_limit: float  # force of an action of 1 (N)
    lanes: Array  # (KEPT, lanes): the rows of ``scores``
    weights: Array  # (terms,): of the reward
    idle: Flags  # (lanes,): lanes that the next step leaves as they are
    terminated: Flags  # (lanes,): whether the plant has left its valid range
    truncated: Flags  # (lanes,): whether the end of the run is reached
    past: Array  # (control steps, READINGS, lanes): readings that have not arrived, next to arrive first
    observation: NDArray[np.float32]  # (lanes, entries)
    noisy: bool  # whether the sensors are
    noise: Array  # (READINGS, lanes): of the sensors at the next observation, in their units
    per_unit: Array  # (entries,): of the observation, for one unit of what it tells
    read_at: int  # plant step of a control step whose sample is read, counted from 1
    span: float  # m
    time_step: float  # s
    full: bool  # whether the observation is the full one
    control_steps: int  # plant steps in a control step
    lost_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m), either way, that ends an episode


@part
def command(episode, block, begin, count):
    """Clip the actions of a block; the forces that they ask for."""
    for c in range(2):
        for i in range(count):
            block[COMMAND + c, i] = 0.0
    for a in range(episode.channels.size):
        place = COMMAND + HEAD if episode.channels[a] == HEAD else COMMAND + FRAME
        action = episode.action[begin : begin + count, a]
        for i in range(count):
            action[i] = min(max(action[i], -1.0), 1.0)
            block[place, i] = action[i] * episode.force_limit


@part
def read_sensors(episode, block, scores, begin, count):
    """Take a reading from the present sample; it arrives at once or after some control steps."""
    depth = episode.past.shape[0]
    for k in range(READINGS):
        for i in range(count):
            scores[READING + k, i] = block[SENSED[k], i]
        if depth > 0:
            past = episode.past[:, k, begin : begin + count]
            for i in range(count):
                taken = scores[READING + k, i]
                scores[READING + k, i] = past[0, i]
                for j in range(depth - 1):
                    past[j, i] = past[j + 1, i]
                past[depth - 1, i] = taken


@part
def finish(episode, block, scores, begin, count):
    """Whether episodes end here."""
    terminated = episode.terminated[begin : begin + count]
    truncated = episode.truncated[begin : begin + count]
    for i in range(count):
        high = abs(block[STATE, i]) > episode.head_range
        terminated[i] = high or scores[LOST, i] >= episode.lost_limit
        truncated[i] = block[STEP, i] >= scores[END, i]
        if terminated[i]:
            # A run that ends early pays as if it went on without contact: it must not be a way out.
            left = (scores[END, i] - block[STEP, i]) / episode.control_steps
            scores[REWARD, i] -= left * (episode.weights[0] + episode.weights[1])


@part
def awake(idle, begin, limit):
    """How many lanes from ``begin`` on, which is one, do not idle, up to a limit."""
    count = 1
    while count < limit and not idle[begin + count]:
        count += 1
    return count


@kernel
def control_step(held, first, last):
    """One control step of the lanes from ``first`` to before ``last`` under ``episode.action``.

    held: line, wire, body, drive, run, samples, episode and tally.
    """
    line, wire, body, drive, run, samples, episode, tally = open_held(held)
    block, scores = stack(line, BLOCK_ROWS), stack(line, SCORE_ROWS)
    begin = first
    while begin < last:
        if episode.idle[begin]:
            for a in range(episode.channels.size):
                episode.action[begin, a] = 0.0
            begin += 1
            continue
        count = awake(episode.idle, begin, alike(body, block, begin, last))
        load(run.lanes, block, STEP, begin, count)
        load(episode.lanes, scores, 0, begin, count)
        load(tally.lanes, scores[FILTER:], 0, begin, count)
        for i in range(count):
            scores[BEFORE, i] = block[FORCE, i]
            scores[COST, i] = 0.0
            scores[GONE, i] = 0.0
        command(episode, block, begin, count)
        for s in range(1, episode.control_steps + 1):
            step_block(line, wire, body, drive, run, block, begin, count)
            record_block(line, wire, samples, block, begin, count)
            judge_sample(block, scores, count)
            count_sample(tally, samples, block, scores, begin, count)
            if s == episode.read_at:
                read_sensors(episode, block, scores, begin, count)
        judge(episode, block, scores, begin, count)
        finish(episode, block, scores, begin, count)
        for i in range(count):
            scores[TOTAL, i] += scores[TERM, i]
            scores[LOSSES, i] += scores[GONE, i]
        store(scores[FILTER:], tally.lanes, begin, count)
        observe(episode, body.transition.shape[1], block, scores, begin, count)
        store(block, run.lanes, begin, count)
        store(scores, episode.lanes, begin, count)
        begin += count


@kernel
def first_look(held, first, last):
    """Observations of the lanes from ``first`` to before ``last`` as they stand; held: as above."""
    line, _, body, _, run, _, episode, _ = open_held(held)
    block, scores = stack(line, BLOCK_ROWS), stack(line, SCORE_ROWS)
    begin = first
    while begin < last:
        count = alike(body, block, begin, last)
        load(run.lanes, block, 0, begin, count)
        for k in range(READINGS):
            for i in range(count):
                scores[READING + k, i] = block[SENSED[k], i]
        observe(episode, body.transition.shape[1], block, scores, begin, count)
        begin += count
