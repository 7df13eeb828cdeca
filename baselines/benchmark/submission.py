"""A result played again from the actions that it keeps: its rows must follow from them."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import Field, field_validator

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked
from panto_env.base.errors import InputError
from panto_env.base.files import finite, read_toml
from panto_env.base.settings import Settings, parse
from panto_env.cluster import spread

from . import actions
from .overall import Standing
from .run import Benchmark, outcome_of, passes_of, run
from .settings import REFERENCE, TAPE, BenchmarkSettings, Windows
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
        windows = tuple(Windows(*(each and tuple(each) for each in found)) for found in table["windows"])
        rows, expected = table["rows"], table["actions_sha256"]
        passes = list(passes_of(settings, windows))
        kept = actions.read(actions.beside(result), expected)
        named = [row["policy"] for row in rows]
        learnt = tuple(table.get("learnt", ()))
    except InputError:
        raise
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(f"{result} is no result of `panto benchmark --output RESULT.json`.") from error
    if not len(rows) == len(passes) == len(kept):
        raise InputError(
            f"{result} has {len(rows)} rows and the actions of {len(kept)} passes; make it again."
        )
    for policy in policies:
        if policy not in named:
            raise InputError(f"{result} has no policy '{policy}': it has {', '.join(dict.fromkeys(named))}.")
    chosen = [k for k, policy in enumerate(named) if not policies or policy in policies]
    first = settings.drawn_seeds[0]
    jobs = [
        partial(run_pass, settings, *passes[k], traced=passes[k][-1] == first, played=kept[k]) for k in chosen
    ]
    again = spread(jobs, workers=workers, progress=progress)
    replayed = tuple(
        Replayed(rows[k], _difference(rows[k], finite(each.row.as_dict())))
        for k, each in zip(chosen, again, strict=True)
    )
    follows = None
    if len(again) == len(rows) and not any(each.difference for each in replayed):
        outcome = outcome_of(settings, windows, again, learnt).as_dict()
        follows = all(table[part] == outcome[part] for part in ("standings", "cells", "traces"))
    return Replay(replayed, follows)


def _difference(stored: Mapping[str, Any], again: Mapping[str, Any]) -> float:
    """Maximum relative difference of two rows; infinite where they differ in more than finite numbers."""
    if stored.keys() != again.keys():
        return math.inf
    pairs = [(stored[name], again[name]) for name in again if stored[name] != again[name]]
    if not all(isinstance(value, float) for pair in pairs for value in pair):
        return math.inf
    return max((abs(one - other) / max(abs(one), abs(other)) for one, other in pairs), default=0.0)


CARD, REQUIREMENTS = "card.toml", "requirements.txt"
"""Files of a submission: its card, which it must have, and packages that its policy requires."""


class Card(Settings):
    """What a submission is, in the words of those who enter it."""

    name: str = Field(min_length=1, max_length=60)
    policy: str = Field(
        description="its file in the folder: a model file, or a Python file and its class (policy.py:Mine)"
    )
    authors: tuple[str, ...] = Field(min_length=1)
    description: str = Field(min_length=1, description="how it controls, and with which observation")
    licence: str = Field(min_length=1, description="of policy and card, as an SPDX identifier")
    learnt_from: str = Field(
        min_length=1,
        description="lines, speeds and seeds that it was trained, tuned or selected on; 'nothing' if none",
    )
    link: str | None = Field(None, description="to an article or to the code that made it")

    @field_validator("policy")
    @classmethod
    def _inside(cls, policy: str) -> str:
        file = Path(policy.partition(":")[0])
        if file.is_absolute() or ".." in file.parts:
            raise ValueError("must be a file in the folder of the card")
        return policy


@dataclass(frozen=True)
class Checked:
    """A submission as a benchmark sees it."""

    card: Card
    requirements: tuple[str, ...]
    outcome: Benchmark
    standing: Standing  # its result over all lines, speeds and seeds
    tape: Standing  # that of its own actions, played on other lines: what it reaches without feedback


def read_submission(folder: str | Path) -> tuple[Card, str, tuple[str, ...]]:
    """Card, policy and requirements of a submission; nothing of it has run.

    Raises InputError, naming file and key, where it is not whole.
    """
    path, required = Path(folder) / CARD, Path(folder) / REQUIREMENTS
    card = parse(Card, read_toml(path), str(path))
    file, *rest = card.policy.split(":", 1)
    source = Path(folder) / file
    if not source.is_file():
        raise InputError(f"{path} names the policy '{card.policy}', but there is no file {source}.")
    try:
        requirements = _requirements(required.read_text("utf-8")) if required.exists() else ()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{required} could not be read: write it as text in UTF-8.") from error
    return card, ":".join((str(source), *rest)), requirements


def _requirements(text: str) -> tuple[str, ...]:
    """Lines of a file for pip, without comments."""
    lines = (re.sub(r"(^|\s)#.*", "", line).strip() for line in text.splitlines())
    return tuple(line for line in lines if line)


def check(
    folder: str | Path,
    settings: BenchmarkSettings,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Checked:
    """Run a submission as a benchmark would, beside the passive pantograph and the submission's own tape.

    settings: of the track, whose policies don't run. Raises InputError for a submission that is not whole,
    and for a policy that fails.
    """
    card, policy, requirements = read_submission(folder)
    lines = tuple(line.model_copy(update={"policies": ()}) for line in settings.lines)
    policies = (REFERENCE, policy, f"{TAPE}{policy}")
    changes = {"policies": policies, "lines": lines, "trainings": {}, "trusted": False}
    outcome = run(settings.model_copy(update=changes), workers, progress)
    found = {each.policy: each for each in outcome.standings}
    return Checked(card, requirements, outcome, *(found[each] for each in policies[1:]))
