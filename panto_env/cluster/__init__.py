"""Jobs beyond one machine: as tasks of a Ray cluster, where processes of this machine would do them."""

from .spread import RayAddress, spread

__all__ = ["RayAddress", "spread"]
