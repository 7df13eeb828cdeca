"""Kernels compiled for a GPU, off line: whether the same source serves there, without one at hand.

This needs the package numba-cuda with NVIDIA's compiler libraries, and no GPU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import numba

COMPUTE_CAPABILITY = (9, 0)
"""Of the GPU that is compiled for."""


def ptx_of(function: Callable[..., Any], *arguments: Any) -> str:
    """PTX of a function that kernels call, as a device function for arguments such as these.

    Raises ImportError where numba-cuda is not installed, and Numba's errors where the source has something
    that a GPU does not know.
    """
    from numba import cuda

    signature = tuple(numba.typeof(argument) for argument in arguments)
    source = getattr(function, "py_func", function)
    with _without_device():
        text, _ = cuda.compile_ptx(source, signature, device=True, cc=COMPUTE_CAPABILITY)
    return str(text)


@contextmanager
def _without_device() -> Iterator[None]:
    """Let functions that are called be compiled for the same GPU, though none is there to be asked."""
    from numba.cuda import dispatcher

    ask = dispatcher.get_current_device
    dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    try:
        yield
    finally:
        dispatcher.get_current_device = ask
