"""What a network sees of an observation: wrappers of its training, as steps that a model file holds."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from panto_env.base.settings import Positive, Settings
from panto_env.control.context import Context
from panto_env.policies import Policy


class Scaled(Settings):
    """Values minus their centres, over their scales."""

    centre: tuple[float, ...]
    scale: tuple[Positive, ...]
    bound: Positive | None = None  # maximum magnitude of the result, to which it is clipped


class Stacked(Settings):
    """The observations of this and earlier control steps, oldest first."""

    frames: Annotated[int, Field(ge=1)]
    padding: tuple[float, ...] | None = None  # before the first observation; None: that one, repeated


Step = Scaled | Stacked


def width_after(steps: Sequence[Step], entries: int) -> int:
    """Number of the network's inputs for an observation of so many entries.

    Raises ValueError where the steps do not fit each other.
    """
    width = entries
    for step in steps:
        own = (step.centre, step.scale) if isinstance(step, Scaled) else (step.padding,)
        if any(each is not None and len(each) != width for each in own):
            raise ValueError("the steps from its observation to its network do not fit each other")
        width *= step.frames if isinstance(step, Stacked) else 1
    return width


class Prepared:
    """A network as a policy; each observation goes through the steps before."""

    def __init__(self, steps: Sequence[Step], network: Policy) -> None:
        self._steps, self._network = steps, network
        self._frames: dict[int, deque[NDArray[np.float32]]] = {}  # by the place of their step

    def reset(self, context: Context) -> None:
        """Forget the episode before."""
        self._frames.clear()
        self._network.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        values = observation
        for place, step in enumerate(self._steps):
            if isinstance(step, Stacked):
                values = self._stacked(place, step, values)
            else:
                bound = np.inf if step.bound is None else step.bound
                scaled = (values - np.array(step.centre)) / np.array(step.scale)
                values = np.clip(scaled, -bound, bound).astype(np.float32)
        return self._network.act(values)

    def _stacked(self, place: int, step: Stacked, values: NDArray[np.float32]) -> NDArray[np.float32]:
        if place not in self._frames:
            before = values if step.padding is None else np.array(step.padding, dtype=np.float32)
            self._frames[place] = deque([before] * step.frames, maxlen=step.frames)
        self._frames[place].append(values.copy())
        return np.concatenate(self._frames[place])
