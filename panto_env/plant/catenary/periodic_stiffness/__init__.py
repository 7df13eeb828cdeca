"""Periodic stiffness (paper 3, Eqs 1-5): a massless spring k(x) = k_m (1 + eps cos(2 pi x / L))."""

from ..protocol import CatenaryKind
from . import step as step
from .build import PeriodicStiffness
from .schema import PeriodicStiffnessData

__all__ = ["KIND", "PeriodicStiffness", "PeriodicStiffnessData"]

KIND = CatenaryKind(PeriodicStiffnessData, PeriodicStiffness)
