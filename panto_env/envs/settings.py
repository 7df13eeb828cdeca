"""What the environments can be told beside the settings of a run."""

from __future__ import annotations

from typing import Literal

from gymnasium.vector import AutoresetMode
from pydantic import Field, field_validator

from ..base.errors import InputError
from ..control.settings import RunSettings


class EnvironmentSettings(RunSettings):
    """Arguments of ``PantographEnv``."""

    render_mode: Literal["rgb_array"] | None = Field(
        None, description='None, or "rgb_array" for pictures from `render()`'
    )

    @field_validator("render_mode", mode="before")
    @classmethod
    def _known(cls, value: object) -> object:
        if value not in (None, "rgb_array"):
            raise InputError(f"render_mode must be None or 'rgb_array', not {value!r}.")
        return value


class VectorSettings(RunSettings):
    """Arguments of ``PantographVectorEnv``."""

    num_envs: int = Field(1, description="lanes: environments side by side")
    autoreset_mode: AutoresetMode = Field(
        AutoresetMode.NEXT_STEP,
        description='when a lane whose episode has ended begins anew: "NextStep", "SameStep" or "Disabled"',
    )
    max_episode_steps: int | None = Field(
        None, ge=1, description="steps after which an episode is truncated; by default the line's end"
    )
    render_mode: None = Field(None, description="None: the vector environment does not render")

    @field_validator("autoreset_mode", mode="before")
    @classmethod
    def _known(cls, value: object) -> AutoresetMode:
        try:
            return AutoresetMode(value)
        except ValueError as error:
            names = ", ".join(mode.value for mode in AutoresetMode)
            raise InputError(f"autoreset_mode must be one of {names}, not {value!r}.") from error

    @field_validator("render_mode", mode="before")
    @classmethod
    def _no_picture(cls, value: object) -> None:
        if value is not None:
            raise InputError("The vector environment does not render; leave render_mode at None.")
