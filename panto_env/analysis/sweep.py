"""One to three parameters of the plant, its actuators or its policy over ranges, on all cores."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import product, takewhile
from pathlib import Path
from typing import Any, NamedTuple

from ..base.errors import InputError, hint, shown
from ..base.settings import Settings
from ..base.table import write_rows
from ..control import Task
from ..control.arguments import check_arguments
from ..control.settings import RunSettings, default, run_settings, speed_range
from ..metrics.by_span import evaluated, near_train
from ..metrics.figures import HEADINGS, LABELS, NUMBER, Figures, SpanChoice, in_words
from ..metrics.trajectory import Trajectory
from ..policies import find_policy, with_parameters
from .parameters import (
    DISTANCES,
    change,
    changed_train,
    check_name,
    is_distance,
    parameter_label,
    parameter_names,
    placed,
    riding,
    with_distances,
)
from .pool import Progress, check_passes, in_threads, workers_for
from .simulation import simulate

SPEED = "speed_kmh"
POLICY = "policy"
"""First part of a parameter of all policies, for example ``policy.gain``."""
FIRST = ("catenary.span_length", "catenary.droppers.spacing")
"""Parameters that lay out droppers anew, in the order in which they are changed, before all others."""

Row = dict[str, Any]
FAMILIES = ("catenary", "pantograph", "actuator", "sensors", "line_condition")
"""Settings whose own values can be swept, for example ``pantograph.masses.1``."""


class OnePass(NamedTuple):
    """One pass to run: the swept values, the policy's name, and the arguments of ``simulate``."""

    values: dict[str, float]
    policy: str
    arguments: dict[str, Any]


def sweep(
    parameters: Mapping[str, Sequence[float]],
    *,
    policies: Sequence[str | Path | None] = (None,),
    spans: SpanChoice = None,
    line_spans: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> list[Row]:
    """Run every policy at every value of one parameter, or at all combinations of values of two or three.

    parameters: values by dotted name as in the TOML (``pantograph.masses.1``,
    ``catenary.droppers.spacing``, ``actuator.lag``), ``speed_kmh``, ``policy.gain`` for a keyword of
    every policy, or ``distances``, that of the second of two ``pantographs`` (m), ``distances.1``,
    ``distances.2`` where there are more; ``pantograph.`` changes all pantographs of a train. policies: names,
    model files, or None for the passive pantograph. spans: of the figures, as ``Trajectory.summary`` takes
    them. line_spans: ``spans`` of ``simulate``, the number of the line's. workers: threads, one per core by
    default; the results do not depend on it. progress: called with the numbers of finished and of all passes.
    seed, settings: as for ``simulate``.

    Returns one row per pass, in the order of values, then policies: the swept values, the run's settings,
    every figure of ``Trajectory.summary``, the maximum force of a dropper (N), the number of droppers that go
    slack while the train is in their span, the share of that time (%), and which requirements are broken;
    where a run ended early figures are nan, and "ending" says where and why. A line keeps the spacing of its
    droppers, about, in spans of another length. A train has a row for each pantograph, with its
    "pantograph_number", 1 for the first; all have figures over the spans that the last one covers. Raises
    InputError for an unknown parameter, a value that its schema refuses, and as ``simulate`` does; all values
    are checked before the first pass.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers must be 1 or more, not {workers}.")
    check_arguments(settings, RunSettings, "sweep")
    settings = with_distances({**settings, "spans": line_spans}, parameters)
    checked: RunSettings = run_settings(settings)
    if len(checked.line_condition) != 1:
        raise InputError("A sweep takes one condition of the line, not a list of them.")
    entries = entries_of(checked)
    given = {**settings, "seed": seed}
    _check(parameters, entries, policies)
    passes = [
        prepare(dict(zip(parameters, values, strict=True)), policy, entries, given)
        for values in product(*parameters.values())
        for policy in policies
    ]
    _check_memory(passes, workers)
    # Threads, not processes: a pass takes tens of milliseconds, less than a process takes to start.
    jobs = [partial(_rows, one_pass, spans) for one_pass in passes]
    return [row for rows in in_threads(jobs, workers=workers, progress=progress) for row in rows]


def save(rows: Sequence[Row], path: str | Path, **settings: Any) -> None:
    """Write the rows of a sweep as CSV, Excel or Parquet, by the file's suffix, whole or not at all.

    settings: those of the sweep, for the units of the swept values. CSV and Excel have units in the headings,
    all values are in SI units but for the speed (km/h).
    """
    swept = list(takewhile(lambda name: name != POLICY, next(iter(rows), ())))
    units = {name: label[label.rfind(" (") :] for name, label in labels(swept, **settings).items()}
    headings = {name: f"{name}{units[name]}" for name in swept if units[name].endswith(")")}
    write_rows(rows, path, headings | HEADINGS)


def labels(parameters: Sequence[str], **settings: Any) -> dict[str, str]:
    """Label of each parameter, with its unit, for the axes of a plot; settings: those of ``sweep``."""
    first = {"pantograph": train[0]} if (train := riding(settings)) else {}
    given = {name: settings[name] for name in FAMILIES if name in settings}
    entries = entries_of(run_settings(given | first))
    found = {SPEED: "speed of the train (km/h)"}
    for name in parameters:
        family, _, rest = name.partition(".")
        if is_distance(name):
            found[name] = f"distance of pantograph {int(rest or 1) + 1} behind the first (m)"
        elif name != SPEED:
            found[name] = parameter_label(name, entries[family]) if family in entries else f"policy: {rest}"
    return found


def entries_of(settings: RunSettings) -> dict[str, Settings]:
    """Settings whose values can be swept, by their family."""
    entries: dict[str, Settings] = {family: getattr(settings, family) for family in FAMILIES[:-1]}
    return entries | {"catenary": settings.line, "line_condition": settings.line_condition[0]}


def _check(
    parameters: Mapping[str, Sequence[float]],
    entries: Mapping[str, Settings],
    policies: Sequence[str | Path | None],
) -> None:
    if not 1 <= len(parameters) <= 3:
        raise InputError(f"One to three parameters can be swept, not {len(parameters)}.")
    if not policies:
        raise InputError("There is no policy to run; name at least one, or leave policies at its default.")
    for policy in policies:
        if not (policy is None or isinstance(policy, str | Path)):
            raise InputError(f"A sweep takes policies by name or model file, not {shown(policy)}.")
    for name, values in parameters.items():
        _check_name(name, entries)
        if len(values) == 0:
            raise InputError(f"There are no values of {name} to run.")
        family = name.partition(".")[0]
        if family in ("actuator", "sensors") and all(policy is None for policy in policies):
            raise InputError(f"{name} changes nothing without a policy; name one.")
        twice = next((value for value, count in Counter(values).items() if count > 1), None)
        if twice is not None:
            raise InputError(f"{name} has the value {twice:g} twice; give each once.")
    check_passes(len(policies) * math.prod(len(values) for values in parameters.values()), "This sweep")


def _check_memory(passes: Sequence[OnePass], workers: int | None) -> None:
    """Raise InputError where the records of the passes that run at once do not fit into memory.

    The longest pass is built, not run: it needs the most memory.
    """

    def seconds(one_pass: OnePass) -> float:
        line, distance = one_pass.arguments["catenary"], one_pass.arguments.get("distance")
        length = distance or line.alignment().length
        return float(length) / max(speed_range(one_pass.arguments["speed_kmh"])[0], 1e-9)

    longest = max(passes, key=seconds)
    given = {name: value for name, value in longest.arguments.items() if name in RunSettings.model_fields}
    with _named(longest):
        cost = Task(run_settings(given), record_droppers=True).cost
    at_once = workers_for(len(passes), workers)
    cost._replace(memory=at_once * cost.memory).check(f"{at_once} passes at once", ", or fewer workers")


@contextmanager
def _named(one_pass: OnePass) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        at = ", ".join(f"{name} = {value:g}" for name, value in one_pass.values.items())
        raise InputError(f"At {at}: {error}") from error


def _check_name(name: str, entries: Mapping[str, Settings]) -> None:
    family = name.partition(".")[0]
    if name == SPEED or is_distance(name) or (family == POLICY and family != name):
        return
    if family in entries:
        check_name(name, entries[family])
        return
    everything = [known for owner, entry in entries.items() for known in parameter_names(entry, owner)]
    near = hint(name, [SPEED, DISTANCES, *everything])
    families = ", ".join(f"'{owner}.'" for owner in (*entries, POLICY))
    raise InputError(
        f"Unknown parameter '{name}': {near}it must be {SPEED}, {DISTANCES} or begin with one of {families} "
        "(e.g. pantograph.masses.1)."
    )


def prepare(
    values: dict[str, float],
    policy: str | Path | None,
    entries: Mapping[str, Settings],
    settings: dict[str, Any],
) -> OnePass:
    """The pass with these values. Raises InputError for a value that its schema refuses."""
    changed: dict[str, Any] = dict(entries)
    speed_kmh = settings.get(SPEED, default(SPEED))
    of_policy: list[str] = []
    for name in sorted(values, key=lambda each: FIRST.index(each) if each in FIRST else len(FIRST)):
        value, (family, _, rest) = values[name], name.partition(".")
        if name == SPEED:
            speed_kmh = value
        elif is_distance(name):
            continue
        elif family == POLICY:
            of_policy.append(f"{rest}={value!r}")
        else:
            changed[family] = change(changed[family], name, value)
            if family == "pantograph":
                changed |= changed_train(settings, name, changed[family])
    if any(map(is_distance, values)):
        changed["distances"] = placed(settings, values)
    source = None if policy is None else str(policy)
    if of_policy:
        if source is None:
            raise InputError(f"The passive pantograph has no {' or '.join(values)}; name a policy.")
        source = with_parameters(source, ",".join(of_policy))
    if source is not None:
        find_policy(source)
    label = "passive" if policy is None else str(policy)
    return OnePass(values, label, {**settings, **changed, "speed_kmh": speed_kmh, "policy": source})


def _rows(one_pass: OnePass, spans: SpanChoice) -> list[Row]:
    with _named(one_pass):
        run = simulate(**one_pass.arguments)
        train = run.train
        covered = spans if run.terminated else run.common_spans(spans) or spans
        figures = [Figures.none() if run.terminated else own.summary(covered) for own in train]
        judged = [NOT_JUDGED if run.terminated else _judged(own, covered) for own in train]
    return [
        {
            **one_pass.values,
            "policy": one_pass.policy,
            "catenary": own.catenary,
            **({NUMBER: number} if len(train) > 1 else {}),
            "pantograph": own.pantograph,
            "system": own.line.system,
            "speed_kmh": one_pass.arguments["speed_kmh"],
            "seed": own.seed,
            "time_step": own.time_step,  # as the values need, and so the next two
            "spacing": own.identity.spacing,
            "window": own.identity.window,
            "nominal_force": own.nominal_force,
            "terminated": own.terminated,
            "ending": own.ending,
            "spans": "" if own.terminated else in_words(own.spans(covered)),
            **each.as_dict(),
            **verdict,
        }
        for number, (own, each, verdict) in enumerate(zip(train, figures, judged, strict=True), start=1)
    ]


NOT_JUDGED: Row = dict.fromkeys(("dropper_force", "slack_droppers", "slack"), math.nan) | {"requirements": ""}
"""What a row has of droppers and requirements where the run ended early."""


def _judged(run: Trajectory, spans: SpanChoice) -> Row:
    criteria = {each.key: each for each in run.compliance(spans)}
    broken = [LABELS[k].short if k in LABELS else k for k, each in criteria.items() if each.kept is False]
    row: Row = {"requirements": f"broken: {', '.join(broken)}" if broken else "kept"}
    if "slack" in criteria:
        slack = ((evaluated(run, spans)[0] <= 0) & near_train(run, spans)).any(axis=0)
        row |= {"slack_droppers": int(slack.sum()), "slack": criteria["slack"].value}
        row["dropper_force"] = criteria["dropper force"].value
    return NOT_JUDGED | row
