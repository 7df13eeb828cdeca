"""One or two parameters of the plant, its actuators or its policy over ranges, on all cores."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from ..base.errors import InputError
from ..base.settings import Settings, hint
from ..control.arguments import check_arguments
from ..control.settings import RunSettings, default, run_settings
from ..metrics.figures import Figures
from ..metrics.spans import SpanChoice, in_words
from ..policies import find_policy
from .parameters import change, check_name, parameter_names
from .pool import Progress, in_threads
from .simulation import simulate

SPEED = "speed_kmh"
POLICY = "policy"
"""First part of a policy's parameter, ``policy.gain``, which goes to every policy."""
MOST_PARAMETERS = 2
MOST_PASSES = 100_000

Row = dict[str, Any]
FAMILIES = ("catenary", "pantograph", "actuator", "sensors", "line_condition")
"""Settings whose own values can be swept, as ``pantograph.masses.0``."""


@dataclass(frozen=True)
class _Pass:
    """One pass to run: the swept values, the policy by its own name, and what ``simulate`` takes."""

    values: dict[str, float]
    policy: str
    arguments: dict[str, Any]


def sweep(
    parameters: Mapping[str, Sequence[float]],
    *,
    policies: Sequence[str | Path | None] = (None,),
    spans: SpanChoice = None,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> list[Row]:
    """Run every policy at every value of one parameter, or every pair of values of two.

    parameters: values by dotted name as in the TOML (``pantograph.masses.0``,
    ``catenary.contact_wire.tension``, ``actuator.lag``), ``speed_kmh``, or ``policy.gain`` for a keyword
    of every policy. policies: names, model files, or None for the passive pantograph. spans: that the
    figures cover, first and last from 1, or "all"; by default those after the start. workers: threads, one
    per core by default; the outcome does not depend on it. progress: called with the passes done and of
    all. seed, settings: as for ``simulate`` (catenary, pantograph, speed_kmh, distance (m), ...).

    Returns one row per pass, in the order of values, then policies: the swept values, what was run, and
    every figure of ``Trajectory.summary``; where a run ended early they are nan, and "ending" says where
    and why. Raises InputError for an unknown parameter, a value that its schema refuses, and whatever else
    ``simulate`` refuses; all values are checked before the first pass.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers must be 1 or more, not {workers}.")
    check_arguments(settings, RunSettings, "sweep")
    checked: RunSettings = run_settings(settings)
    if len(checked.line_condition) != 1:
        raise InputError("A sweep takes one condition of the line, not a list of them.")
    entries: dict[str, Settings] = {family: getattr(checked, family) for family in FAMILIES[:-1]}
    entries["line_condition"] = checked.line_condition[0]
    given = settings | {"seed": seed}
    _check(parameters, entries, policies)
    passes = [
        _prepare(dict(zip(parameters, values, strict=True)), policy, entries, given)
        for values in product(*parameters.values())
        for policy in policies
    ]
    # Threads, not processes: a pass takes tens of milliseconds, less than a process takes to start.
    return in_threads(
        [partial(_row, one_pass, spans) for one_pass in passes], workers=workers, progress=progress
    )


def _check(
    parameters: Mapping[str, Sequence[float]],
    entries: Mapping[str, Settings],
    policies: Sequence[str | Path | None],
) -> None:
    if not 1 <= len(parameters) <= MOST_PARAMETERS:
        raise InputError(f"One or two parameters can be swept, not {len(parameters)}.")
    if not policies:
        raise InputError("There is no policy to run; name at least one, or leave policies at its default.")
    for policy in policies:
        if not (policy is None or isinstance(policy, str | Path)):
            raise InputError(f"A sweep takes policies by name or model file, not {policy!r}.")
    for name, values in parameters.items():
        _check_name(name, entries)
        if len(values) == 0:
            raise InputError(f"There are no values of {name} to run.")
    passes = len(policies) * math.prod(len(values) for values in parameters.values())
    if passes > MOST_PASSES:
        raise InputError(f"This sweep has {passes:,} passes; {MOST_PASSES:,} at most can be run, take fewer.")


def _check_name(name: str, entries: Mapping[str, Settings]) -> None:
    family = name.partition(".")[0]
    if name == SPEED or (family == POLICY and family != name):
        return
    if family in entries:
        check_name(name, entries[family])
        return
    everything = [known for owner, entry in entries.items() for known in parameter_names(entry, owner)]
    near = hint(name, [SPEED, *everything])
    families = ", ".join(f"'{owner}.'" for owner in (*entries, POLICY))
    raise InputError(
        f"Unknown parameter '{name}': {near}it must be {SPEED} or begin with one of {families} "
        "(as pantograph.masses.0)."
    )


def _prepare(
    values: dict[str, float],
    policy: str | Path | None,
    entries: Mapping[str, Settings],
    settings: dict[str, Any],
) -> _Pass:
    changed, speed_kmh = dict(entries), settings.get(SPEED, default(SPEED))
    of_policy: list[str] = []
    for name, value in values.items():
        family, _, rest = name.partition(".")
        if name == SPEED:
            speed_kmh = value
        elif family == POLICY:
            of_policy.append(f"{rest}={value!r}")
        else:
            changed[family] = change(changed[family], name, value)
    source = None if policy is None else str(policy)
    if of_policy:
        if source is None:
            raise InputError(f"The passive pantograph has no {' or '.join(values)}; name a policy.")
        source = f"{source}{',' if ':' in source else ':'}{','.join(of_policy)}"
    if source is not None:
        find_policy(source)
    label = "passive" if policy is None else str(policy)
    return _Pass(values, label, {**settings, **changed, "speed_kmh": speed_kmh, "policy": source})


def _row(one_pass: _Pass, spans: SpanChoice) -> Row:
    try:
        run = simulate(**{"record_droppers": False, "evaluated": spans} | one_pass.arguments)
        figures = Figures.none() if run.terminated else run.summary(spans)
    except InputError as error:
        at = ", ".join(f"{name} = {value:g}" for name, value in one_pass.values.items())
        raise InputError(f"At {at}: {error}") from error
    return {
        **one_pass.values,
        "policy": one_pass.policy,
        "catenary": run.catenary,
        "pantograph": run.pantograph,
        "speed_kmh": one_pass.arguments["speed_kmh"],
        "seed": run.seed,
        "nominal_force": run.nominal_force,
        "terminated": run.terminated,
        "ending": run.ending,
        "spans": "" if run.terminated else in_words(run.spans(spans)),
        **figures.as_dict(),
    }
