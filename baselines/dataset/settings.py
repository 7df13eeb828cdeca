"""Settings of data sets of episodes: policies, places and counts, from a TOML file."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Field, model_validator

from panto_configs import find
from panto_env.base.errors import InputError
from panto_env.base.files import read_toml
from panto_env.base.settings import Between, NonNegative, Settings, parse
from panto_env.control.settings import description
from panto_env.policies import check_named

from ..benchmark.settings import DATA
from ..line import Distinct, distinct

ENVIRONMENT = "Pantograph-v0"  # id of the environment that episodes are recorded in
NAMESPACE = "pantograph"  # first part of the ids of all data sets
_Name = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*[a-z0-9]$")]
_Speed = Annotated[float, Between(1, 600, "km/h")]


class EpisodePlace(Settings):
    """A pantograph on a line, and the range that episodes draw their speed from."""

    catenary: str = Field(description=description("catenary"))
    pantograph: str = Field(description=description("pantograph"))
    speed_kmh: tuple[_Speed, _Speed] = Field(description="minimum and maximum speed (km/h)")

    def options(self) -> dict[str, Any]:
        """Options of ``reset`` for an episode at this place."""
        return self.model_dump(mode="json")


class PolicySet(Settings):
    """One data set: episodes of each policy, with each noise, at each place."""

    name: _Name = Field(description="last part of its id, before the version: small letters, digits and '-'")
    policies: Distinct[str] = Field(min_length=1, description="names, or model files, as the benchmark's")
    noise: Distinct[NonNegative] = Field(
        (0.0,), min_length=1, description="rms of the noise added to each action, drawn at each step (-)"
    )
    episodes: Annotated[int, Field(gt=0)] = Field(
        description="number of episodes for each policy, noise and place"
    )
    description: str = Field("", description="purpose of the set, in a sentence or two")


class Plan(NamedTuple):
    """One episode to record."""

    number: int  # within its data set, from 0
    policy: str
    noise: float  # rms of the noise added to actions (-)
    place: int  # index of the place
    seed: int


class EpisodesSettings(Settings):
    """Data sets recorded at the same places."""

    title: _Name = Field(description="middle part of the ids: small letters, digits and '-'")
    version: Annotated[int, Field(ge=0)] = Field(0, description="last part of the ids")
    author: str = Field("The panto-env authors", description="author of the data sets")
    seed: Annotated[int, Field(ge=0)] = Field(
        0, description="first seed of each set, counted within the range of seeds for data"
    )
    environment: dict[str, Any] = Field(
        default_factory=dict, description=f"arguments of {ENVIRONMENT} that differ from its defaults"
    )
    places: tuple[EpisodePlace, ...] = Field(min_length=1, description="lines, with pantograph and speeds")
    sets: tuple[PolicySet, ...] = Field(min_length=1, description="data sets")

    @model_validator(mode="after")
    def _possible(self) -> Self:
        distinct(tuple(each.name for each in self.sets))
        distinct(tuple((each.catenary, each.pantograph) for each in self.places))
        for key in EpisodePlace.model_fields:
            if key in self.environment:
                raise ValueError(f"{key} belongs into places, not into environment")
        most = max(self.count(each) for each in self.sets)
        if self.seed + most > len(DATA):
            raise ValueError(
                f"a set has {most:,} episodes from seed {self.seed:,} on, of {len(DATA):,} seeds"
            )
        return self

    def dataset_id(self, policy_set: PolicySet) -> str:
        """Minari's id of a data set."""
        return f"{NAMESPACE}/{self.title}/{policy_set.name}-v{self.version}"

    def count(self, policy_set: PolicySet) -> int:
        """Number of episodes of a data set."""
        return len(self.places) * len(policy_set.policies) * len(policy_set.noise) * policy_set.episodes

    def plans(self, policy_set: PolicySet) -> Iterator[Plan]:
        """Episodes of a data set in order: places, policies and noises alternate, each episode with its own
        seed; sets of the same number of episodes have the same seeds.
        """
        kinds = list(product(range(len(self.places)), policy_set.policies, policy_set.noise))
        for number in range(self.count(policy_set)):
            place, policy, noise = kinds[number % len(kinds)]
            yield Plan(number, policy, noise, place, DATA[self.seed + number])

    def arguments(self) -> dict[str, Any]:
        """Arguments of the environment at the first place; the other places are options of ``reset``."""
        return self.environment | self.places[0].options()

    def options(self, plan: Plan) -> dict[str, Any]:
        """Options of ``reset`` for an episode: none at the first place."""
        return self.places[plan.place].options() if plan.place else {}


def load_episodes(path: str | Path) -> EpisodesSettings:
    """Read a TOML file of ``EpisodesSettings``, given by its path or by a name of ``configs/``.

    Raises InputError, naming the file and the key, if it cannot be read, is not valid, or names a policy
    whose code would run from a path.
    """
    settings = parse(EpisodesSettings, read_toml(find(path, "dataset")), str(path))
    for each in settings.sets:
        for policy in each.policies:
            check_named(policy, path)
    return settings


def chosen(settings: EpisodesSettings, names: tuple[str, ...]) -> EpisodesSettings:
    """Settings with only the named sets. Raises InputError for a name that no set has."""
    known = {each.name: each for each in settings.sets}
    for name in names:
        if name not in known:
            raise InputError(f"There is no set '{name}' in this file; its sets are {', '.join(known)}.")
    return settings.model_copy(update={"sets": tuple(known[name] for name in dict.fromkeys(names))})
