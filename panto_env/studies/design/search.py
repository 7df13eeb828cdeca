"""A search for values of a line or a pantograph that keep all requirements, best by one or two objectives.

Optuna searches: CMA-ES for one objective (Hansen and Ostermeier, Evolutionary Computation 9, 2001), NSGA-II
for two (Deb et al., IEEE Trans. Evol. Comput. 6, 2002). It keeps what was tried in a file, from which a
search that was broken off goes on.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...analysis.pool import in_threads
from ...analysis.simulation import simulate
from ...analysis.sweep import SPEED, entries_of, prepare
from ...base.errors import AccuracyWarning, InputError, UnusualWarning
from ...base.extras import require
from ...base.files import make_folder, read_toml
from ...base.settings import Positive, Settings, parse
from ...control.settings import RunSettings, run_settings
from ..permissible.scan import PASSIVE, SET, share_of

if TYPE_CHECKING:
    import optuna

Objective = Literal["std_ratio", "tension", "copper"]
FEW_SPEEDS = 5
"""Number of speeds below which a design fits them rather than the line: on benchmark-2015 others were 39 %
worse after a search with three, 8 % after one with seven."""
REFUSED = 10.0  # excess over limits of a design that cannot be
TRIED = "tried.log"  # file of all designs that were tried, in the folder of a search
POPULATION = {1: 12, 2: 40}  # designs in a generation, by the number of objectives


class Design(Settings):
    """What is searched for."""

    variables: dict[str, tuple[float, float]] = Field(
        min_length=1,
        max_length=30,
        description="ranges of values by dotted name, as `panto sweep` takes them: "
        "catenary.contact_wire.tension, catenary.droppers.spacing, pantograph.stiffness.1, policy.gain",
    )
    speeds_kmh: tuple[Positive, ...] = Field(min_length=1, description="speeds of the search (km/h)")
    held_out_kmh: tuple[Positive, ...] = Field(
        (), description="others for the check; by default those between"
    )
    policy: str = Field(PASSIVE, description="policy of the search")
    check_policies: tuple[str, ...] = Field((), description="further policies of the check")
    seeds: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(
        1, description="seeds of the search: 0, 1, ..."
    )
    check_seeds: Annotated[int, Field(ge=1, le=1000, strict=True)] = Field(
        2, description="seeds of the check at held-out speeds and as built, others than those of the search"
    )
    objectives: tuple[Objective, ...] = Field(
        ("std_ratio",),
        min_length=1,
        max_length=2,
        description="what is to be small: the largest σ/F_m of all passes and pantographs, the tension of "
        "both wires (N), or their mass (kg/m)",
    )
    designs: Annotated[int, Field(ge=1, le=100_000, strict=True)] = Field(
        400, description="number of designs that are tried"
    )
    seed: Annotated[int, Field(ge=0, le=2**31, strict=True)] = Field(0, description="seed of the search")
    run: dict[str, Any] = Field(
        description="settings of the passes as `simulate` takes them: catenary, pantograph, distances, ..."
    )

    @model_validator(mode="after")
    def _complete(self) -> Self:
        for name, (low, high) in self.variables.items():
            if name == SPEED or not low < high:
                raise ValueError(
                    f"'{name}' of variables must have a range, the smaller value first, of no speed"
                )
        if twice := [each for each in ("speed_kmh", "policy", "seed") if each in self.run]:
            raise ValueError(f"run must not have {twice[0]}; it has a key of its own")
        if unknown := sorted(self.run.keys() - RunSettings.model_fields.keys()):
            raise ValueError(f"'{unknown[0]}' of run is no setting of a run")
        return self

    @property
    def held_out(self) -> tuple[float, ...]:
        """Speeds (km/h) that the search does not see."""
        own = sorted(self.speeds_kmh)
        between = tuple(0.5 * (a + b) for a, b in pairwise(own))
        return self.held_out_kmh or between

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of the passes."""
        return {"mean_force": "en50367"} | self.run


@dataclass(frozen=True)
class Found:
    """What a design does in some passes."""

    std_ratio: float  # largest of all passes and pantographs; nan where a pass has no figures
    excess: float  # sum of how far requirements are beyond their limits, relative to these, in the worst pass
    broken: tuple[str, ...]  # names of the requirements that are broken
    refused: str = ""  # why there are no figures


def read_design(path: str | Path) -> Design:
    """What a TOML file searches for. Raises InputError, naming the file, where it is not valid."""
    try:
        design = parse(Design, read_toml(path), "the design")
        checked = run_settings(design.settings)
        middle = {name: 0.5 * (low + high) for name, (low, high) in design.variables.items()}
        policy = None if design.policy == PASSIVE else design.policy
        prepare(middle, policy, entries_of(checked), {**design.settings, "seed": 0})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if len(design.speeds_kmh) < FEW_SPEEDS:
        warnings.warn(
            f"{path}: with {len(design.speeds_kmh)} speeds a design fits these, not the line; at others it "
            "may be a third worse. Give five or more.",
            AccuracyWarning,
            stacklevel=2,
        )
    return design


def arguments_of(design: Design, values: Mapping[str, float], policy: str) -> dict[str, Any]:
    """Arguments of ``simulate`` for the design with these values, except speed and seed.

    Raises InputError for values that no line or pantograph can have.
    """
    settings = design.settings
    name = None if policy == PASSIVE else policy
    of_policy = {} if name else {key for key in values if key.startswith("policy.")}
    own = {key: value for key, value in values.items() if key not in of_policy}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualWarning)
        arguments = prepare(own, name, entries_of(run_settings(settings)), settings).arguments
    return {key: value for key, value in arguments.items() if key != SPEED}


def passes(
    arguments: Mapping[str, Any], speeds: Sequence[float], seeds: Sequence[int]
) -> list[Callable[[], Found]]:
    """Jobs: the passes of a design."""
    given = dict(arguments) | {"record_droppers": False}
    return [partial(_judged, given | {"speed_kmh": v, "seed": s}) for v in speeds for s in seeds]


def _judged(arguments: dict[str, Any]) -> Found:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            warnings.simplefilter("ignore", UnusualWarning)
            run = simulate(**arguments)
    except InputError as error:
        return Found(math.nan, REFUSED, (), str(error))
    if run.terminated:
        return Found(math.nan, REFUSED, (), run.ending)
    figures = [own.summary(run.common_spans()) for own in run.train]
    beyond = [
        one for one in run.requirements() if one.criterion.kept is False and one.criterion.key not in SET
    ]
    return Found(
        max(each.std / each.mean for each in figures),
        sum(-share_of(one, run) for one in beyond),
        tuple(one.criterion.name for one in beyond),
    )


def worst(found: Sequence[Found]) -> Found:
    """The worst of several passes, figure by figure."""
    refused = next((each.refused for each in found if each.refused), "")
    ratio = math.nan if refused else max(each.std_ratio for each in found)
    names = dict.fromkeys(name for each in found for name in each.broken)
    return Found(ratio, max(each.excess for each in found), tuple(names), refused)


def objectives_of(design: Design, arguments: Mapping[str, Any], found: Found) -> list[float]:
    """Values of the objectives, ``REFUSED`` for one that has none."""
    wires = [getattr(arguments["catenary"], name, None) for name in ("contact_wire", "messenger_wire")]
    known = {
        "std_ratio": found.std_ratio,
        "tension": sum(getattr(wire, "tension", 0.0) for wire in wires),
        "copper": sum(getattr(wire, "mass", 0.0) for wire in wires),
    }
    return [REFUSED if math.isnan(known[name]) else known[name] for name in design.objectives]


def search(
    design: Design,
    folder: str | Path,
    *,
    workers: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> optuna.Study:
    """Try designs, a generation at a time, and keep all of them in a file of ``folder``, to go on from.

    workers: threads, one per core by default; the outcome does not depend on it, unless the search was broken
    off. progress: called with the numbers of tried and of all designs, and the best so far in words. Raises
    InputError without Optuna, an extra, and where the folder has a search of something else.
    """
    require("A search", "design", "optuna", "cmaes")
    import optuna
    from optuna.storages.journal import JournalFileBackend

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    make_folder(folder)
    log = JournalFileBackend(str(Path(folder) / TRIED))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler: Any = optuna.samplers.CmaEsSampler(seed=design.seed, popsize=POPULATION[1])
        if len(design.objectives) > 1:
            sampler = optuna.samplers.NSGAIISampler(population_size=POPULATION[2], seed=design.seed)
    study = optuna.create_study(
        storage=optuna.storages.JournalStorage(log),
        sampler=sampler,
        study_name="design",
        directions=["minimize"] * len(design.objectives),
        load_if_exists=True,
    )
    same = design.model_dump(
        mode="json", exclude={"designs", "check_policies", "check_seeds", "held_out_kmh"}
    )
    if (known := study.user_attrs.get("design", same)) != same:
        changed = sorted(key for key in same if known.get(key) != same[key])
        raise InputError(f"{folder} has a search with other {' and '.join(changed)}; choose another folder.")
    study.set_user_attr("design", same)
    ranges: dict[str, Any] = {
        name: optuna.distributions.FloatDistribution(low, high)
        for name, (low, high) in design.variables.items()
    }
    several, complete = len(design.objectives) > 1, (optuna.trial.TrialState.COMPLETE,)
    while (done := len(study.get_trials(deepcopy=False, states=complete))) < design.designs:
        count = min(POPULATION[len(design.objectives)], design.designs - done)
        trials = [study.ask(ranges) for _ in range(count)]
        outcomes = tried(design, [trial.params for trial in trials], workers)
        for trial, (values, found) in zip(trials, outcomes, strict=True):
            if several:  # CMA-ES takes no constraints, but a penalty, below
                trial.set_constraint("excess", found.excess)
            trial.set_user_attr("excess", found.excess)
            trial.set_user_attr("std_ratio", found.std_ratio if not math.isnan(found.std_ratio) else None)
            trial.set_user_attr("refused", found.refused)
            penalty = 0.0 if several else REFUSED * found.excess
            study.tell(trial, [value + penalty for value in values])
        if progress is not None:
            progress(done + len(trials), design.designs, in_words(design, study))
    return study


def tried(
    design: Design, candidates: Sequence[Mapping[str, float]], workers: int | None = None
) -> list[tuple[list[float], Found]]:
    """Objectives and figures of designs under the search's policy, at its speeds and seeds."""
    jobs: list[Callable[[], Found]] = []
    parts: list[tuple[dict[str, Any], slice] | str] = []
    for values in candidates:
        try:
            arguments = arguments_of(design, values, design.policy)
        except InputError as error:
            parts.append(str(error))
            continue
        own = passes(arguments, design.speeds_kmh, range(design.seeds))
        parts.append((arguments, slice(len(jobs), len(jobs) + len(own))))
        jobs += own
    done = in_threads(jobs, workers=workers) if jobs else []
    found: list[tuple[list[float], Found]] = []
    for part in parts:
        if isinstance(part, str):
            found.append(([REFUSED] * len(design.objectives), Found(math.nan, REFUSED, (), part)))
        else:
            own_worst = worst(done[part[1]])
            found.append((objectives_of(design, part[0], own_worst), own_worst))
    return found


def best_of(design: Design, study: optuna.Study) -> list[Any]:
    """The best trial, or the front of two objectives, of those that keep all requirements, if any does."""
    done = [trial for trial in study.get_trials(deepcopy=False) if trial.values is not None]
    if all(trial.user_attrs["excess"] > 0 for trial in done):
        return [min(done, key=lambda trial: trial.user_attrs["excess"])]
    if len(design.objectives) == 1:
        return [study.best_trial]
    return sorted(study.best_trials, key=lambda trial: trial.values[0])


def in_words(design: Design, study: optuna.Study) -> str:
    """The best so far."""
    best = best_of(design, study)
    if len(best) > 1:
        return f"front of {len(best)} designs"
    excess = best[0].user_attrs["excess"]
    value = best[0].values[0] - (REFUSED * excess if len(design.objectives) == 1 else 0.0)
    kept = "requirements broken" if excess else "all requirements kept"
    return f"best {design.objectives[0]} {value:.4g}, {kept}"


def tornado(
    design: Design, values: Mapping[str, float], share: float = 0.05
) -> list[tuple[str, float, float]]:
    """For each variable the largest σ/F_m with it smaller and larger by a share of its range."""
    moved = []
    for name, (low, high) in design.variables.items():
        for sign in (-1, 1):
            there = float(np.clip(values[name] + sign * share * (high - low), low, high))
            moved.append(dict(values) | {name: there})
    ratios = [found.std_ratio for _, found in tried(design, moved)]
    return list(zip(design.variables, ratios[::2], ratios[1::2], strict=True))
