"""The policy that an agent starts from, or adds to, in the lanes of a vector environment."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.envs import PantographVectorEnv
from panto_env.policies import errors_name, find_policy

Array = NDArray[np.float64]


class PolicyLanes:
    """One policy per lane, all of the same name: each has its own episode and memory."""

    def __init__(self, name: str, native: PantographVectorEnv) -> None:
        """name: see ``find_policy``. native: the environment of the lanes."""
        self.name, self._native = name, native
        self._policies = [find_policy(name) for _ in range(native.num_envs)]

    def begin(self, lanes: Any) -> None:
        """Begin the episodes that the lanes, (n,), have just begun."""
        with errors_name(self.name, "reset"):
            for lane in lanes.tolist():
                self._policies[lane].reset(self._native.context(lane))

    def act(self, observations: NDArray[np.float32]) -> Array:
        """Actions, (lanes, actions), each in -1..1, for observations, (lanes, entries)."""
        with errors_name(self.name, "act"):
            # Copies: a policy may keep its observation.
            pairs = zip(self._policies, observations.copy(), strict=True)
            actions: Array = np.array([policy.act(seen) for policy, seen in pairs], dtype=np.float64)
        return np.clip(actions, -1.0, 1.0)
