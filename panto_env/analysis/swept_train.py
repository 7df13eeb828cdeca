"""Trains in a sweep: distances between pantographs as parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..base.errors import InputError
from ..catalog import load_pantograph
from ..control.settings import run_settings
from ..plant.pantograph.schema import PantographData

DISTANCES = "distances"


def is_distance(name: str) -> bool:
    """Whether a parameter is a distance of a pantograph behind the first."""
    return name.partition(".")[0] == DISTANCES


def riding(settings: Mapping[str, Any]) -> tuple[Any, ...]:
    """Pantographs of a train as they are given; none where there is only one."""
    several = settings.get("pantographs") or ()
    return tuple(several) if isinstance(several, list | tuple) else (several,)


def with_distances(settings: Mapping[str, Any], parameters: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """Settings in which each distance that is swept, and not given, has its first value.

    Raises InputError for a distance that the train does not have, or that is both given and swept.
    """
    swept = {name: values for name, values in parameters.items() if is_distance(name)}
    places = {name: place(name, len(riding(settings)) - 1) for name in swept}
    if len({*places.values()}) < len(places):
        raise InputError(f"{' and '.join(places)} are the same distance; sweep it once.")
    given = settings.get(DISTANCES)
    if not swept or not all(swept.values()):  # a sweep without values is refused elsewhere
        return dict(settings)
    if given:
        if len(swept) == len(riding(settings)) - 1:
            raise InputError("The distances are swept already; give none besides.")
        return dict(settings)
    if len(swept) < len(riding(settings)) - 1:
        names = " or ".join(places)
        raise InputError(f"Only {names} is swept; give all distances of this train as a setting, too.")
    first = {places[name]: values[0] for name, values in swept.items()}
    return {**settings, DISTANCES: [first[k] for k in range(len(first))]}


def place(name: str, followers: int) -> int:
    """Index among the distances of a parameter, "distances" where there is one, else "distances.2".

    followers: number of pantographs behind the first. Raises InputError where the train has no such distance.
    """
    if followers < 1:
        raise InputError(
            f"{name} needs a train of several pantographs; name each of them, the first in front "
            "(--pantograph several times, or pantographs)."
        )
    known = [f"{DISTANCES}.{k + 1}" for k in range(followers)]
    if name == DISTANCES and followers == 1:
        return 0
    if name not in known:
        has = DISTANCES if followers == 1 else ", ".join(known)
        raise InputError(
            f"Unknown parameter '{name}': the distances behind the first pantograph of this train are {has}."
        )
    return known.index(name)


def placed(settings: Mapping[str, Any], values: Mapping[str, float]) -> tuple[float, ...]:
    """Distances of a train (m) with swept values in their places. InputError where they do not increase."""
    several, given = riding(settings), settings[DISTANCES]
    distances = list(given) if isinstance(given, list | tuple) else [given]
    for name, value in values.items():
        if is_distance(name):
            distances[place(name, len(several) - 1)] = value
    return run_settings({"pantographs": several, DISTANCES: distances}).distances


def distance_label(name: str) -> str:
    """Label of a swept distance, with its unit."""
    _, _, number = name.partition(".")
    return f"distance of pantograph {int(number or 1) + 1} behind the first (m)"


def changed_train(settings: Mapping[str, Any], name: str, pantograph: PantographData) -> dict[str, Any]:
    """Settings of a train whose pantographs are another one, which a swept value of ``pantograph.`` makes.

    Empty for a single pantograph. Raises InputError where the train has pantographs that differ.
    """
    several = riding(settings)
    if not several:
        return {}
    own = [load_pantograph(each) for each in several]
    if any(each != own[0] for each in own):
        raise InputError(
            f"{name} changes all pantographs of a train, which must be the same for that, not "
            f"{' and '.join(each.name for each in own)}."
        )
    return {"pantographs": [pantograph] * len(own)}
