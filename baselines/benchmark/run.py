"""Policies x lines x speeds x seeds, paired, on all cores; their result, and how it is read from its JSON."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from panto_env.analysis.pool import Progress, check_passes, one_by_one
from panto_env.base.checksums import __version__, read_checked, write_checked
from panto_env.base.errors import InputError
from panto_env.base.files import JSON, check_output, finite, suffix_of
from panto_env.base.machine import cores
from panto_env.base.settings import dotted
from panto_env.base.table import TABLES, write_rows
from panto_env.cluster import spread
from panto_env.control import Task
from panto_env.control.lines import fewest_spans, on_example
from panto_env.control.settings import far_enough, run_settings
from panto_env.metrics.figures import FIRST_SETTLED, HEADINGS, LAST_USUAL
from panto_env.plant.catenary.schema import CLEAR
from panto_env.policies import code_named

from ..oracle.stored import stored_changes
from . import actions, apart
from .actions import Played, Trace
from .overall import Standing, by_rank, method_of, standings
from .settings import (
    ORACLE_TAPE,
    BenchmarkSettings,
    Line,
    LineAtSpeed,
    Windows,
    control_of,
    policy_of,
    salt_hash,
)
from .single_pass import (
    LATE,
    ROW_HEADINGS,
    Pass,
    Row,
    along,
    at_speed,
    check_beginnings,
    line_ends,
    oracle_tape,
    run_pass,
)
from .statistics import Cell, compare

SUFFIXES = (*JSON, *TABLES)  # suffixes of the files that an outcome can be saved to
PER_CORE = 2
"""Processes per core: a plant waits while its policy acts, in a process of its own, and vice versa."""


@dataclass(frozen=True)
class Benchmark:
    """Outcome of a benchmark."""

    settings: BenchmarkSettings
    windows: tuple[Windows, ...]  # evaluated on each line
    rows: tuple[Row, ...]  # one per pass, in the order of lines, speeds, policies and seeds
    cells: tuple[Cell, ...]  # one per policy, line and speed
    standings: tuple[Standing, ...]  # one per policy that runs on every line
    traces: tuple[Trace, ...]  # of the passes under the first seed that did not end early
    played: tuple[Played, ...] = field(repr=False, compare=False)  # in the rows' passes
    learnt: tuple[str, ...] = ()  # policies that are not ranked for it, see ``compare``

    def as_dict(self) -> dict[str, Any]:
        """The whole outcome as plain data for JSON: nan becomes None."""
        table: dict[str, Any] = finite(
            {
                "version": __version__,
                "settings": self.settings.model_dump(mode="json"),
                "salt_sha256": None if self.settings.salt is None else salt_hash(self.settings.salt),
                "actions_sha256": actions.digest(self.played),
                "windows": self.windows,
                "learnt": self.learnt,
                "standings": [asdict(each) for each in self.standings],
                "cells": [asdict(cell) for cell in self.cells],
                "rows": [row.as_dict() for row in self.rows],
                "traces": [asdict(each) for each in self.traces],
            }
        )
        return table

    def save(self, path: str | Path) -> None:
        """Write a file, whole or not at all: everything as JSON, or the rows as CSV, Excel or Parquet.

        The actions of all passes are written beside a JSON.
        """
        check_output(path, SUFFIXES)
        if suffix_of(path) not in JSON:
            headings = HEADINGS | ROW_HEADINGS
            late = {f"{LATE}{name}": f"{LATE}{heading}" for name, heading in headings.items()}
            write_rows([row.as_dict() for row in self.rows], path, headings | late)
            return
        write_checked(path, self.as_dict())
        actions.save(self.played, actions.beside(path))


def run(
    settings: BenchmarkSettings,
    workers: int | None = None,
    progress: Progress | None = None,
    ray: str | None = None,
) -> Benchmark:
    """Run every policy on every line at every speed under every seed.

    workers: number of processes, by default two per core; the outcome does not depend on it. With more
    than one, a script must call this under ``if __name__ == "__main__":``. progress: called with the
    number of passes done and the total number. ray: address of a Ray cluster that runs the passes instead.
    Raises InputError for invalid settings, and for a policy that fails, which it names.
    """
    if ray is None and workers is None:
        workers = PER_CORE * cores()
    count = sum(len(line.speeds_kmh) * len(settings.policies_on(line)) for line in settings.lines)
    check_passes(count * len(settings.seeds), "This benchmark")
    try:
        _check_policies(settings)
        windows = tuple(evaluated_windows(settings, line) for line in settings.lines)
        for line in settings.lines:
            check_beginnings(settings, line)
        first = settings.drawn_seeds[0]
        jobs = [
            partial(run_pass, settings, line, covered, policy, speed, seed, traced=seed == first)
            for line, covered, policy, speed, seed in passes_of(settings, windows)
        ]
        if workers == 1 and ray is None:
            passes = one_by_one(jobs, progress=progress)
        else:
            passes = spread(jobs, workers=workers, ray=ray, progress=progress)
        learnt = _learnt(jobs, passes)
    finally:
        apart.close()
    return outcome_of(settings, windows, passes, learnt)


def _learnt(jobs: Sequence[Callable[[], Pass]], passes: Sequence[Pass]) -> tuple[str, ...]:
    """Policies with code from a path whose last and first pass, each played again alone, differ in a bit."""
    own = defaultdict(list)
    for k, each in enumerate(passes):
        if not control_of(each.row.policy) and any(code_named(each.row.policy)):
            own[each.row.policy].append(k)

    def differs(k: int) -> bool:
        apart.close()
        return actions.digest([jobs[k]().played]) != actions.digest([passes[k].played])

    return tuple(policy for policy, places in own.items() if differs(places[-1]) or differs(places[0]))


def _check_policies(settings: BenchmarkSettings) -> None:
    """Raise InputError for a policy that cannot be made, before any pass is run."""
    policies = set()
    for line in settings.lines:
        policies |= set(settings.policies_on(line))
        for speed in line.speeds_kmh if ORACLE_TAPE in settings.policies_on(line) else ():
            oracle_tape(settings, line, speed)
    for policy in policies - {ORACLE_TAPE}:
        apart.find_apart(policy_of(policy), settings.trusted)


def passes_of(
    settings: BenchmarkSettings, windows: Sequence[Windows]
) -> Iterator[tuple[Line, Windows, str, float, int]]:
    """Line, windows, policy, speed (km/h) and seed of each pass, in the order of a result's rows."""
    for line, covered in zip(settings.lines, windows, strict=True):
        for speed in line.speeds_kmh:
            for policy in settings.policies_on(line):
                for seed in settings.drawn_seeds:
                    yield line, covered, policy, speed, seed


def outcome_of(
    settings: BenchmarkSettings,
    windows: tuple[Windows, ...],
    passes: Sequence[Pass],
    learnt: tuple[str, ...] = (),
) -> Benchmark:
    """Outcome of all passes; learnt: see ``compare``."""
    oracles = {}
    for line, covered in zip(settings.lines, windows, strict=True):
        for speed in line.speeds_kmh:
            changes = stored_changes(at_speed(along(settings, line), speed), covered.early)
            oracles[LineAtSpeed(line.catenary, line.pantograph, speed, line.case)] = changes
    rows = tuple(each.row for each in passes)
    traces = tuple(each.trace for each in passes if each.trace is not None)
    cells = compare(rows, oracles, learnt)
    played = tuple(each.played for each in passes)
    standing = standings(rows, cells, settings.trainings)
    return Benchmark(settings, windows, rows, cells, standing, traces, played, learnt)


def evaluated_windows(settings: BenchmarkSettings, line: Line) -> Windows:
    """Windows to evaluate; raises InputError where the line cannot be run with these settings."""
    late = None if line_ends(line.catenary) else settings.late_spans
    early = _evaluated(settings, line, line.spans or (None if late is None else (FIRST_SETTLED, LAST_USUAL)))
    if late is None:
        return Windows(early)
    if late[0] <= early[1]:
        raise InputError(
            f"late_spans must come after spans {early[0]} to {early[1]} of line '{line.catenary}', not at "
            f"{late[0]} to {late[1]}."
        )
    return Windows(early, _evaluated(settings, line, late))


def _evaluated(
    settings: BenchmarkSettings, line: Line, given_spans: tuple[int, int] | None
) -> tuple[int, int]:
    """First and last span of a window: those given, or from the tenth to the last that a run covers whole."""
    given = at_speed(along(settings, line), (min(line.speeds_kmh), max(line.speeds_kmh)))
    chosen = run_settings(given)
    task = Task(far_enough(on_example(chosen)))
    last = task.plant.alignment.last_whole_span(task.length.own_distance)
    if (shortest := fewest_spans(chosen)) is not None:  # whose end reflects waves
        last = min(last, shortest - CLEAR)
    first, last = given_spans or (FIRST_SETTLED, last)
    where = f"on line '{line.catenary}', where every run covers {task.length.own_distance:g} m"
    if not 1 <= first <= last:
        raise InputError(
            f"There are no spans {first} to {last} to evaluate {where}; "
            "give a longer distance or other spans."
        )
    if task.plant.alignment.support(last) > task.length.own_distance:
        raise InputError(f"Spans {first} to {last} can't be evaluated {where}; give a longer distance.")
    return first, last


class Result(BaseModel):
    """Result of one track, as far as the page shows it; keys that the page does not use are ignored."""

    model_config = ConfigDict(frozen=True)

    version: str
    settings: dict[str, Any]
    windows: tuple[Windows, ...]
    standings: tuple[Standing, ...]
    cells: tuple[Cell, ...]
    traces: tuple[Trace, ...]

    @property
    def title(self) -> str:
        """Title from the benchmark's settings."""
        return str(self.settings.get("title", "benchmark"))

    @property
    def policies(self) -> list[str]:
        """Names of all policies that ran, in the order of the settings."""
        return list(dict.fromkeys(cell.policy for cell in self.cells))

    @property
    def method_of(self) -> dict[str, str]:
        """Methods by the names of their trainings."""
        return method_of(self.standings)

    @property
    def by_rank(self) -> list[Standing]:
        """Standings, the best first: see ``overall.by_rank``."""
        return by_rank(self.standings)

    @property
    def places(self) -> list[LineAtSpeed]:
        """Lines and speeds, in the order of the settings."""
        return list(dict.fromkeys(cell.place for cell in self.cells))

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if not self.cells or len(self.windows) != len({place.line for place in self.places}):
            raise ValueError("must have cells, and spans for each of their lines")
        standing = {one.policy for one in self.standings if not one.trainings}
        if not standing | {one.policy for one in self.traces} <= set(self.policies):
            raise ValueError("must have a cell for every policy")
        if not set(self.method_of) <= standing:
            raise ValueError("must have a standing for every training")
        for one in self.traces:
            for x, y in ((one.position, one.force), (one.frequency, one.amplitude)):
                if len(x) != len(y) or not x or not x[0] < x[-1]:
                    raise ValueError("must have one value for each position, and positions that rise")
        return self


def read_result(path: str | Path) -> Result:
    """Read the result in a JSON file. Raises InputError if it holds none or is damaged."""
    return parse_result(read_checked(path), str(path))


def parse_result(table: Any, name: str) -> Result:
    """Result from plain data. Raises InputError, which calls the data ``name``, if it is no result."""
    try:
        return Result.model_validate(table)
    except ValidationError as error:
        place = dotted(error.errors()[0]["loc"])
        where = f"'{place}' is missing or wrong" if place else "its parts do not fit together"
        raise InputError(
            f"{name} is no result of `panto benchmark --output RESULT.json`: {where}; run the benchmark anew."
        ) from error
