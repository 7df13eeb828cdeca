"""Seeds and options of ``reset``, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..base.errors import InputError, shown


def checked_seed(seed: Any, others: str = "") -> int | None:
    """A seed, or None. Raises InputError unless it is a whole number from 0 up or None, or ``others``."""
    if seed is None:
        return None
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not whole or seed < 0:
        raise InputError(f"seed must be a whole number from 0 up{others}, or None, not {shown(seed)}.")
    return int(seed)


def checked_seeds(seed: Any, lanes: int) -> list[int | None]:
    """Seeds of lanes: of a number that number plus the lane, or one for each. Raises InputError otherwise."""
    others = f", or a list of {lanes} such numbers or None, one per lane"
    listed = isinstance(seed, Sequence) and not isinstance(seed, str | bytes)
    if listed or (isinstance(seed, np.ndarray) and seed.ndim):
        if len(seed) != lanes:
            raise InputError(f"seed must be a number or one per lane, {lanes}, not {len(seed)}.")
        return [checked_seed(each, others) for each in seed]
    first = checked_seed(seed, others)
    return [None if first is None else first + lane for lane in range(lanes)]


def check_whole_trains(mask: Any, agents: int) -> None:
    """Raise InputError where a mask, (lanes,), marks some of the lanes of a train, so many each."""
    trains = mask.reshape(-1, agents)
    parts = (trains != trains[:, :1]).any(1).tolist()
    if any(parts):
        first = parts.index(True) * agents
        several = f"lanes {first} to {first + agents - 1}"
        raise InputError(f"reset_mask marks a part of a train: mark all of {several}, or none of them.")


def checked_options(options: Any) -> dict[str, Any]:
    """Options by name; none for None. Raises InputError for anything else than a dictionary by names."""
    if options is None:
        return {}
    if not (isinstance(options, Mapping) and all(isinstance(name, str) for name in options)):
        raise InputError(
            "options must be a dictionary of arguments by name, such as {'speed_kmh': 250}, "
            f"not {shown(options)}."
        )
    return dict(options)
