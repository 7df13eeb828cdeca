"""Settings of a table of designs: a line, a pantograph, and the ranges of their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from panto_configs import find
from panto_env.analysis.parameters import check_name
from panto_env.analysis.sweep import SPEED
from panto_env.base.errors import InputError
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control.settings import default, description

SPAN_LENGTH = "catenary.span_length"
MOST = 2**20
"""Maximum number of designs of a table: some hours on many cores."""


class DesignsSettings(Settings):
    """Designs around a line and a pantograph of the catalogue."""

    title: str = Field(description="what the card calls the table")
    catenary: str = Field(default("catenary"), description=description("catenary"))
    pantograph: str = Field(default("pantograph"), description=description("pantograph"))
    count: Annotated[int, Field(gt=0, le=MOST)] = Field(
        2**14, description="number of designs; powers of two fill the ranges evenly"
    )
    seed: Annotated[int, Field(ge=0)] = Field(
        0, description="seed of the scrambled Sobol sequence; a longer table begins like a shorter one"
    )
    ranges: dict[str, tuple[float, float]] = Field(
        min_length=1,
        description="minimum and maximum by dotted name, as in `panto sweep`, or speed_kmh",
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        for name, (low, high) in self.ranges.items():
            if not low < high:
                raise ValueError(f"the range of {name} must rise, not go from {low:g} to {high:g}")
        if SPEED not in self.ranges:
            raise ValueError(f"ranges must have {SPEED}")
        entries = self.entries()
        for name in self.ranges:
            family = name.partition(".")[0]
            if name == SPEED:
                continue
            if family not in entries:
                raise ValueError(f"{name} must be {SPEED} or begin with 'catenary.' or 'pantograph.'")
            try:
                check_name(name, entries[family])
            except InputError as error:
                raise ValueError(str(error).rstrip(".")) from error
        return self

    def entries(self) -> Mapping[str, Any]:
        """Line and pantograph of the catalogue that the designs vary, by family."""
        return {"catenary": load_catenary(self.catenary), "pantograph": load_pantograph(self.pantograph)}

    def labels(self) -> dict[str, str]:
        """Description of each parameter, with its unit."""
        entries = self.entries()
        return {
            name: "speed of the train (km/h)"
            if name == SPEED
            else _label(name, entries[name.partition(".")[0]])
            for name in self.ranges
        }


def _label(name: str, entry: Settings) -> str:
    """Description of a parameter of an entry, with its unit, from its schema."""
    words = []
    for key in name.split(".")[1:]:
        if isinstance(entry, Settings):
            words.append(type(entry).model_fields[key].description or key.replace("_", " "))
            entry = getattr(entry, key)
        else:
            words[-1] = f"place {key} of {words[-1]}"
    return ": ".join(words)


def load_designs(path: str | Path) -> DesignsSettings:
    """Read a TOML file of ``DesignsSettings``, given by its path or by a name of ``configs/``.

    Raises InputError, naming the file and the key, if it cannot be read or is not valid.
    """
    return parse(DesignsSettings, read_toml(find(path, "designs")), str(path))
