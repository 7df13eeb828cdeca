"""What the task knows of all lanes, as arrays for kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.arrays import Array, Index

Flags = NDArray[np.bool_]


class Episode(NamedTuple):
    """One episode per lane, in all of them."""

    action: Array  # (lanes, actions): the present one, -1..1
    last_action: Array  # (lanes, actions): the one before
    places: Index  # (actions,): where each entry of an action acts, a ``Place``
    force_limit: float  # force of an action of 1 (N)
    table: Array  # (EPISODE_ROWS, lanes): rows of ``TaskRow``
    weights: Array  # (terms,): of the reward
    idle: Flags  # (lanes,): lanes that the next step leaves as they are
    terminated: Flags  # (lanes,): whether the plant has left its valid range
    ending: Index  # (lanes,): by what, an ``Ending``
    truncated: Flags  # (lanes,): whether the end of the run is reached
    observation: NDArray[np.float32]  # (lanes, entries)
    writers: Index  # (entries, 2): writer and number of each entry of the observation
    centre: Array  # (entries,): of the observation, what reads 0, in the unit of what it is of
    per_unit: Array  # (entries,): of the observation, for one unit of what it is of
    spans_per_metre: float  # 1/m
    time_step: float  # s
    control_steps: int  # plant steps in a control step
    mean_share: float  # of the running mean of the force that a control step replaces
    loss_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m), either way, that ends an episode
