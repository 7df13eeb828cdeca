"""The registered ids, and the arguments that each sets."""

from __future__ import annotations

from copy import deepcopy
from typing import Annotated, Any, Literal

from gymnasium.vector import AutoresetMode
from pydantic import Field, field_validator, model_validator

from ..base.errors import InputError, shown
from ..base.settings import Between
from ..catalog import load_pantograph
from ..control.arguments import table
from ..control.entries import CENTRED
from ..control.lines import draws_line
from ..control.observation import Layout
from ..control.settings import RunSettings, default
from ..plant.actuators import actuator_settings

IDS: dict[str, dict[str, Any]] = {
    "Pantograph-v0": {
        "speed_kmh": (200.0, 350.0),
        "line_condition": "as-built",
        "pantograph_scatter": 0.05,  # own choice: spread of masses, springs and dampers by making and wear
        "run_in": 1.0,
        "settle": 6.0,  # spans in which waves build up about the train; counted, they blur the ranking
        "washout": 1.0,  # s: longer ones hold the mean less, and shift the spans' harmonics less
        "actuator": "realistic",
        "sensors": "realistic",
        "observation": "centred",
        "window": 8,  # the default at 250 km/h is 16: sigma within 2.2 % at these speeds, and twice as fast
        "reward": "benchmark",
    },
    "PantographStiffness-v0": {"catenary": "periodic-stiffness", "pantograph": "three-mass"},
    "PantographThreeSpan-v0": {"catenary": "ohl-three-span", "pantograph": "own-two-mass"},
}
"""Registered ids and the arguments that set them apart."""
BARE = {name: default(name) for name in IDS["Pantograph-v0"]}
"""Arguments that make Pantograph-v0 the papers' bare form: one speed, a line and a pantograph as designed,
ideal actuator and sensors, and a reward of CF and CL only."""


MOST_LANES = 10_000_000
"""Lanes that fit into a large machine's memory with a massless wire; with others fewer do."""
USUAL_STARTS = 1024
"""Starts of episodes that are drawn for a device, at most: drawing and running in a start takes
milliseconds.
"""
Pixels = Annotated[int, Between(64, 4096)]
SlowMotion = Field(
    1.0, description="factor by which a film of the frames is slowed down, included in `render_fps` (-)"
)


class Whole:
    """Base of an environment: to set an argument as an attribute raises InputError, and copies are deep."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name in RunSettings.model_fields:
            raise InputError(
                f"{name} can't be set later; give it to make, or to reset(options=...) for once."
            )
        super().__setattr__(name, value)

    def __copy__(self) -> Any:
        return deepcopy(self)  # two environments that share their arrays would be of no use


class EnvironmentSettings(RunSettings):
    """Arguments of ``PantographEnv``."""

    render_mode: Literal["human", "rgb_array"] | None = Field(
        None,
        description='None, "rgb_array" for frames from `render()`, or "human" for a window with each step',
    )
    render_size: tuple[Pixels, Pixels] = Field((1280, 720), description="width and height of a frame (px)")
    slow_motion: Annotated[float, Between(0.01, 1000)] = SlowMotion

    @field_validator("render_mode", mode="before")
    @classmethod
    def _known(cls, value: object) -> object:
        if value not in (None, "human", "rgb_array"):
            raise InputError(f"render_mode must be None, 'human' or 'rgb_array', not {shown(value)}.")
        return value


class VectorSettings(RunSettings):
    """Arguments of ``PantographVectorEnv``."""

    num_envs: Annotated[int, Between(1, MOST_LANES)] = Field(
        1,
        description="lanes: environments side by side; where several pantographs of a train are controlled, "
        "each is a lane, those of a train side by side",
    )
    autoreset_mode: AutoresetMode = Field(
        AutoresetMode.NEXT_STEP,
        description='when a lane whose episode has ended is reset: "NextStep", "SameStep" or "Disabled"',
    )
    lines: Annotated[int, Between(1, MOST_LANES)] | None = Field(
        None,
        description="number of lines side by side where catenary is a list, a family or a section, each with "
        "an equal share of the lanes, which is faster; by default one per lane",
    )
    episodes_per_line: Annotated[int, Between(1, 10**9)] = Field(
        1,
        description="episodes that begin in each lane, on average, before the next line is drawn where "
        "catenary is a list, a family or a section",
    )
    max_episode_steps: Annotated[int, Between(1, 10**12)] | None = Field(
        None, description="steps after which an episode is truncated; by default the line's end"
    )
    render_mode: Literal["rgb_array"] | None = Field(
        None, description='None, or "rgb_array" for frames from `render()`, one per drawn lane'
    )
    render_lanes: tuple[Annotated[int, Between(0, 10**6)], ...] | None = Field(
        None, description="numbers of the drawn lanes, by default all"
    )
    render_size: tuple[Pixels, Pixels] = Field((640, 360), description="width and height of a frame (px)")
    slow_motion: Annotated[float, Between(0.01, 1000)] = SlowMotion

    @field_validator("autoreset_mode", mode="before")
    @classmethod
    def _known(cls, value: object) -> AutoresetMode:
        try:
            return AutoresetMode(value)
        except ValueError as error:
            names = ", ".join(mode.value for mode in AutoresetMode)
            raise InputError(f"autoreset_mode must be one of {names}, not {shown(value)}.") from error

    @field_validator("render_mode", mode="before")
    @classmethod
    def _pictures(cls, value: object) -> object:
        if value not in (None, "rgb_array"):
            raise InputError(
                f"render_mode of the vector environment must be None or 'rgb_array', not {shown(value)}."
            )
        return value

    @property
    def groups(self) -> int:
        """Number of groups of lanes that share a line."""
        return 1 if not draws_line(self) else self.lines or self.trains

    @property
    def trains(self) -> int:
        """Number of trains, with a lane for each of their controlled pantographs."""
        return self.num_envs // len(self.controlled)

    @model_validator(mode="after")
    def _lanes_fit(self) -> VectorSettings:
        if self.num_envs % len(self.controlled):
            raise InputError(
                f"num_envs counts the controlled pantographs, {len(self.controlled)} in each train, so it "
                f"must be a multiple of that, not {self.num_envs}."
            )
        if self.lines is not None and self.lines > self.trains:
            raise InputError(f"{self.trains} lanes are too few for {self.lines} lines; give fewer lines.")
        beyond = [lane for lane in self.render_lanes or () if lane >= self.num_envs]
        if beyond:
            raise InputError(f"render_lanes has lane {beyond[0]}, but lanes are 0 to {self.num_envs - 1}.")
        return self


class TensorSettings(VectorSettings):
    """Arguments of ``PantographTensorEnv``."""

    device: str = Field("cuda", description='where the tensors are: "cuda", "cuda:1" and so on, or "cpu"')
    starts: Annotated[int, Between(2, MOST_LANES)] | None = Field(
        None,
        description="starts of episodes that are drawn at a reset; by default as many as lanes, 1024 at most",
    )

    figures: bool = Field(
        True,
        description="whether infos have the figures of ended episodes, which the processor works out: with "
        "many lanes it takes a good part of the time",
    )

    @model_validator(mode="after")
    def _no_pictures(self) -> TensorSettings:
        if self.render_mode is not None:
            raise InputError("On a device there are no pictures; leave out render_mode, or device.")
        return self


OF_VECTORS = TensorSettings.model_fields.keys() - EnvironmentSettings.model_fields.keys()
"""Names of arguments that only vector environments have."""


def render_metadata(metadata: dict[str, Any], settings: Any) -> dict[str, Any]:
    """An environment's metadata with its own frames per second: one per control step, in slow motion."""
    exact = 1 / settings.control_interval / settings.slow_motion
    whole = abs(exact - round(exact)) < 1e-6 * exact
    return metadata | {"render_fps": round(exact) if whole else exact}


def described(text: str) -> str:
    """A description with its tables inserted."""
    return text.format(
        in_service=_indented(_id_table("Pantograph-v0")),
        centred=_indented(_observation_table(CENTRED)),
        observation=_indented(_observation_table(default("observation"))),
        arguments=_indented(table(EnvironmentSettings)),
    )


def _observation_table(kind: str) -> str:
    actuator, pantograph = actuator_settings(default("actuator")), load_pantograph(default("pantograph"))
    settings = RunSettings.model_construct(observation=kind, actuator=actuator, pantograph=pantograph)
    rows = ["| Num | Observation | Centre | Scale |", "|-----|-------------|--------|-------|"]
    for k, each in enumerate(Layout.of(settings).entries):
        rows.append(f"| {k} | {each.name} | {each.centre:g} | {each.scale:g} {each.unit} |")
    return "\n".join(rows)


def _id_table(name: str) -> str:
    rows = [f"| `{key}` | `{value!r}` |" for key, value in IDS[name].items()]
    return "\n".join(("| Argument | Value |", "|----------|-------|", *rows))


def _indented(text: str) -> str:
    return text.replace("\n", "\n    ")
