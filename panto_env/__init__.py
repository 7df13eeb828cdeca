"""Active pantograph control: a trusted pantograph-catenary simulator as a Gymnasium environment."""

from .envs import register
from .errors import InputError
from .simulation import simulate
from .trajectory import Trajectory

__all__ = ["InputError", "Trajectory", "simulate"]
__version__ = "0.1.0"

register()
