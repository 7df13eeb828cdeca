"""Paper 1's active control, its section 5 and Figs 13 to 18."""

from .study import run

__all__ = ["run"]
