"""Published pantographs and lines, and families of lines: TOML files, each value with its source."""

from .loader import available, load_catenary, load_family, load_lines, load_pantograph, unusual

__all__ = ["available", "load_catenary", "load_family", "load_lines", "load_pantograph", "unusual"]
