"""Memory and threads after a minute of everything; `make fuzz` takes five."""

import sys
import warnings

import pytest

from panto_env.backend import JIT


@pytest.mark.study
@pytest.mark.skipif(
    not JIT or not sys.platform.startswith("linux"), reason="reads Linux's own account of memory"
)
def test_memory_does_not_grow_and_threads_end():
    from .soak import GROWTH, soak

    with warnings.catch_warnings(action="ignore"):
        steps, growth, threads = soak(60.0)
    assert steps > 2000
    assert growth < GROWTH
    assert threads <= 3  # pytest's own and a monitor's
