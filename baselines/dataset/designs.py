"""Settings of a table of designs: a line, a pantograph, and the ranges of their parameters."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from panto_configs import find
from panto_env import simulate
from panto_env.analysis.parameters import change_together, check_name
from panto_env.analysis.sweep import SPEED
from panto_env.base.arrays import Array
from panto_env.base.checksums import write_checked
from panto_env.base.errors import AccuracyWarning, InputError
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.metrics.figures import Figures

from ..line import as_clause, of_run

SPAN_LENGTH = "catenary.span_length"
MOST = 2**20  # maximum number of designs of a table: some hours on many cores


class DesignsSettings(Settings):
    """Designs around a line and a pantograph of the catalogue."""

    title: str = Field(description="what the card calls the table")
    catenary: str = of_run("catenary")
    pantograph: str = of_run("pantograph")
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
            as_clause(partial(check_name, name))(entries[family])
        return self

    def entries(self) -> Mapping[str, Any]:
        """Line and pantograph of the catalogue that the designs vary, by family."""
        return {"catenary": load_catenary(self.catenary), "pantograph": load_pantograph(self.pantograph)}

    def label(self, name: str) -> str:
        """Description of a parameter, with its unit, from its schema."""
        if name == SPEED:
            return "speed of the train (km/h)"
        family, *keys = name.split(".")
        entry, words = self.entries()[family], list[str]()
        for key in keys:
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


DROPPERS = "catenary.droppers.positions"
FIGURES = tuple(name for name in Figures.__dataclass_fields__ if not name.startswith("effort"))
"""Figures of a run; a passive pantograph has no effort."""
OUTCOME = ("nominal_force", "wave_speed", "time_step", "spacing", *FIGURES)
"""Columns that are null if a design was refused; figures are null also if its run ended early."""


def draw(settings: DesignsSettings, first: int, last: int) -> Array:
    """Values of the designs first to last - 1, (designs, ranges), from a scrambled Sobol sequence."""
    from scipy.stats import qmc

    with warnings.catch_warnings():  # SciPy's about a count that is no power of two; the card says it
        warnings.simplefilter("ignore", UserWarning)
        sequence = qmc.Sobol(len(settings.ranges), seed=settings.seed)
        if first:  # SciPy takes no 0
            sequence.fast_forward(first)
        points = sequence.random(last - first)
    low, high = np.array(list(settings.ranges.values())).T
    return np.asarray(low + points * (high - low))


def simulate_designs(settings: DesignsSettings, first: int, last: int, path: Path) -> None:
    """Simulate the designs first to last - 1 and write their rows to a JSON file, whole or not at all."""
    values = [dict(zip(settings.ranges, each, strict=True)) for each in draw(settings, first, last).tolist()]
    rows = [design(settings, number, each) for number, each in enumerate(values, start=first)]
    write_checked(path, {"rows": rows})


def design(settings: DesignsSettings, number: int, values: dict[str, float]) -> dict[str, Any]:
    """A design's row: its values, why it was refused or ended early, warnings of inaccuracy, and figures."""
    row: dict[str, Any] = {"design": number, **values, "refused": "", "ending": "", "accuracy_warning": ""}
    row |= dict.fromkeys(OUTCOME)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AccuracyWarning)
        try:
            line, pantograph = designed(settings, values)
            run = simulate(line, pantograph, values[SPEED], record_droppers=False)
        except InputError as error:
            return row | {"refused": str(error)}
    found = dict.fromkeys(str(each.message) for each in caught if issubclass(each.category, AccuracyWarning))
    figures = {} if run.terminated else run.summary().as_dict()
    # One that the run does not have, such as uplift on a line without supports, is null.
    kept = {name: figures[name] for name in FIGURES if not np.isnan(figures.get(name, np.nan))}
    return (
        row
        | kept
        | {
            "ending": run.ending,
            "accuracy_warning": " ".join(found),
            "nominal_force": run.nominal_force,
            "wave_speed": run.line.wave_speed,
            "time_step": run.time_step,
            "spacing": run.identity.spacing,
        }
    )


def designed(settings: DesignsSettings, values: dict[str, float]) -> tuple[Settings, Settings]:
    """Line and pantograph of a design. Raises InputError for values that their schemas refuse.

    If the span length differs, droppers keep their positions relative to the span.
    """
    entries = settings.entries()
    line, pantograph = (
        {name: value for name, value in values.items() if name.startswith(f"{family}.")} for family in entries
    )
    if SPAN_LENGTH in line:
        data = entries["catenary"]
        positions = getattr(getattr(data, "droppers", None), "positions", ())
        ratio = line[SPAN_LENGTH] / data.alignment().mean_length
        line |= {f"{DROPPERS}.{k}": ratio * place for k, place in enumerate(positions, start=1)}
    return change_together(entries["catenary"], line), change_together(entries["pantograph"], pantograph)
