"""A result played again from the actions that it keeps: its rows must follow from them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked
from panto_env.base.errors import InputError
from panto_env.base.files import finite
from panto_env.base.settings import parse
from panto_env.cluster import spread

from . import actions
from .run import outcome_of, passes_of
from .seeds import salt_hash
from .settings import BenchmarkSettings
from .single_pass import run_pass


@dataclass(frozen=True)
class Replayed:
    """A row of a result, and how far the pass that was played again differs from it."""

    row: Mapping[str, Any]
    difference: float  # maximum over its numbers, relative; 0 is bit for bit, infinite another kind of value


@dataclass(frozen=True)
class Replay:
    """All rows that were played again."""

    rows: tuple[Replayed, ...]
    follows: bool | None  # whether cells and standings follow from the rows; None if not all are bit for bit


def replay(
    result: str | Path,
    policies: Collection[str] = (),
    workers: int | None = None,
    progress: Progress | None = None,
) -> Replay:
    """Play the passes of a result again, by default those of all its policies.

    No policy runs: the plant gets the actions that are kept beside the result. On the same kind of machine
    everything is the same bit for bit; other processors round differently. Raises InputError for a damaged
    result, one without its actions, and a policy that is not in it.
    """
    table = read_checked(result)
    try:
        settings = parse(BenchmarkSettings, table["settings"], str(result))
        spans = tuple((int(first), int(last)) for first, last in table["spans"])
        rows, expected = table["rows"], table["actions_sha256"]
        passes = list(passes_of(settings, spans))
        kept = actions.read(actions.beside(result), expected)
        named = [row["policy"] for row in rows]
        learnt = tuple(table.get("learnt", ()))
        salted = table["salt_sha256"]
    except (LookupError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{result} is no result of `panto benchmark --output RESULT.json`.") from error
    if salted != (None if settings.salt is None else salt_hash(settings.salt)):
        raise InputError(
            f"{result} has a salt_sha256 that is not its salt's: its seeds are not those promised."
        )
    if not len(rows) == len(passes) == len(kept):
        raise InputError(
            f"{result} has {len(rows)} rows and the actions of {len(kept)} passes; make it again."
        )
    unknown = next((policy for policy in policies if policy not in named), None)
    if unknown is not None:
        raise InputError(f"{result} has no policy '{unknown}': it has {', '.join(dict.fromkeys(named))}.")
    chosen = [k for k, policy in enumerate(named) if not policies or policy in policies]
    first = settings.drawn_seeds[0]
    jobs = []
    for k in chosen:
        line, covered, policy, speed, seed = passes[k]
        play = partial(run_pass, traced=seed == first, played=kept[k])
        jobs.append(partial(play, settings, line, covered, policy, speed, seed))
    again = spread(jobs, workers=workers, progress=progress)
    replayed = tuple(
        Replayed(rows[k], _difference(rows[k], finite(each.row.as_dict())))
        for k, each in zip(chosen, again, strict=True)
    )
    follows = None
    if len(again) == len(rows) and not any(each.difference for each in replayed):
        outcome = outcome_of(settings, spans, again, learnt).as_dict()
        follows = all(table[part] == outcome[part] for part in ("standings", "cells", "traces"))
    return Replay(replayed, follows)


def _difference(stored: Mapping[str, Any], again: Mapping[str, Any]) -> float:
    """Maximum relative difference of two rows; infinite where they differ in more than finite numbers."""
    if stored.keys() != again.keys():
        return math.inf
    return max(_relative(stored[name], again[name]) for name in again)


def _relative(one: Any, other: Any) -> float:
    if one == other:
        return 0.0
    if not (isinstance(one, float) and isinstance(other, float)):
        return math.inf
    return abs(one - other) / max(abs(one), abs(other))
