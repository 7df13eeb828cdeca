"""Active pantograph control: a trusted pantograph-catenary simulator as a Gymnasium environment."""

from .analysis.simulation import simulate
from .base.errors import InputError
from .base.version import __version__
from .envs import register
from .metrics.trajectory import Trajectory

__all__ = ["InputError", "Trajectory", "__version__", "simulate"]

register()
