"""Policies as programs for the controller of a train."""

from .export import Exported, Variable, exported

__all__ = ["Exported", "Variable", "exported"]
