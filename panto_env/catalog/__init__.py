"""Published pantographs and lines, families of lines and sections: TOML files, each value with its source."""

from .loader import (
    available,
    line,
    load_catenary,
    load_drawn,
    load_family,
    load_lines,
    load_pantograph,
    load_section,
    pantograph,
    unusual,
)

__all__ = [
    "available",
    "line",
    "load_catenary",
    "load_drawn",
    "load_family",
    "load_lines",
    "load_pantograph",
    "load_section",
    "pantograph",
    "unusual",
]
