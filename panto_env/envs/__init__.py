"""Gymnasium environments."""

import gymnasium

from .driven import DrivenByPolicies
from .ids import BARE, IDS
from .single import PantographEnv
from .vector import PantographVectorEnv

__all__ = ["BARE", "IDS", "DrivenByPolicies", "PantographEnv", "PantographVectorEnv", "register"]


def register() -> None:
    """Make the ids known to ``gymnasium.make``, once."""
    for name, settings in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="panto_env.envs:PantographEnv",
                vector_entry_point="panto_env.envs:PantographVectorEnv",
                kwargs=settings,
            )
