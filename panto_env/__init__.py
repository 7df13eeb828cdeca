"""Active pantograph control: a trusted pantograph-catenary simulator as a Gymnasium environment."""

from .analysis.simulation import simulate
from .base.errors import InputError
from .envs import register
from .metrics.trajectory import Trajectory

__all__ = ["InputError", "Trajectory", "simulate"]
__version__ = "0.1.0"

register()
