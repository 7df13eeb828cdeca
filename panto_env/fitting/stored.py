"""What a fit knows, in a file: where it was broken off, or its end with its covariance and doubts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from ..base.arrays import Array
from ..base.checksums import checksum, read_arrays, write_arrays
from ..base.errors import InputError
from ..base.settings import Settings
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.schema import CLEAR
from ..records.record import Record
from .fit import WHITE, Fit
from .misfit import OWN, State
from .passes import BANDS
from .values import WAVES, Place, Value

GOES_ON = (
    "The fitted line goes on as it is; in the real one, an anchor or overlap up to "
    f"{CLEAR} spans ahead of a train sends waves back, which look like defects."
)
"""What is said of a line without ends: no record tells what lies ahead of it."""
STRANGE = 0.3
"""Residual over the force, by standard deviation, from which on the fit is called wrong. Own choice."""


def doubts(fit: Fit) -> list[str]:
    """Sentences on what makes the values of a fit, or their intervals, wrong or less reliable."""
    found = [*fit.problem.of_records, *fit.problem.notes]
    pairs = zip(fit.parts, fit.std, strict=True)
    if strange := [part.name for part, (before, after) in pairs if after > STRANGE * before]:
        found.append(
            f"The fit explains little of {', '.join(strange)}: it may be of another line or pantograph, or "
            "its positions may be wrong by half a span or more; the values mean nothing then."
        )
    tests = zip(fit.parts, fit.whiteness, strict=True)
    if unlike := [part.name for part, white in tests if white.probability < WHITE]:
        found.append(
            f"What is left of {', '.join(unlike)} is not like noise: the model lacks something there, and "
            "intervals may be too narrow."
        )
    if fit.moved:
        design = fit.problem.values.design
        names = [design.layout.alignment.span_name(span + design.first_span) for span in fit.moved]
        found.append(
            f"More is left than noise in span{'s' if len(names) > 1 else ''} {', '.join(names)}: the model "
            "lacks something there, and intervals are wider by what it moves."
        )
    if not fit.solution.converged:
        found.append("The fit has not settled; intervals are not to be relied on.")
    return found


STATE = ("x", "static_forces", "noise")
"""Arrays of a state."""
SUFFIX = ".fit"
"""Of the file, behind the name of the output."""


def identity_of(records: Sequence[Record], settings: dict[str, Any]) -> dict[str, Any]:
    """What a fit is of: checksum of the records' samples and of settings, which are plain data."""
    pieces = [piece for record in records for piece in record.pieces]
    names = ("position", "force")
    arrays = {f"{name} {k}": getattr(each, name) for k, each in enumerate(pieces) for name in names}
    return {"checksum": checksum(settings | {"own": list(OWN)}, arrays)}


def keep(path: Path, state: State, identity: dict[str, Any]) -> None:
    """Write where a fit is. Raises InputError where that cannot be written."""
    arrays = {name: np.ascontiguousarray(getattr(state, name)) for name in STATE}
    write_arrays(path, identity | {"steps": state.steps}, arrays)


def kept(path: Path, identity: dict[str, Any]) -> State | None:
    """Where the same fit was broken off; None where no file, or another fit's, is there."""
    try:
        table, arrays = read_arrays(path)
    except (OSError, ValueError):
        return None
    steps = table.pop("steps", None)
    if table != identity or set(arrays) != set(STATE) or not isinstance(steps, int):
        return None
    return State(**arrays, steps=steps)


ARRAYS = ("difference", "covariance", "noise")


class _Table(Settings):
    name: str
    line: str
    pantograph: str
    values: tuple[Value, ...] = Field(min_length=1)
    compared: tuple[Place, Place]
    notes: tuple[str, ...]


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

    @property
    def design(self) -> FlexibleCatenaryData:
        """The line that its values count from. Raises ValidationError for one of another version."""
        return FlexibleCatenaryData.model_validate_json(self.line)


def knowledge(fit: Fit, records: str) -> Stored:
    """What a fit knows. records: their names."""
    fitting, before = fit.problem, fit.problem.before
    design, count = fitting.values.design, len(fitting.values)
    values = tuple(
        value if value.place is None else replace(value, place=value.place + before)
        for value in fitting.values.all
    )
    known = fit.solution.state.x[:count], fit.covariance[:count, :count]
    difference, covariance = turned(values, -before, *known)
    begin, end = fitting.stretch
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
    table = {name: getattr(known, name) for name in ("name", "line", "pantograph")}
    table["values"] = [asdict(value) for value in known.values]
    table |= {"compared": list(known.compared), "notes": list(known.notes)}
    write_arrays(path, table, {name: np.ascontiguousarray(getattr(known, name)) for name in ARRAYS})


def stored(path: str | Path) -> Stored:
    """What a fit knew. Raises InputError for a file that `panto fit` did not write."""
    try:
        given, arrays = read_arrays(path)
        table = _Table.model_validate(given)
        _check(table.values, arrays)
        found: dict[str, Any] = dict(table) | {name: arrays[name] for name in ARRAYS}
        return Stored(**found)
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except ValueError as error:  # pydantic's among them
        reason = str(error)
        if isinstance(error, ValidationError):
            first = error.errors()[0]
            reason = f"key '{'.'.join(map(str, first['loc']))}': {first['msg']}"
        raise InputError(
            f"{path} does not hold a whole fit: {reason}; give a file that `panto fit --keep` wrote."
        ) from error


def _check(values: Sequence[Value], arrays: dict[str, NDArray[Any]]) -> None:
    count, tolerances = len(values), np.array([value.tolerance for value in values])
    if len({value.name for value in values}) < count:
        raise ValueError("two values have one name")
    for name, shape in zip(ARRAYS, ((count,), (count, count), (BANDS,)), strict=True):
        array = arrays.get(name, np.empty(()))
        if array.shape != shape or array.dtype != np.float64 or not np.isfinite(array).all():
            raise ValueError(f"its {name} is not an array of finite numbers of shape {shape}")
    if (np.abs(arrays["difference"]) > 1e3 * tolerances).any() or (arrays["noise"] < 0).any():
        raise ValueError("a difference is beyond all tolerances, or a noise is negative")
    relative = arrays["covariance"] / np.outer(tolerances, tolerances)  # without records, the unit matrix
    usable = np.abs(relative).max() < 2 and np.allclose(relative, relative.T, rtol=0.0, atol=1e-6)
    if not (usable and (sizes := np.linalg.eigvalsh(relative))[0] > 1e-14 and sizes[-1] < 1.001):
        raise ValueError("its covariance is not symmetric and positive, or wider than its tolerances")


def turned(values: Sequence[Value], further: float, x: Array, covariance: Array) -> tuple[Array, Array]:
    """Values, (values,), and covariance, with waves that have the phase of a place further along (m).

    Waves have their phase where the simulated spans begin, in a file where the line does.
    """
    if not further:
        return x, covariance
    turn = np.eye(len(values))
    for k, value in enumerate(values):
        if value.kind == "unevenness" and value.index[1] == 0:  # the cosine, which its sine follows
            angle = 2 * np.pi * further / WAVES[value.index[0]][0]
            cosine, sine = np.cos(angle), np.sin(angle)
            turn[k : k + 2, k : k + 2] = [[cosine, sine], [-sine, cosine]]
    return turn @ x, turn @ covariance @ turn.T
