"""Settings of a benchmark, its seeds and its controls.

Controls of a benchmark: a policy without its observations, and a record of its actions without the policy.

"blind of pd" is the policy given its first observation at every step; "tape of pd" plays back the actions
that it took on another line, drawn under another seed, and "tape of oracle" those of the stored oracle. If a
control scores as well as the policy itself, the benchmark does not need feedback.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from itertools import chain
from math import isfinite, nan
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, SerializeAsAny, field_validator, model_validator

from panto_configs import find
from panto_env.base.errors import InputError, shown
from panto_env.base.files import read_toml
from panto_env.base.settings import Positive, Settings, parse
from panto_env.control.observation import Context
from panto_env.control.settings import ControlInterval, PantographScatter, RunSettings, SpeedDrift
from panto_env.plant.line_condition import LINE_CONDITIONS
from panto_env.plant.sensors import SensorSettings, sensor_settings
from panto_env.policies import Policy, check_named, wishes

from ..line import Actuator, Condition, Distinct, LineAndTrain, Span, as_clause, distinct, of_run

Number = Annotated[
    float,
    BeforeValidator(lambda value: nan if value is None else value),
    AfterValidator(lambda value: value if isfinite(value) else nan),
]
"""A figure; nan if there is none, which is null in JSON."""


class Windows(NamedTuple):
    """Spans of a pass that are judged: first and last of each window, counted from 1."""

    early: tuple[int, int]
    late: tuple[int, int] | None = None  # after a long way


class LineAtSpeed(NamedTuple):
    """A line, the pantograph on it, its speed, and the case in which they run."""

    catenary: str
    pantograph: str
    speed_kmh: float
    case: str = ""

    @property
    def line(self) -> tuple[str, str, str]:
        """Line, pantograph and case, without the speed."""
        return self.catenary, self.pantograph, self.case

    @property
    def name(self) -> str:
        """Pantograph, line and case in words."""
        return f"{self.pantograph} on {self.catenary}{self.case and f', {self.case}'}"


class Placed:
    """What belongs to a line, a pantograph on it, a speed and a case."""

    catenary: str
    pantograph: str
    speed_kmh: float
    case: str

    @property
    def place(self) -> LineAtSpeed:
        """Line, pantograph, speed and case."""
        return LineAtSpeed(self.catenary, self.pantograph, self.speed_kmh, self.case)


TEST, SELECTION, TRAINING = range(1000), range(1000, 2000), range(2000, 1_000_000)
# Above the seeds under which the benchmark records its tapes (``OTHER_SEED``).
DATA = range(2_000_000, 3_000_000)
Purpose = Literal["test", "selection", "training", "data"]
SEEDS: dict[Purpose, range] = {"test": TEST, "selection": SELECTION, "training": TRAINING, "data": DATA}
"""Ranges of seeds by purpose, disjoint: a seed draws a line, its pantograph and all noise."""

SALTED = range(2**52, 2**53)
"""Test seeds made with a salt: so many that nobody can try them all, and each an exact number in JSON."""


def check_seeds(seeds: Iterable[int], purpose: Purpose) -> None:
    """Raise InputError for a seed that is reserved for another purpose."""
    own = SEEDS[purpose]
    for seed in seeds:
        if seed not in own:
            raise InputError(
                f"Seeds for {purpose} are {own[0]:,} to {own[-1]:,}, not {seed}: a policy must be trained, "
                "selected and judged on different seeds."
            )


def salted_seed(salt: str, number: int) -> int:
    """The test seed that a salt makes of a number.

    These are the first 8 bytes of the SHA-256 of "salt:number", modulo the size of their range.
    """
    digest = hashlib.sha256(f"{salt}:{number}".encode()).digest()
    return SALTED[int.from_bytes(digest[:8], "big") % len(SALTED)]


def salt_hash(salt: str) -> str:
    """SHA-256 of a salt, which may be published before the salt itself: `printf %s SALT | sha256sum`."""
    return hashlib.sha256(salt.encode()).hexdigest()


BLIND, TAPE = "blind of ", "tape of "
ORACLE_TAPE = TAPE + "oracle"
OTHER_SEED = 1_000_003  # added to the seed of a pass, so that a tape is recorded on a different line


def control_of(name: Any) -> str:
    """Kind of control that a policy's name stands for, BLIND or TAPE; "" for a policy itself."""
    return next((kind for kind in (BLIND, TAPE) if isinstance(name, str) and name.startswith(kind)), "")


def policy_of(name: Any) -> Any:
    """Name of the policy behind a control; the name itself if it is not a control's."""
    return name[len(control_of(name)) :] if control_of(name) else name


class Blind:
    """A policy that only ever sees the first observation of its episode."""

    def __init__(self, policy: Policy) -> None:
        """policy: the policy that gets the first observation at every step."""
        self._policy = policy
        vars(self).update(wishes(policy))

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._first: NDArray[np.float32] | None = None
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action of the policy, (actions,), for the first observation of the episode."""
        if self._first is None:
            self._first = observation.copy()
        return self._policy.act(self._first.copy())


class Tape:
    """Plays back recorded actions, (control steps, actions); zeros after the last one."""

    def __init__(self, actions: NDArray[np.float64], washout: float = 0.0) -> None:
        """actions: in the order of the control steps, each in -1..1. washout: see ``Policy``."""
        self._actions, self.washout = actions, washout

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self._step = 0

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """The next action, (actions,)."""
        step, self._step = self._step, self._step + 1
        return self._actions[step] if step < len(self._actions) else np.zeros_like(self._actions[0])


REFERENCE = "passive"  # the policy that every other one is compared with
_Sensors = SerializeAsAny[Annotated[SensorSettings, BeforeValidator(as_clause(sensor_settings))]]


class Line(LineAndTrain):
    """A train on a line, the speeds to run at, and the policies that run there only.

    Each controlled pantograph has an instance of the policy of its own; the figures are those of the one of
    them whose sigma is largest.
    """

    distance: Positive | None = Field(None, description="of a run (m); to the end of the line by default")
    spans: tuple[Span, Span] | None = Field(
        None,
        description="first and last span that the figures cover, counted from 1; by default from the "
        "tenth, where the start has died out, to the last one that every run covers completely",
    )
    policies: Distinct[str] = Field(
        (), description="policies that run on this line only, in addition to those that run on every line"
    )
    case: str = Field("", max_length=40, description="name of the case, where one line has several")
    run: dict[str, Any] = Field(
        {},
        description="settings of the runs in this case, by name, that take the place of the benchmark's, "
        'such as faults = "force-silent", or a speed_profile instead of the speeds',
    )
    sweep: dict[str, float] = Field(
        {},
        description="what the case changes and its value, such as { 'delay (ms)' = 20 }: from cases of one "
        "name a table has the value at which a policy meets the passive pantograph",
    )

    @field_validator("run")
    @classmethod
    def _of_runs(cls, value: dict[str, Any]) -> dict[str, Any]:
        given = {*LineAndTrain.model_fields, "distance", "spans", "speed_kmh", "control_interval"}
        for name in value:
            if name not in RunSettings.model_fields or name in given:
                raise ValueError(f"has {shown(name)}, which is no setting that a case may change")
        return value


def _with_reference(policies: tuple[str, ...]) -> tuple[str, ...]:
    return policies if REFERENCE in policies else (REFERENCE, *policies)


def _for_tests(seeds: tuple[int, ...]) -> tuple[int, ...]:
    check_seeds(seeds, "test")
    return seeds


class BenchmarkSettings(Settings):
    """Policies, lines with speeds, and seeds. Every policy runs on the same lines, under the same noise."""

    title: str = Field("benchmark", description="what tables and pages call it")
    policies: Annotated[Distinct[str], AfterValidator(_with_reference)] = Field(
        ("passive", "p", "pd", "fb+ff"),
        description="names, with parameters (p:gain=0.5) or without, or model files, or controls of these: "
        "'blind of pd' sees nothing, 'tape of pd' plays its actions from another line; the passive "
        "pantograph always runs",
    )
    trainings: dict[str, tuple[str, ...]] = Field(
        {},
        description="two or more policies that are trainings of one method, by the method's name; they run "
        "on every line, and the method's result is over all of them",
    )
    lines: tuple[Line, ...] = Field((Line(),), min_length=1, description="lines, with pantograph and speeds")
    seeds: Annotated[Distinct[Annotated[int, Field(ge=0)]], AfterValidator(as_clause(_for_tests))] = Field(
        tuple(range(5)),
        min_length=1,
        description="seeds, or their number, counted from 0; only those that are for tests",
    )
    salt: str | None = Field(
        None,
        min_length=1,
        max_length=200,
        description="text from which new test seeds are made, one for each of ``seeds``, so that nobody can "
        "prepare for them",
    )
    trusted: bool = Field(
        False,
        description="whether installed policies run in the process of the plant instead of apart from it; "
        "those from a file never do",
    )
    late_spans: tuple[Span, Span] | None = Field(
        None,
        description="first and last span of a second window that is judged likewise, on lines that go on so "
        "far; passes are as much longer",
    )
    by_kilometre: bool = Field(
        False, description="whether σ is compared with the passive pantograph's in each kilometre, too"
    )
    actuator: Actuator = of_run("actuator")
    sensors: _Sensors = of_run("sensors")
    line_condition: Condition = Field(
        LINE_CONDITIONS["smooth"], description="on a new line every seed gives the same run"
    )
    pantograph_scatter: PantographScatter = of_run("pantograph_scatter")
    speed_drift: SpeedDrift = of_run("speed_drift")
    control_interval: ControlInterval = of_run("control_interval")

    @property
    def drawn_seeds(self) -> tuple[int, ...]:
        """Seeds of the passes: ``seeds`` themselves, or those that the salt makes of them."""
        return self.seeds if self.salt is None else tuple(salted_seed(self.salt, seed) for seed in self.seeds)

    def policies_on(self, line: Line) -> tuple[str, ...]:
        """All policies that run on a line."""
        return tuple(dict.fromkeys(chain(self.policies, *self.trainings.values(), line.policies)))

    @field_validator("seeds", mode="before")
    @classmethod
    def _from_a_number_of_seeds(cls, value: Any) -> Any:
        if isinstance(value, int | float | str):
            if not (isinstance(value, int) and 1 <= value <= len(TEST) and not isinstance(value, bool)):
                raise ValueError(f"must be a whole number from 1 to {len(TEST):,}, or a list of seeds")
            return tuple(range(value))
        return value

    @field_validator("trainings")
    @classmethod
    def _of_several(cls, value: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        for method, trainings in value.items():
            if len(trainings) < 2:
                raise ValueError(f"{shown(method)} must have two trainings or more; a single one is a policy")
        return value

    @model_validator(mode="after")
    def _with_distinct_names(self) -> Self:
        distinct(tuple(chain(self.policies, self.trainings, *self.trainings.values())))
        # Rows and cells tell lines apart by these.
        distinct(tuple(filter(None, (line.case for line in self.lines))))
        distinct(tuple((line.catenary, line.pantograph, line.case) for line in self.lines))
        return self


def load_benchmark(path: str | Path) -> BenchmarkSettings:
    """Read a TOML file of ``BenchmarkSettings``, given by its path or by a name of ``configs/``.

    Paths in it are relative to the working folder.

    Raises InputError, naming the file and the key, where it cannot be read, is not valid, or names a policy
    whose code would run from a path.
    """
    settings = parse(BenchmarkSettings, read_toml(find(path, "benchmark")), str(path))
    for policy in chain.from_iterable(settings.policies_on(line) for line in settings.lines):
        check_named(policy_of(policy), path)
    return settings
