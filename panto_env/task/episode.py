"""The control step of all lanes, from action to observation, in one kernel call."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from ..arrays import Array, Index
from ..plant.actuator import FRAME, HEAD
from ..plant.coupling import (
    CHANNELS,
    WIDTH,
    alike,
    fetch,
    load_block,
    new_block,
    record_block,
    step_block,
    store,
    store_block,
)
from ..plant.held import open_held
from ..plant.jit import PART, kernel, part
from ..plant.stack import stack
from .observation import MAX_ENTRIES, READINGS, SENSED, observe
from .reward import judge, judge_sample
from .tally import COST, SUMS, count_sample, load_tally, store_tally

Flags = NDArray[np.bool_]
TERM_COUNT = 4


class Episode(NamedTuple):
    """What the task knows of all lanes."""

    action: Array  # (lanes, actions): the present one, -1..1
    last_action: Array  # (lanes, actions): the one before
    channels: Index  # (actions,): where each action acts, FRAME or HEAD
    force_limit: float  # force of an action of 1 (N)
    nominal: Array  # (lanes,): nominal contact force F_N (N)
    end: Index  # (lanes,): plant steps that the episode has
    distance: Array  # (lanes,): that the episode covers (m)
    weights: Array  # (terms,): of the reward
    lost: Array  # (lanes,): plant steps since contact was lost
    terms: Array  # (terms, lanes): of the last control step
    reward: Array  # (lanes,)
    idle: Flags  # (lanes,): lanes that the next step leaves as they are
    terminated: Flags  # (lanes,): whether the plant has left its valid range
    truncated: Flags  # (lanes,): whether the end of the run is reached
    latest: Array  # (CHANNELS, lanes): the last sample, or the first one at a start
    past: Array  # (control steps, READINGS, lanes): readings that have not arrived, next to arrive first
    observation: NDArray[np.float32]  # (lanes, entries)
    noise: Array  # (READINGS, lanes): of the sensors at the next observation, in their units
    scale: Array  # (entries,): of the observation
    read_at: int  # plant step of a control step whose sample is read, counted from 1
    span: float  # m
    time_step: float  # s
    full: bool  # whether the observation is the full one
    control_steps: int  # plant steps in a control step
    lost_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m), either way, that ends an episode


class Scores(NamedTuple):
    """What the task keeps of a block of lanes, on the stack; the last axis is the lane."""

    reading: Array  # (READINGS, width): what the sensors read
    entries: Array  # (MAX_ENTRIES, width): the observation
    terms: Array  # (TERM_COUNT, width)
    filter: Array  # (8, width): state of EN 50317's filter
    sums: Array  # (SUMS, width): as in Tally, and so are the next
    forces: Array  # (2, width)
    filtered: Array  # (width,): filtered contact force (N)
    nominal: Array  # (width,): as in Episode, and so are the next three
    distance: Array  # (width,)
    lost: Array  # (width,)
    reward: Array  # (width,)
    before: Array  # (width,): contact force of the last sample but one (N)
    cost: Array  # (width,): sum of deviations at both ends of each interval (N)
    gone: Array  # (width,): plant steps without contact
    effort: Array  # (width,)
    rate: Array  # (width,)


def new_scores(line: Any) -> Any:
    """Scores for as many lanes as go abreast on this type of line."""
    raise NotImplementedError("only kernels make scores")


@overload(new_scores, jit_options=PART)
def _new_scores(line):
    width = WIDTH.get(line.instance_class, 1)

    def build(line):
        rows = stack(10, width)
        return Scores(
            reading=stack(READINGS, width),
            entries=stack(MAX_ENTRIES, width),
            terms=stack(TERM_COUNT, width),
            filter=stack(8, width),
            sums=stack(SUMS, width),
            forces=stack(2, width),
            filtered=rows[0],
            nominal=rows[1],
            distance=rows[2],
            lost=rows[3],
            reward=rows[4],
            before=rows[5],
            cost=rows[6],
            gone=rows[7],
            effort=rows[8],
            rate=rows[9],
        )

    return build


@part
def command(episode, block, begin, count):
    """Clip the actions of a block; the forces that they ask for into ``block.command``."""
    for c in range(2):
        for i in range(count):
            block.command[c, i] = 0.0
    for a in range(episode.channels.size):
        place = HEAD if episode.channels[a] == HEAD else FRAME
        action = episode.action[begin : begin + count, a]
        for i in range(count):
            share = min(max(action[i], -1.0), 1.0)
            action[i] = share
            block.command[place, i] = share * episode.force_limit


@part
def load_scores(episode, scores, block, begin, count):
    """Fetch what the task needs of a block at the start of a control step."""
    fetch(episode.nominal, scores.nominal, begin, count)
    fetch(episode.distance, scores.distance, begin, count)
    fetch(episode.lost, scores.lost, begin, count)
    for i in range(count):
        scores.before[i] = block.force[i]
        scores.cost[i] = 0.0
        scores.gone[i] = 0.0


@part
def read_sensors(episode, scores, block, begin, count):
    """Take a reading from the present sample; it arrives at once or after some control steps."""
    depth = episode.past.shape[0]
    for k in range(READINGS):
        for i in range(count):
            scores.reading[k, i] = block.sample[SENSED[k], i]
        if depth > 0:
            past = episode.past[:, k, begin : begin + count]
            for i in range(count):
                taken = scores.reading[k, i]
                scores.reading[k, i] = past[0, i]
                for j in range(depth - 1):
                    past[j, i] = past[j + 1, i]
                past[depth - 1, i] = taken


@part
def finish(episode, scores, block, begin, count):
    """Whether episodes end here; put back what the task keeps."""
    end = episode.end[begin : begin + count]
    terminated = episode.terminated[begin : begin + count]
    truncated = episode.truncated[begin : begin + count]
    for i in range(count):
        high = abs(block.state[0, i]) > episode.head_range
        terminated[i] = high or scores.lost[i] >= episode.lost_limit
        truncated[i] = block.step[i] >= end[i]
        if terminated[i]:
            # A run that ends early pays as if it went on without contact: it must not be a way out.
            left = (end[i] - block.step[i]) / episode.control_steps
            scores.reward[i] -= left * (episode.weights[0] + episode.weights[1])
    store(scores.lost, episode.lost, begin, count)
    store(scores.reward, episode.reward, begin, count)
    for k in range(TERM_COUNT):
        store(scores.terms[k], episode.terms[k], begin, count)
    for c in range(CHANNELS):
        store(block.sample[c], episode.latest[c], begin, count)
    for a in range(episode.channels.size):
        last_action = episode.last_action[begin : begin + count, a]
        for i in range(count):
            last_action[i] = episode.action[begin : begin + count, a][i]


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
    block, scores = new_block(line), new_scores(line)
    keep = tally.sums.shape[1] > 0
    begin = first
    while begin < last:
        if episode.idle[begin]:
            for a in range(episode.channels.size):
                episode.action[begin, a] = 0.0
            begin += 1
            continue
        count = awake(episode.idle, begin, alike(body, block, begin, last))
        load_block(body, drive, run, block, begin, count)
        load_scores(episode, scores, block, begin, count)
        if keep:
            load_tally(tally, scores, begin, count)
        command(episode, block, begin, count)
        for s in range(1, episode.control_steps + 1):
            step_block(line, wire, body, drive, run, block, begin, count)
            record_block(line, wire, samples, block, begin, count)
            judge_sample(scores, block, count)
            if keep:
                count_sample(tally, scores, samples, block, begin, count)
            if s == episode.read_at:
                read_sensors(episode, scores, block, begin, count)
        judge(episode, scores, block, begin, count)
        if keep:
            for i in range(count):
                scores.sums[COST, i] += scores.terms[0, i]
            store_tally(tally, scores, begin, count)
        observe(episode, scores, block, body.state.shape[0], begin, count)
        finish(episode, scores, block, begin, count)
        store_block(body, drive, run, block, begin, count)
        begin += count


@kernel
def first_look(held, first, last):
    """Observations of the lanes from ``first`` to before ``last`` as they stand; held: as above."""
    line, _, body, drive, run, _, episode, _ = open_held(held)
    block, scores = new_block(line), new_scores(line)
    one = alike(body, block, first, first + 1)  # not the literal 1, for which all would be compiled anew
    for lane in range(first, last):
        load_block(body, drive, run, block, lane, one)
        for c in range(CHANNELS):
            block.sample[c, 0] = episode.latest[c, lane]
        for k in range(READINGS):
            scores.reading[k, 0] = block.sample[SENSED[k], 0]
        observe(episode, scores, block, body.state.shape[0], lane, one)
