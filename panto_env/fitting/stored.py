"""What a fit knows, in a file: its values and how uncertain they are, singly and together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from ..base.array_file import read_arrays, write_arrays
from ..base.arrays import Array
from ..base.errors import InputError
from .doubts import doubts
from .fit import Fit
from .measured import BANDS
from .values import WAVES, Value

ARRAYS = ("difference", "covariance", "noise")


@dataclass(frozen=True, eq=False)
class Stored:
    """Values of a fit, as differences from its design, and their covariance."""

    name: str  # of its records
    line: str  # that they count from, as JSON
    pantograph: str  # likewise
    values: tuple[Value, ...]  # all of them, with places along the line (m)
    difference: Array  # (values,)
    covariance: Array  # (values, values)
    compared: tuple[float, float]  # stretch of the line that the records cover (m)
    noise: Array  # (bands,): standard deviation of what each band of the records' forces has besides (N)
    notes: tuple[str, ...]  # why it is less sure than it says


def knowledge(fit: Fit, records: str) -> Stored:
    """What a fit knows. records: their names."""
    fitting, before = fit.problem.fitting, fit.before
    design, count = fitting.values.design, len(fitting.values)
    values = tuple(along(each, before) for each in fitting.values.all)
    difference, covariance = fit.solution.state.x[:count], fit.solution.covariance[:count, :count]
    if before:
        turn = turned(values, -before)
        difference, covariance = turn @ difference, turn @ covariance @ turn.T
    begin, end = fit.problem.stretch
    return Stored(
        name=records,
        line=design.catenary.model_dump_json(),
        pantograph=design.pantograph.model_dump_json(),
        values=values,
        difference=difference,
        covariance=covariance,
        compared=(begin + before, end + before),
        noise=np.median(fit.solution.state.noise, axis=0),
        notes=tuple(f"Fit to {records}: {doubt}" for doubt in doubts(fit)),
    )


def store(known: Stored, path: str | Path) -> None:
    """Write what a fit knows, whole or not at all. Raises InputError where it cannot be written."""
    table = {
        "name": known.name,
        "line": known.line,
        "pantograph": known.pantograph,
        "values": [asdict(value) for value in known.values],
        "compared": list(known.compared),
        "notes": list(known.notes),
    }
    arrays = {name: getattr(known, name) for name in ARRAYS}
    write_arrays(path, table, {name: np.ascontiguousarray(array) for name, array in arrays.items()})


def stored(path: str | Path) -> Stored:
    """What a fit knew. Raises InputError for a file that `panto fit` did not write."""
    try:
        table, arrays = read_arrays(path)
        values = tuple(Value(**each | {"index": tuple(each["index"])}) for each in table["values"])
        found = Stored(
            name=table["name"],
            line=table["line"],
            pantograph=table["pantograph"],
            values=values,
            compared=_pair(table["compared"]),
            **{name: arrays[name] for name in ARRAYS},
            notes=tuple(table["notes"]),
        )
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} does not hold a fit; give a file that `panto fit --keep` wrote.") from error
    shapes = found.difference.shape, found.covariance.shape, found.noise.shape
    if shapes != ((len(values),), (len(values), len(values)), (BANDS,)):
        raise InputError(f"{path} does not hold a whole fit; write it anew with `panto fit --keep`.")
    return found


def along(value: Value, before: float) -> Value:
    """A value with its place on the line, of which some way lies before what was simulated (m)."""
    return value if value.place is None else replace(value, place=value.place + before)


def turned(values: Sequence[Value], further: float) -> Array:
    """Matrix, (values, values), that gives waves the phase of a place that lies further along (m).

    Waves have their phase where the simulated spans begin, in a file where the line does.
    """
    turn = np.eye(len(values))
    for k, value in enumerate(values):
        if value.kind == "unevenness" and value.index[1] == 0:  # the cosine, which its sine follows
            angle = 2 * np.pi * further / WAVES[value.index[0]][0]
            cosine, sine = np.cos(angle), np.sin(angle)
            turn[k : k + 2, k : k + 2] = [[cosine, sine], [-sine, cosine]]
    return turn


def _pair(numbers: Sequence[float]) -> tuple[float, float]:
    begin, end = numbers
    return float(begin), float(end)
