"""Observation, reward, termination: what turns the plant into a control task."""

from .context import Context
from .task import Task

__all__ = ["Context", "Task"]
