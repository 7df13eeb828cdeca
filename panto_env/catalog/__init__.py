"""Published pantographs and lines: TOML files, each value with its source, and their validation."""

from .loader import available, load_catenary, load_pantograph
from .schema import Catenary, FlexibleCatenaryData, PantographData, PeriodicStiffnessData, ThreeSpanData

__all__ = [
    "Catenary",
    "FlexibleCatenaryData",
    "PantographData",
    "PeriodicStiffnessData",
    "ThreeSpanData",
    "available",
    "load_catenary",
    "load_pantograph",
]
