"""Active pantograph control: a trusted pantograph-catenary simulator as a Gymnasium environment."""

from typing import Any

from .analysis.simulation import simulate
from .base.checksums import __version__
from .base.errors import InputError
from .base.extras import require
from .catalog import line, pantograph
from .envs import register
from .metrics.trajectory import Trajectory

__all__ = ["InputError", "Trajectory", "__version__", "line", "pantograph", "parallel_env", "simulate"]

register()


def parallel_env(**settings: Any) -> Any:
    """A train as a PettingZoo environment; see ``envs.parallel.PantographParallelEnv``.

    Raises InputError for a value that is not valid, and without PettingZoo.
    """
    require("A parallel environment", "pettingzoo", "pettingzoo")
    from .envs.parallel import PantographParallelEnv

    return PantographParallelEnv(**settings)
