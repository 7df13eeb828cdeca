"""A report of runs for engineers: one self-contained page of HTML."""

from .page import save

__all__ = ["save"]
