"""Gains of policies as `panto tune` stores them: one file per policy, one table per line and pantograph."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from panto_configs import FOLDER
from panto_env.base.arrays import to_kmh
from panto_env.base.checksums import remembered
from panto_env.base.errors import InputError, shown
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse
from panto_env.catalog.drawn_lines import DRAWN
from panto_env.catalog.loader import is_entry
from panto_env.control.observation import Context
from panto_env.plant.catenary.schema import CatenaryData
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.state import Place

Source = str | Sequence[float]
GAINS_FOLDER = FOLDER / "policies"
MANY_LINES = tuple(f"{kind}:" for kind in DRAWN)  # how the names begin of what lines are drawn from
REACH = 12.5  # gains are used up to this far (km/h) beyond the tuned speeds: half a usual step


class Tuning(Settings):
    """Gains for one line and pantograph over speed, and how they were made."""

    catenary: str
    pantograph: str
    catenary_sha256: str | None = Field(None, description="of its values, unless it is the catalogue's")
    pantograph_sha256: str | None = Field(None, description="likewise")
    place: str = Field(description="where the actuator acts: frame, head or both")
    names: tuple[str, ...] = Field(description="of the gains")
    speeds_kmh: tuple[float, ...] = Field(min_length=1, description="rising (km/h)")
    gains: tuple[tuple[float, ...], ...] = Field(description="at each speed")
    command: str
    version: str
    actuator: dict[str, Any]
    sensors: dict[str, Any]
    line_condition: str
    washout: float = Field(0.0, description="time constant of the action's washout, 0 for none (s)")
    seeds: tuple[int, ...] = Field(description="of the training's lines and noise")
    passes: int = Field(description="simulated passes that the tuning took")
    std_change: tuple[float, ...] = Field(
        description="relative change of sigma from passive on selection seeds, by speed (-)"
    )
    mean_change: tuple[float, ...] = Field(description="relative change of the mean force, likewise (-)")

    @model_validator(mode="after")
    def _fit(self) -> Self:
        if len(self.gains) != len(self.speeds_kmh) or any(len(row) != len(self.names) for row in self.gains):
            raise ValueError("gains must have a row for each speed and a number for each name")
        if list(self.speeds_kmh) != sorted(set(self.speeds_kmh)):
            raise ValueError("speeds_kmh must rise")
        return self

    def is_for(self, catenary: CatenaryData | None, pantograph: PantographData, place: str) -> bool:
        """Whether it was made for this line and pantograph, by their values, and place of the actuator.

        Without a line: whether it was made on many lines, drawn from a family or a section.
        """
        if place != self.place or not is_entry(pantograph, self.pantograph, self.pantograph_sha256):
            return False
        if catenary is None:
            return self.catenary.startswith(MANY_LINES)
        return is_entry(catenary, self.catenary, self.catenary_sha256)


class GainFile(Settings):
    """A file of gains."""

    policy: str
    tunings: tuple[Tuning, ...] = ()


def gain_file(source: str | Path) -> Path:
    """Path of a file of gains, given by its path or by the name of one that comes with the project."""
    path = Path(source)
    return path if path.suffix == ".toml" else GAINS_FOLDER / f"{source}.toml"


def load_gains(path: Path) -> GainFile:
    """Read a file of gains. Raises InputError, naming the file, where it cannot be read or is not valid."""
    if not os.path.isfile(path):
        raise InputError(
            f"There is no file of gains {path}; make it with `panto tune`, or give the parameter gains."
        )
    return _load(path, path.stat().st_mtime_ns)


def find_gains(source: Source, names: Sequence[str], context: Context) -> NDArray[np.float64]:
    """Gains for an episode, (gains,): the given ones, or stored ones, interpolated linearly over speed.

    Stored ones are found by the values of line and pantograph, whatever their names; those that were made on
    many lines, drawn from a family, are for any line that has none of its own. Those that were made with the
    episode's washout come first; those made with another one are not taken. Raises InputError if
    there are none for them, for the place of the actuator, and for the speed.
    """
    if not isinstance(source, str):
        if len(source) != len(names):
            raise InputError(f"There must be {len(names)} gains ({', '.join(names)}), not {len(source)}.")
        return np.array(source, dtype=float)
    path, line, pantograph = gain_file(source), context.catenary, context.pantograph
    place = "both" if len(context.channels) > 1 else Place(context.channels[0]).name.lower()
    tunings = load_gains(path).tunings
    able = [each for each in tunings if each.washout in (0.0, context.washout)]
    able.sort(key=lambda each: each.washout != context.washout)
    own = [each for where in (line, None) for each in able if each.is_for(where, pantograph, place)]
    if own:
        return _at_speed(own[0], names, to_kmh(context.speed), path)
    but, case = "", (line.name, pantograph.name, place)
    if case in ((each.catenary, each.pantograph, each.place) for each in tunings):
        but = ", only for others of these names with other values"
    for each in tunings:
        if each not in able and each.is_for(line, pantograph, place):
            but = f", only for a washout of {each.washout:g} s, which the policy must then have"
    raise InputError(
        f"{path.name} has no gains for the pantograph '{pantograph.name}' on the line '{line.name}' with an "
        f"actuator at {place}{but}: make them with `panto tune`, give them ({', '.join(names[:4])}"
        f"{', ...' if len(names) > 4 else ''}) as the parameter gains, or take a policy that needs none."
    )


def _at_speed(tuning: Tuning, names: Sequence[str], speed_kmh: float, path: Path) -> NDArray[np.float64]:
    low, high = tuning.speeds_kmh[0], tuning.speeds_kmh[-1]
    if not low - REACH <= speed_kmh <= high + REACH:
        raise InputError(
            f"{path.name} has gains for '{tuning.catenary}' from {low:g} to {high:g} km/h, "
            f"not for {speed_kmh:g} km/h; tune it there."
        )
    if tuning.names != tuple(names):
        raise InputError(f"The gains in {path.name} are not those of this policy; tune it again.")
    return np.array([np.interp(speed_kmh, tuning.speeds_kmh, column) for column in np.array(tuning.gains).T])


@remembered
def _load(path: Path, _modified: int) -> GainFile:
    return parse(GainFile, read_toml(path), str(path))


Array = NDArray[np.float64]
Observations = NDArray[np.float32]


class LanesLaw(ABC):
    """A controller that returns one force (N) per lane, positive upwards; a single run is a batch of one.

    All lanes are on the same line at the same speed. The force acts on the articulated frame; with actuators
    on frame and head, that on the head stays at 0; with an actuator on the head only, the same law drives
    that one, between head and the mass below it.
    """

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes."""
        self.context, self.lanes = context, lanes
        self._places = {entry.name: place for place, entry in enumerate(context.layout.entries)}

    def reset(self, context: Context) -> None:
        """Prepare for an episode."""
        self.begin(context, 1)

    def act(self, observation: Observations) -> Array:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        action = np.zeros(self.context.actions)
        action[0] = min(max(float(self.forces(observation[None])[0]) / self.context.force_limit, -1.0), 1.0)
        return action

    @abstractmethod
    def forces(self, observations: Observations) -> Array:
        """Force (N) of each lane, (lanes,), before the limit, for observations, (lanes, entries)."""

    def read(self, observations: Observations, name: str) -> Array:
        """Physical values of an entry, (lanes,). Raises InputError if no entry has this name."""
        layout = self.context.layout
        place = self._places.get(name)
        if place is None or layout.entries[place].slope:  # another kind, normalised, or an error
            return np.array([layout.read(each, name) for each in observations])
        entry = layout.entries[place]
        return entry.centre + observations[:, place].astype(float) * entry.scale

    def span_angle(self, observations: Observations, lead: float = 0.0) -> Array:
        """Angle of the place within the span, (lanes,), rad, 0 at a support; lead: time ahead (s).

        Raises InputError if the observation does not hold it: both sine and cosine are 0.
        """
        sine = self.read(observations, "sine of span position")
        cosine = self.read(observations, "cosine of span position")
        if (sine**2 + cosine**2 < 0.5).any():
            raise InputError(
                "It needs the place within the span, which these sensors do not measure; take skyhook, "
                "h-infinity, or repetitive:place='counted'."
            )
        ahead = 2 * np.pi * lead * self.read(observations, "speed") / self.context.alignment.mean_length
        return np.asarray(np.arctan2(sine, cosine) + ahead)


class Gain(NamedTuple):
    """A number that `panto tune` fits."""

    step: float  # change by which its effect is measured: small, and about that of other gains' steps
    first: float = 0.0  # value from which the fit starts


class TunableLaw(LanesLaw):
    """A law with a vector of gains, either given or read from a file for line, pantograph and speed."""

    TUNED: ClassVar[Mapping[str, Gain]]
    """The gains by name, in order."""

    def __init__(self, gains: Source) -> None:
        """gains: the numbers, or the name or path of a file that `panto tune` wrote, read at each start."""
        if not isinstance(gains, str) and not (
            len(gains) and all(isinstance(each, int | float) and np.isfinite(each) for each in gains)
        ):
            raise ValueError(
                f"gains must be finite numbers or the name of a file of gains, not {shown(gains)}"
            )
        self._source = gains

    def begin(self, context: Context, lanes: int) -> None:
        """Prepare for episodes in this number of lanes. Raises InputError if there are no gains for them."""
        super().begin(context, lanes)
        self.gains = find_gains(self._source, list(self.TUNED), context)


class FromAverage:
    """Deviations of readings from their slow averages, which start at the first readings."""

    def __init__(self, interval: float, averaged: float) -> None:
        """interval: between readings (s); averaged: time constant of the averages (s)."""
        self._share = 1 - np.exp(-interval / averaged)
        self._average: Array | None = None

    def __call__(self, readings: Array) -> Array:
        """Deviations of readings, (..., lanes); the averages are updated."""
        if self._average is None:
            self._average = readings.copy()
        self._average += self._share * (readings - self._average)
        return readings - self._average
