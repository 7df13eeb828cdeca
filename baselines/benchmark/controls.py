"""Controls of a benchmark: what a policy is worth without its senses, and a record of its actions without it.

"blind of pd" is the policy that is shown its first observation for ever; "tape of pd" plays the actions that
it made on another line, drawn under another seed. Where a control scores as well as the policy itself, the
benchmark has not asked for feedback.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context
from panto_env.policies import Policy, wishes

Array = NDArray[np.float64]

BLIND, TAPE = "blind of ", "tape of "
OTHER_SEED = 1_000_003
"""Added to a pass's seed: the tape's line is another one."""


def control_of(name: Any) -> str:
    """Which control a policy's name asks for, BLIND or TAPE; "" for a policy itself."""
    return next((kind for kind in (BLIND, TAPE) if isinstance(name, str) and name.startswith(kind)), "")


def policy_of(name: Any) -> Any:
    """Name of the policy that a control is of; any other policy as it is."""
    return name[len(control_of(name)) :] if control_of(name) else name


class Blind:
    """A policy that sees nothing but how its episode begins."""

    def __init__(self, policy: Policy) -> None:
        """policy: that is shown it."""
        self._policy = policy
        vars(self).update(wishes(policy))

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._first: NDArray[np.float32] | None = None
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (actions,), as for the first observation of the episode."""
        if self._first is None:
            self._first = observation.copy()
        return self._policy.act(self._first.copy())


class Tape:
    """Plays actions, (control steps, actions); nothing once they have ended."""

    def __init__(self, actions: Array) -> None:
        """actions: in the order of the control steps, each in -1..1."""
        self._actions = actions

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._step = 0

    def act(self, observation: NDArray[np.float32]) -> Array:
        """The next action, (actions,)."""
        step, self._step = self._step, self._step + 1
        return self._actions[step] if step < len(self._actions) else np.zeros_like(self._actions[0])
