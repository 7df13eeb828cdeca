"""No control: the pantograph alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_env.control.context import Context


class Passive:
    """Actuators that stay at zero; every other policy is compared with this one."""

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._action = np.zeros(context.actions)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), all zero."""
        return self._action.copy()
