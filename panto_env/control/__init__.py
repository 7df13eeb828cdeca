"""Observation, reward, termination: what turns the plant into a control task."""

from ..policies import Context, Policy
from .task import Task

__all__ = ["Context", "Policy", "Task"]
