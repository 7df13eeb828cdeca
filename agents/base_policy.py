"""The policy that an agent starts from, or adds to, in the lanes of a vector environment."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError
from panto_env.base.shown import shown
from panto_env.control.settings import RunSettings
from panto_env.envs import PantographVectorEnv
from panto_env.policies import errors_name, find_policy, wishes

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


def check_wishes(name: str, settings: RunSettings) -> None:
    """Raise InputError unless the policy exists and the environment has the observation that it requests."""
    for key, requested in wishes(find_policy(name)).items():
        offered = getattr(settings, key)
        if requested != offered:
            raise InputError(
                f"the policy '{name}' needs {key} = {shown(requested)}, but the environment has "
                f"{shown(offered)}; set it to what the policy needs"
            )
