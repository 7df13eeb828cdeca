"""Gymnasium environments."""

from typing import Any

import gymnasium

from ..base.extras import require
from .driven import DrivenByPolicies
from .settings import BARE, IDS
from .single import PantographEnv
from .vector import PantographVectorEnv

__all__ = [
    "BARE",
    "IDS",
    "DrivenByPolicies",
    "PantographEnv",
    "PantographVectorEnv",
    "register",
    "vector_env",
]


def vector_env(**settings: Any) -> Any:
    """The vector environment: `PantographVectorEnv`, or with a ``device`` `PantographTensorEnv`.

    Raises InputError for a value that is not valid, and with a device where PyTorch is missing.
    """
    if settings.get("device") is None:
        settings.pop("device", None)
        return PantographVectorEnv(**settings)
    require("A vector environment on a device", "cuda", "torch")
    from .tensors import PantographTensorEnv

    return PantographTensorEnv(**settings)


def register() -> None:
    """Make the ids known to ``gymnasium.make``, once."""
    for name, settings in IDS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="panto_env.envs:PantographEnv",
                vector_entry_point="panto_env.envs:vector_env",
                kwargs=settings,
            )
