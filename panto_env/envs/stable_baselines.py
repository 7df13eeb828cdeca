"""Who gives a vector environment to Stable-Baselines3 itself is told what to give it instead."""

from __future__ import annotations

import sys

from ..base.errors import InputError


class NamedToStableBaselines(type):
    """Class of the vector environment.

    Stable-Baselines3 has vector environments of its own kind and refuses all others in words that name
    OpenAI Gym. It asks nothing of an environment before that, but it prints its class.
    """

    def __repr__(cls) -> str:
        if sys._getframe(1).f_globals.get("__name__", "").startswith("stable_baselines3."):
            raise InputError(
                "Stable-Baselines3 takes a vector environment of Gymnasium inside a VecEnv: "
                "from panto_agents.vec_env import PantographVecEnv, and give it "
                "PantographVecEnv(gymnasium.make_vec(...))."
            )
        return super().__repr__()
