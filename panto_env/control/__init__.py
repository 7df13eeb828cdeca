"""Observation, reward, termination: what turns the plant into a control task."""

from .observation import Context
from .passive_run import trim_of_pass
from .task import Task, passive_mean

__all__ = ["Context", "Task", "passive_mean", "trim_of_pass"]
