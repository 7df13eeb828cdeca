"""Gymnasium environments."""

import gymnasium

from .single import PantographEnv
from .vector import PantographVectorEnv

__all__ = ["IDS", "PantographEnv", "PantographVectorEnv", "register"]

IDS = {
    "Pantograph-v0": {},
    "PantographStiffness-v0": {"catenary": "periodic-stiffness", "pantograph": "three-mass"},
    "PantographThreeSpan-v0": {"catenary": "ohl-three-span", "pantograph": "dsa350"},
}
"""Registered ids and the arguments that set them apart."""


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
