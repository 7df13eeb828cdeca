"""Observation, reward, termination: what turns the plant into a control task."""

from .context import Context
from .mean_force import trim_of_pass
from .task import Task, passive_mean

__all__ = ["Context", "Task", "passive_mean", "trim_of_pass"]
