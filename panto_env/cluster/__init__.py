"""Many jobs: on this machine or as tasks of a Ray cluster, and in parts that survive an interruption."""

from .spread import RayAddress, spread

__all__ = ["RayAddress", "spread"]
