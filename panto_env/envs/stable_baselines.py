"""A clear error for a vector environment that is passed directly to Stable-Baselines3."""

from __future__ import annotations

import sys

from ..base.errors import InputError


class NamedToStableBaselines(type):
    """Class of the vector environment.

    Stable-Baselines3 has its own kind of vector environment and refuses all others with a message about
    OpenAI Gym. Before that it only prints the environment's class.
    """

    def __repr__(cls) -> str:
        if sys._getframe(1).f_globals.get("__name__", "").startswith("stable_baselines3."):
            raise InputError(
                "Stable-Baselines3 takes a vector environment of Gymnasium inside a VecEnv: "
                "from panto_agents.lanes import PantographVecEnv, and give it "
                "PantographVecEnv(gymnasium.make_vec(...))."
            )
        return super().__repr__()
