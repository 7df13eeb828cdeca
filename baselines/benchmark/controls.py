"""Controls of a benchmark: a policy without its observations, and a record of its actions without the policy.

"blind of pd" is the policy given its first observation at every step; "tape of pd" plays back the actions
that it took on another line, drawn under another seed, and "tape of oracle" those of the stored oracle. If a
control scores as well as the policy itself, the benchmark does not need feedback.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context
from panto_env.policies import Policy, wishes

Array = NDArray[np.float64]

BLIND, TAPE = "blind of ", "tape of "
ORACLE_TAPE = TAPE + "oracle"
OTHER_SEED = 1_000_003
"""Added to the seed of a pass, so that a tape is recorded on a different line."""


def control_of(name: Any) -> str:
    """Kind of control that a policy's name stands for, BLIND or TAPE; "" for a policy itself."""
    return next((kind for kind in (BLIND, TAPE) if isinstance(name, str) and name.startswith(kind)), "")


def policy_of(name: Any) -> Any:
    """Name of the policy behind a control; the name itself if it is not a control's."""
    return name[len(control_of(name)) :] if control_of(name) else name


class Blind:
    """A policy that only ever sees the first observation of its episode."""

    def __init__(self, policy: Policy) -> None:
        """policy: the policy that gets the first observation at every step."""
        self._policy = policy
        vars(self).update(wishes(policy))

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._first: NDArray[np.float32] | None = None
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action of the policy, (actions,), for the first observation of the episode."""
        if self._first is None:
            self._first = observation.copy()
        return self._policy.act(self._first.copy())


class Tape:
    """Plays back recorded actions, (control steps, actions); zeros after the last one."""

    def __init__(self, actions: Array, washout: float = 0.0) -> None:
        """actions: in the order of the control steps, each in -1..1. washout: see ``Policy``."""
        self._actions, self.washout = actions, washout

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._step = 0

    def act(self, observation: NDArray[np.float32]) -> Array:
        """The next action, (actions,)."""
        step, self._step = self._step, self._step + 1
        return self._actions[step] if step < len(self._actions) else np.zeros_like(self._actions[0])
