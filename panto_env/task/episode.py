"""The control step of a lane, from action to observation, in one kernel call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, Index
from ..plant.actuator import FRAME, HEAD
from ..plant.coupling import advance_lane
from ..plant.jit import kernel, part
from .observation import observe
from .reward import judge
from .tally import count

Flags = NDArray[np.bool_]


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
    lost: Index  # (lanes,): plant steps since contact was lost
    terms: Array  # (lanes, terms): of the last control step
    reward: Array  # (lanes,)
    idle: Flags  # (lanes,): lanes that the next step leaves as they are
    terminated: Flags  # (lanes,): whether the plant has left its valid range
    truncated: Flags  # (lanes,): whether the end of the run is reached
    observation: NDArray[np.float32]  # (lanes, entries)
    noise: Array  # (lanes, readings): of the sensors at the next observation, in their units
    scale: Array  # (entries,): of the observation
    delay: int  # of the sensors, in plant steps
    span: float  # m
    time_step: float  # s
    full: bool  # whether the observation is the full one
    control_steps: int  # plant steps in a control step
    lost_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m), either way, that ends an episode


@part
def end_early(episode, run, lane):
    """A run that ends early pays as if it went on without contact: it must not be a way out."""
    left = (episode.end[lane] - run.step[lane]) / episode.control_steps
    episode.reward[lane] -= left * (episode.weights[0] + episode.weights[1])


@kernel
def control_step(line, wire, body, drive, run, samples, episode, tally, first, last):
    """One control step of the lanes from ``first`` to before ``last`` under ``episode.action``."""
    for lane in range(first, last):
        if episode.idle[lane]:
            for a in range(episode.channels.size):
                episode.action[lane, a] = 0.0
            continue
        frame, head = 0.0, 0.0
        for a in range(episode.channels.size):
            share = min(max(episode.action[lane, a], -1.0), 1.0)
            episode.action[lane, a] = share
            if episode.channels[a] == FRAME:
                frame = share * episode.force_limit
            elif episode.channels[a] == HEAD:
                head = share * episode.force_limit
        advance_lane(line, wire, body, drive, run, lane, frame, head, episode.control_steps, samples)
        judge(episode, run, samples.channels, lane)
        count(tally, episode, run, samples, lane)
        high = abs(body.state[lane, 0]) > episode.head_range
        episode.terminated[lane] = high or episode.lost[lane] >= episode.lost_limit
        episode.truncated[lane] = run.step[lane] >= episode.end[lane]
        if episode.terminated[lane]:
            end_early(episode, run, lane)
        observe(episode, run, body, samples.channels, lane)
        for a in range(episode.channels.size):
            episode.last_action[lane, a] = episode.action[lane, a]


@kernel
def first_look(body, run, samples, episode, first, last):
    """Observations of the lanes from ``first`` to before ``last`` as they stand."""
    for lane in range(first, last):
        observe(episode, run, body, samples.channels, lane)
