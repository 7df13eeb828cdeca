"""A report of runs for engineers: one page of HTML that holds all it needs."""

from .page import save

__all__ = ["save"]
