"""Published pantographs and lines: TOML files, each value with its source, and their validation."""

from .loader import available, load_catenary, load_pantograph

__all__ = ["available", "load_catenary", "load_pantograph"]
