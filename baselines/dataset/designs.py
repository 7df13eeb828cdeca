"""Designs: drawn from ranges and simulated once; each gets a row, also if it was refused or ended early."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from panto_env import simulate
from panto_env.analysis.parameters import change_together
from panto_env.analysis.sweep import SPEED
from panto_env.base.arrays import Array
from panto_env.base.checksums import write_checked
from panto_env.base.errors import AccuracyWarning, InputError
from panto_env.base.settings import Settings
from panto_env.metrics.figures import Figures

from .designs_settings import SPAN_LENGTH, DesignsSettings

Row = dict[str, Any]
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
    values: Array = low + points * (high - low)
    return values


def simulate_designs(settings: DesignsSettings, first: int, last: int, path: Path) -> None:
    """Simulate the designs first to last - 1 and write their rows to a JSON file, whole or not at all."""
    values = draw(settings, first, last).tolist()
    rows = [
        design(settings, first + k, dict(zip(settings.ranges, each, strict=True)))
        for k, each in enumerate(values)
    ]
    write_checked(path, {"rows": rows})


def design(settings: DesignsSettings, number: int, values: dict[str, float]) -> Row:
    """A design's row: its values, why it was refused or ended early, warnings of inaccuracy, and figures."""
    row: Row = {"design": number, **values, "refused": "", "ending": "", "accuracy_warning": ""}
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
    outcome = {
        "ending": run.ending,
        "accuracy_warning": " ".join(found),
        "nominal_force": run.nominal_force,
        "wave_speed": run.line.wave_speed,
        "time_step": run.time_step,
        "spacing": run.settings["spacing"],
    }
    return row | outcome | {name: _number(figures[name]) for name in FIGURES if name in figures}


def _number(value: float) -> float | None:
    """A figure; None if the run does not have it, such as uplift on a line without supports."""
    return None if np.isnan(value) else value


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
