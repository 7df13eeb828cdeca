"""A disk on which no file grows beyond a size: a limit of this process, and of those that it starts."""

import contextlib

import pytest


@contextlib.contextmanager
def largest_file():
    """Within the body, the function that is given sets the maximum size of a file (bytes)."""
    resource = pytest.importorskip("resource", reason="limits of Unix")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
