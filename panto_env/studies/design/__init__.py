"""The search for a line, or a pantograph, under trains and control, and what makes its outcome credible."""

from .search import Design, Found, read_design, search

__all__ = ["Design", "Found", "read_design", "search"]
