"""Cache of results of runs on disk, each under a checksum of its inputs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..backend import cache_folder, source_hash
from ..base.checksums import checksum, read_checked, write_checked
from ..base.errors import InputError
from ..catalog.loader import drawn_kind


def kept(folder: str, line: str, inputs: Any, compute: Callable[[], Any]) -> Any:
    """Result of ``compute`` for these inputs, both plain data; from the disk where it is cached already.

    The cache is a folder beside the compiled kernels of the same sources; without one nothing is cached, nor
    for a line drawn from a family or a section, by its name: a training draws thousands, and hardly meets
    one again.
    """
    cache = cache_folder()
    if cache is None or drawn_kind(line):
        return compute()
    made_of = checksum([source_hash(), inputs])
    file = cache / folder / f"{made_of}.json"
    with suppress(InputError):  # the file does not exist, or is damaged
        found = read_checked(file)
        if found["made_of"] == made_of:
            return found["value"]
    value = compute()
    with suppress(InputError, OSError):  # no room: the next process computes it again
        file.parent.mkdir(exist_ok=True)
        write_checked(file, {"made_of": made_of, "value": value})
    return value
