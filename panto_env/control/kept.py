"""Results of runs that are kept on disk, each under a checksum of what it was made of."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..backend import cache_folder, source_hash
from ..base.checksums import checksum, read_checked, write_checked
from ..base.errors import InputError


def kept(folder: str, inputs: Any, compute: Callable[[], Any]) -> Any:
    """What ``compute`` gives for these inputs, both plain data; from the disk where a process kept it before.

    It is kept in a folder beside the compiled kernels of the same sources, where something can be kept.
    """
    cache = cache_folder()
    if cache is None:
        return compute()
    made_of = checksum([source_hash(), inputs])
    file = cache / folder / f"{made_of}.json"
    with suppress(InputError):  # nothing is there, or it is damaged
        found = read_checked(file)
        if found["made_of"] == made_of:
            return found["value"]
    value = compute()
    with suppress(InputError, OSError):  # no room: the next process works it out again
        file.parent.mkdir(exist_ok=True)
        write_checked(file, {"made_of": made_of, "value": value})
    return value
