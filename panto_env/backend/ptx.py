"""Compilation of kernels for a GPU, to check that the same source works there.

This needs the package numba-cuda with NVIDIA's compiler libraries, but no GPU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numba

COMPUTE_CAPABILITY = (9, 0)
"""Compute capability of the target GPU."""


def ptx_of(function: Callable[..., Any], *arguments: Any) -> str:
    """PTX of a function that kernels call, as a device function for arguments such as these.

    Raises ImportError where numba-cuda is not installed, and Numba's errors where the source has something
    that a GPU does not support.
    """
    from numba import cuda

    signature = tuple(numba.typeof(argument) for argument in arguments)
    source = getattr(function, "py_func", function)
    with without_device():
        text, _ = cuda.compile_ptx(source, signature, device=True, cc=COMPUTE_CAPABILITY)
    return str(text)


@contextmanager
def without_device() -> Iterator[None]:
    """Within the body called functions are compiled for the same GPU, although the machine has none."""
    from numba.cuda import dispatcher

    ask = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    try:
        yield
    finally:
        dispatcher.get_current_device = ask
