"""Observation, reward, termination: what turns the plant into a control task."""

from .policy import Context, Policy
from .task import Task

__all__ = ["Context", "Policy", "Task"]
