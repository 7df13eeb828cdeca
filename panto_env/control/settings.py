"""Settings of a run, stated once: name, default, unit and help of each.

The arguments in Python, the tables of trainings and benchmarks, and the command line are all made from them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from ..base.arrays import from_kmh, to_kmh
from ..base.errors import InputError, shown, suggest
from ..base.settings import Between, parse, parse_inline, plain, sentence
from ..catalog import load_lines, load_pantograph
from ..catalog.loader import Lines
from ..estimation.model import ESTIMATORS, EstimatorSettings
from ..metrics.figures import LAST_USUAL
from ..plant.actuators import ACTUATOR_PRESETS, ActuatorSettings, actuator_settings
from ..plant.catenary import CATENARIES, CatenaryData
from ..plant.catenary.schema import check_span_count
from ..plant.line_condition import LINE_CONDITIONS, LineCondition, together
from ..plant.numerics import Numerics, Runs
from ..plant.pantograph.schema import PantographData
from ..plant.sensors import SensorSettings, sensor_settings
from ..plant.speed import DRIFT_ROWS, KNOT_ROWS, SpeedProfile, largest_drift
from ..plant.train import MOST_COLLECTORS, Train
from .entries import ESTIMATED, OBSERVATIONS
from .faults import FAULTS, Fault, faults_of
from .reward import REWARDS, CostWeights, Reward

R = TypeVar("R", bound="RunSettings")
FARTHEST = 1e9
"""Maximum distance (m), longer than any line."""
LATEST = 1.0
"""Maximum time ahead (s) of what is remembered of earlier spans."""
_Speed = Annotated[float, Field(allow_inf_nan=True)]  # the line checks which speeds are possible
# Ranges of settings that tables of benchmarks and oracles share.
PantographScatter = Annotated[float, Between(0, 0.3)]
# Own choice: a driver, or cruise control, keeps within some km/h.
SpeedDrift = Annotated[float, Between(0, 20, "km/h")]
# Published active pantographs are controlled at 50-100 Hz.
ControlInterval = Annotated[float, Between(1e-4, 10, "s")]


def _one_or_more_conditions(value: Any) -> tuple[LineCondition, ...]:
    several = value if isinstance(value, list | tuple) else [value]
    if not several:
        raise InputError("line_condition must name at least one condition.")
    return tuple(parse(LineCondition, each, "line_condition", LINE_CONDITIONS) for each in several)


def _observation(value: Any) -> str:
    if value not in OBSERVATIONS:
        raise InputError(f"observation must be one of {', '.join(OBSERVATIONS)}, not {shown(value)}.")
    return str(value)


_estimator = partial(parse, EstimatorSettings, name="estimator", presets=ESTIMATORS)


def _parsed(kind: Any, name: str, presets: Mapping[str, Any] | None = None) -> BeforeValidator:
    return BeforeValidator(lambda value: parse(kind, {} if value is None else value, name, presets or {}))


def _unless_none(read: Callable[[Any], Any]) -> BeforeValidator:
    return BeforeValidator(lambda value: None if value is None else read(value))


def _pantographs(value: Any) -> tuple[PantographData, ...]:
    several = value if isinstance(value, list | tuple) else [value]
    return tuple(load_pantograph(each) for each in several)


def _several(value: Any, kind: Any) -> list[Any] | None:
    """One number or several, of a kind, as a list; None where some are none."""
    several = list(value) if isinstance(value, list | tuple | np.ndarray) else [value]
    right = all(isinstance(each, kind) and not isinstance(each, bool) for each in several)
    return several if right else None


def _distances(value: Any) -> tuple[float, ...]:
    numbers = _several(value, int | float)
    if numbers is None or not all(0 < each <= FARTHEST for each in numbers):
        raise InputError(
            "distances must be positive numbers (m), one for each pantograph behind the first, not "
            f"{shown(value)}."
        )
    if any(after <= before for before, after in pairwise(numbers)):
        raise InputError(
            f"distances count from the first pantograph, so they must increase, as {shown(value)} do not."
        )
    return tuple(float(each) for each in numbers)


def _increasing(most: float, rule: str) -> BeforeValidator:
    """Increasing numbers from 0 to ``most``; InputError, which begins with the rule, for others."""

    def check(value: Any) -> tuple[float, ...]:
        numbers = _several(value, int | float)
        rising = numbers is not None and all(before < after for before, after in pairwise(numbers))
        if numbers is None or not rising or not all(0 <= each <= most for each in numbers):
            raise InputError(f"{rule}, not {shown(value)}.")
        return tuple(float(each) for each in numbers)

    return BeforeValidator(check)


def controlled_numbers(value: Any) -> tuple[int, ...]:
    """Numbers of the controlled pantographs, from the front. Raises InputError for anything else."""
    numbers = _several(value, int)
    if not numbers or len(set(numbers)) < len(numbers) or min(numbers) < 1:
        raise InputError(
            "controlled must name different pantographs by their numbers, 1 for the first, not "
            f"{shown(value)}."
        )
    return tuple(sorted(numbers))


def _distance(value: Any) -> float:
    if not (isinstance(value, int | float) and 0 < value <= FARTHEST):
        raise InputError(f"distance must be a positive number (m), not {shown(value)}.")
    return value


def _profile(value: Any) -> SpeedProfile:
    """Of a list of points over place, a table, or a text such as "time:0=120,30=200"."""
    if isinstance(value, str):
        over, _, points = value.partition(":")
        try:
            value = {"over": over, "points": [(float(at), own) for at, own in parse_inline(points).items()]}
        except ValueError as error:
            raise InputError(
                f"speed_profile must read such as 'place:0=120,2000=200', not {shown(value)}."
            ) from error
    return parse(
        SpeedProfile, {"points": value} if isinstance(value, list | tuple) else value, "speed_profile"
    )


def _mean_force(value: Any) -> float | str | tuple[float, ...]:
    if isinstance(value, list | tuple) and len(value):
        return tuple(_force(each) for each in value)
    return "en50367" if isinstance(value, str) and value == "en50367" else _force(value)


def _force(value: Any) -> float:
    try:
        force = float(value)
    except (TypeError, ValueError, OverflowError):
        force = math.nan
    if isinstance(value, bool) or not (math.isfinite(force) and force > 0):
        raise InputError(f"mean_force must be a positive number (N) or 'en50367', not {shown(value)}.")
    return force


def speed_range(speed_kmh: Any, name: str = "speed_kmh") -> tuple[float, float]:
    """Lowest and highest speed (km/h) of a number or a range. Raises InputError for anything else."""
    values = speed_kmh if isinstance(speed_kmh, list | tuple | np.ndarray) else (speed_kmh,) * 2
    try:
        if any(isinstance(value, str | bool) for value in values):  # float() would accept them
            raise TypeError
        low, high = (float(value) for value in values)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{name} must be a number or a range of two (km/h), not {shown(speed_kmh)}."
        ) from error
    if low > high:
        raise InputError(f"The range {name} must not fall, as {shown(speed_kmh)} does.")
    return low, high


class RunSettings(Numerics):
    """All settings of a run. ``time_step``, ``spacing``, ``window``, ``precision``: see ``Numerics``."""

    catenary: Annotated[Lines, BeforeValidator(load_lines)] = Field(
        "en50318-2002",
        validate_default=True,
        description="line: a name of the catalogue or a TOML file; from a list of lines, a family of them "
        'such as "family:high-speed" or a section such as "section:main-line", one is drawn per episode',
    )
    pantograph: Annotated[PantographData, BeforeValidator(load_pantograph)] = Field(
        "en50318-2002",
        validate_default=True,
        description="pantograph: a name of the catalogue or a TOML file",
    )
    pantographs: Annotated[tuple[PantographData, ...], BeforeValidator(_pantographs)] = Field(
        (),
        description="pantographs of a train, the first in front, instead of pantograph: up to four names of "
        "the catalogue or TOML files",
    )
    distances: Annotated[tuple[float, ...], BeforeValidator(_distances)] = Field(
        (), description="distance of each further pantograph behind the first (m)"
    )
    controlled: Annotated[tuple[int, ...], BeforeValidator(controlled_numbers)] = Field(
        1,
        validate_default=True,
        description="numbers of the pantographs that have an actuator and are controlled, 1 for the first; "
        "the others are passive",
    )
    speed_kmh: Annotated[tuple[_Speed, _Speed], BeforeValidator(speed_range)] = Field(
        300.0,
        validate_default=True,
        description="train speed (km/h): a number, or a range of two to draw from",
    )
    speed_drift: SpeedDrift = Field(
        0.0,
        description="rms of a slow drift of the speed about its mean, with periods of 7 to 29 s, drawn per "
        "run (km/h); the aerodynamic force and a required mean force that depends on the speed follow it",
    )
    speed_profile: Annotated[SpeedProfile | None, _unless_none(_profile)] = Field(
        None,
        description="speeds (km/h) that the train has one after the other, which take the place of "
        'speed_kmh: points over the place along the line (m), such as "place:0=120,2000=200", in Python '
        '[(0, 120), (2000, 200)]; or over time (s), such as "time:0=120,30=200"; in between the acceleration '
        "is constant",
    )
    actuator: Annotated[ActuatorSettings, BeforeValidator(actuator_settings)] = Field(
        "ideal",
        validate_default=True,
        description="actuator: "
        f"{', '.join(map(json.dumps, ACTUATOR_PRESETS))}, one with values such as "
        '"realistic:delay=0.01", or a table',
    )
    sensors: Annotated[SensorSettings, BeforeValidator(sensor_settings)] = Field(
        "ideal",
        validate_default=True,
        description='sensors: "ideal", "realistic", "blind", one with values such as "ideal:force_noise=5", '
        "or a table",
    )
    faults: Annotated[tuple[Fault, ...], BeforeValidator(faults_of)] = Field(
        (),
        description="faults of sensors and actuators: one or several of "
        f"{', '.join(FAULTS)}, with values such as "
        '"force-gain:value=0.8", or tables of part, kind, value, begin, lasts, every and probability',
    )
    line_condition: Annotated[tuple[LineCondition, ...], BeforeValidator(_one_or_more_conditions)] = Field(
        "new",
        validate_default=True,
        description='condition of the line: "new", "smooth", "as-built", "fair", "worn", one with values, '
        'defects and weather such as "worn:broken_droppers=[(4, 5)],wind=15,ice=0.3", or a table; from a '
        "list one is drawn per run",
    )
    mean_force: Annotated[str | float | tuple[float, ...] | None, _unless_none(_mean_force)] = Field(
        None,
        description='mean contact force (N) to be met by trimming the static force, or "en50367" for that '
        "standard's maximum; in Python a list has one for each pantograph of a train; by default as the "
        "pantograph's data say: its force applied, or met by the mean",
    )
    washout: Annotated[
        float, Between(0, 100, "s"), BeforeValidator(lambda value: 0.0 if value is None else value)
    ] = Field(
        0.0,
        description="time constant (s) of the slow average of the actuator's force that is subtracted from "
        "the action, so that it can't move the mean contact force; 0 or None: nothing is subtracted",
    )
    run_in: Annotated[float, Between(0, 20, "spans")] = Field(
        0.0,
        description="maximum number of spans without control before the episode begins; the number is drawn "
        "per run, from 0 up",
    )
    pantograph_scatter: PantographScatter = Field(
        0.0, description="rms relative difference of masses, springs and dampers, drawn per run (-)"
    )
    observation: Annotated[str, BeforeValidator(_observation)] = Field(
        "measured",
        description='what a policy sees: "measured", "full", "centred", "deviations": of readings from their '
        'slow averages, for any line; or "estimated": as measured, but with the contact force that a Kalman '
        "filter estimates from the pantograph's motion",
    )
    harmonics: Annotated[int, Between(1, 14)] = Field(
        1, description="sines and cosines of the position within the span, up to this multiple of it (-)"
    )
    history: Annotated[int, Between(0, 8)] = Field(
        0, description="earlier control steps whose readings and actions are also observed (-)"
    )
    front: Annotated[
        tuple[float, ...], _increasing(FARTHEST, "front must be increasing distances from 0 m up")
    ] = Field(
        (),
        description="distances ahead (m) at which a controlled pantograph also observes the contact force "
        "that the one in front of it measured there",
    )
    memory: Annotated[
        tuple[float, ...], _increasing(LATEST, f"memory must be increasing times from 0 to {LATEST:g} s")
    ] = Field(
        (),
        description="times (s) until places ahead; a policy also observes the contact force that its "
        "pantograph measured, and the actions, at the same share of earlier spans",
    )
    memory_spans: Annotated[int, Between(1, 3)] = Field(1, description="number of these earlier spans (-)")
    line_values: bool = Field(
        False,
        description="whether a policy also observes what the line is: span, wave speed, tensions and masses "
        "of both wires, number of droppers",
    )
    normalise: Annotated[
        tuple[_Speed, _Speed] | None, _unless_none(partial(speed_range, name="normalise"))
    ] = Field(
        None,
        description="speed or range of speeds (km/h) of passive runs, with line and pantograph as designed, "
        "by which readings are normalised to a mean near 0 and a spread near 1; by default the scales of the "
        "observation",
    )
    estimator: Annotated[EstimatorSettings, BeforeValidator(_estimator)] = Field(
        "usual",
        validate_default=True,
        description='estimator of the observation "estimated": "usual", "displacements", one with values '
        'such as "usual:suspension_drift=0", or a table',
    )
    known_pantograph: Annotated[PantographData | None, _unless_none(load_pantograph)] = Field(
        None,
        description="pantograph that estimator and policies assume: a name of the catalogue or a TOML "
        "file; by default the true one",
    )
    reward: Annotated[Reward, _parsed(Reward, "reward", REWARDS)] = Field(
        None,
        validate_default=True,
        description='weights of the reward\'s terms: "paper1", "benchmark", "agent", one with values such as '
        '"agent:rate=0.01", or a table; by default paper 1\'s',
    )
    cost: Annotated[CostWeights, _parsed(CostWeights, "cost")] = Field(
        None,
        validate_default=True,
        description='weights of the terms of `info["cost"]`, for safe learning: a table of contact_loss, '
        "uplift and max_force; by default 1 each",
    )
    settle: Annotated[float, Between(0, 20, "spans")] = Field(
        0.0,
        description="spans in which a policy acts before the reward and the figures of an episode count; the "
        "episode and the line are longer by them",
    )
    distance: Annotated[float | None, _unless_none(_distance)] = Field(
        None,
        description="distance that the last pantograph is to run (m); by default to the end of the line, "
        f"and outside an environment at least to the end of span {LAST_USUAL}; a short line gets more spans",
    )
    spans: Annotated[int | None, _unless_none(check_span_count)] = Field(
        None, description="spans of the line; by default as the catalogue has it"
    )
    control_interval: ControlInterval = Field(
        Runs().control_interval, description="time between two actions (s)"
    )
    bilateral: bool = Field(False, description="let the contact pull, as paper 3's equations do")

    @model_validator(mode="before")
    @classmethod
    def _first_of_several(cls, values: Any) -> Any:
        """The pantograph is the first of several, unless another one is given."""
        several = values.get("pantographs") if isinstance(values, dict) else None
        usual = cls.model_fields["pantograph"].default
        if several and isinstance(several, list | tuple) and values.get("pantograph", usual) == usual:
            return {**values, "pantograph": several[0]}
        return values

    @model_validator(mode="wrap")
    @classmethod
    def _as_found(cls, values: Any, handler: Callable[[Any], Self]) -> Self:
        """A line that was found to differ from its design does so in every run."""
        settings = handler(values)
        if not isinstance(settings.catenary, CatenaryData):
            return settings
        conditions = settings.on_line(settings.catenary).line_condition
        if conditions == settings.line_condition:
            return settings
        return handler({**values, "catenary": settings.catenary, "line_condition": conditions})

    def on_line(self, line: CatenaryData) -> Self:
        """These settings on another line, in the conditions in which runs on it are."""
        found, conditions = getattr(line, "as_found", None), self.line_condition
        if found is not None:
            conditions = tuple(together(found, given) for given in conditions)
        return self.model_copy(update={"catenary": line, "line_condition": conditions})

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        count = max(len(self.pantographs), 1)
        if self.pantographs and self.pantographs[0] != self.pantograph:
            raise InputError(
                f"pantograph is the first of pantographs, '{self.pantographs[0].name}', not "
                f"'{self.pantograph.name}'; give only one of the two."
            )
        if count > MOST_COLLECTORS:
            raise InputError(f"A train has up to {MOST_COLLECTORS} pantographs, not {count}.")
        if len(self.distances) != count - 1:
            raise InputError(
                f"distances must give {count - 1} numbers, one for each of the pantographs behind the first, "
                f"not {len(self.distances)}."
            )
        if self.faults and self.observation == ESTIMATED:
            raise InputError(
                "The filter of the observation 'estimated' reads the sensors before their faults; leave out "
                "faults, or take another observation."
            )
        if self.controlled[-1] > count:
            raise InputError(
                f"controlled names pantograph {self.controlled[-1]}, but the train has only {count}."
            )
        if isinstance(self.mean_force, tuple) and len(self.mean_force) != count:
            raise InputError(
                f"mean_force must be one number, or one for each of the {count} pantographs, not "
                f"{len(self.mean_force)}."
            )
        return self

    @model_validator(mode="after")
    def _mean_of_profile(self) -> Self:
        """The speed of a run with a profile is its mean."""
        if self.speed_profile is not None:
            object.__setattr__(self, "speed_kmh", (to_kmh(self.speed_profile.mean),) * 2)
        return self

    @property
    def line(self) -> CatenaryData:
        """The line. Raises InputError where one is yet to be drawn."""
        if not isinstance(self.catenary, CatenaryData):
            raise InputError(
                "One line is needed here, not a list, a family or a section to draw from; name a line."
            )
        return self.catenary

    @property
    def riding(self) -> tuple[PantographData, ...]:
        """The pantographs of the train, the first in front."""
        return self.pantographs or (self.pantograph,)

    @property
    def names(self) -> str:
        """Names of the pantographs of the train, the first in front."""
        return " and ".join(own.name for own in self.riding)

    @property
    def controlled_pantograph(self) -> PantographData:
        """The controlled pantograph, of several the first."""
        return self.riding[self.controlled[0] - 1]

    def with_pantograph(self, collector: int, pantograph: PantographData) -> Self:
        """These settings with another pantograph of a collector, counted from 0."""
        riding = [*self.riding[:collector], pantograph, *self.riding[collector + 1 :]]
        several = tuple(riding) if self.pantographs else ()
        return self.model_copy(update={"pantograph": riding[0], "pantographs": several})

    @property
    def train(self) -> Train:
        """The train."""
        return Train.of(
            *self.riding,
            actuator=self.actuator,
            sensors=self.sensors,
            distances=self.distances,
            driven=[number - 1 for number in self.controlled],
        )

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest mean speed of the train, or those of its profile (m/s)."""
        if self.speed_profile is not None:
            return self.speed_profile.range
        low, high = self.speed_kmh
        return from_kmh(low), from_kmh(high)

    @property
    def drift(self) -> float:
        """Rms of the drift of the speed about its mean (m/s)."""
        return from_kmh(self.speed_drift)

    @property
    def drift_rows(self) -> int:
        """Number of entries of a lane's drift: 0 where the speed is constant."""
        if self.speed_profile is not None:
            return DRIFT_ROWS + KNOT_ROWS * len(self.speed_profile.points)
        return DRIFT_ROWS if self.speed_drift else 0

    @property
    def runs(self) -> Runs:
        """The runs for which the plant is built."""
        (slow, quick), drift, train = self.speeds, largest_drift(self.drift), self.train
        contacts = [own.pantograph for own in train.collectors if own.pantograph.hard_contact]
        hard = max((float(own.contact_stiffness) for own in contacts), default=0.0)
        speeds = slow - drift, quick + drift
        return Runs(speeds, self.control_interval, self.line_condition, hard, train.length)

    @property
    def numerics(self) -> Numerics:
        """Settings of the discretisation."""
        return Numerics(**{name: getattr(self, name) for name in Numerics.model_fields})


def far_enough(settings: RunSettings) -> RunSettings:
    """Settings of a pass; without distance and spans it runs until its start has died out, and ten spans on.

    The line gets as many spans as necessary, and enough more that its end has no influence. One that ends
    after a sequence of spans keeps those, and the run goes to its last span.
    """
    line = settings.line
    if settings.distance is not None or settings.spans is not None or line.ends:
        return settings
    last = max(LAST_USUAL, line.spans - 1)
    distance = line.alignment(last).length
    of_first = last + math.ceil(line.alignment().in_spans(settings.train.length))
    spans = of_first + CATENARIES[line.kind].clear_spans(line, settings.numerics, settings.runs, of_first)
    return settings.model_copy(update={"distance": distance, "spans": spans})


def as_designed(settings: RunSettings, speed: float) -> RunSettings:
    """Settings of a pass at a speed (m/s) with line and pantograph as designed: nothing is random."""
    nothing_drawn = {
        "line_condition": (LineCondition(),),
        "pantograph_scatter": 0.0,
        "speed_drift": 0.0,
        "speed_profile": None,
        "faults": (),
        "run_in": 0.0,
        "distance": None,
        "spans": None,
        "speed_kmh": (to_kmh(speed), to_kmh(speed)),
    }
    return far_enough(settings.model_copy(update=nothing_drawn))


def fields(kind: type[RunSettings] = RunSettings) -> dict[str, FieldInfo]:
    """Settings by name in the order in which they are shown: those of the discretisation come last."""
    last = {name: field for name, field in kind.model_fields.items() if name in Numerics.model_fields}
    return {name: field for name, field in kind.model_fields.items() if name not in last} | last


def default(name: str) -> Any:
    """Default of a setting, in the form in which a user gives it."""
    return RunSettings.model_fields[name].default


def description(name: str) -> str:
    """Help of a setting, with its unit."""
    return RunSettings.model_fields[name].description or ""


def run_settings(given: Mapping[str, Any]) -> RunSettings:
    """Settings of a run from values by name. Raises InputError where a value is not valid."""
    return read_settings(given, RunSettings)


def read_settings(given: Mapping[str, Any], kind: type[R]) -> R:
    """As ``run_settings``, for a class with more settings than ``RunSettings``."""
    try:
        return kind.model_validate(plain(given))
    except ValidationError as error:
        raise InputError(f"{sentence(error, kind)}.") from error


def check_names(given: Mapping[str, Any], what: str) -> None:
    """Raise InputError for a name that is not a setting; what: its role for the message, e.g. "option"."""
    for name in given:
        if name not in RunSettings.model_fields:
            raise InputError(f"Unknown {what} '{name}': {suggest(str(name), list(fields()))}.")
