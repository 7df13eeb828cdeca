"""Observation, reward, termination: what turns the plant into a control task."""

from .mean_force import trim_of_pass
from .observation import Context
from .task import Task, passive_mean

__all__ = ["Context", "Task", "passive_mean", "trim_of_pass"]
