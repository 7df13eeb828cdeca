"""Tables of an identification, for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..base.table import Alarm, Table
from ..terminal import number
from .fit import Fit
from .model import UNITS
from .performance import Match


def parameters_table(fits: Mapping[str, Fit], band: float) -> Table:
    """What was identified, a column for each method; band: of the excitation (Hz).

    Values that no pantograph can have are marked.
    """
    names = next(iter(fits.values())).names
    rows = []
    for k, name in enumerate(names):
        cells = []
        for fit in fits.values():
            low, high = fit.interval[k]
            half = (high - low) / 2
            found = f"{fit.values[k]:.5g} ± {half:.2g}\nRSD {fit.rsd[k]:.3g} %"
            cells.append(Alarm(f"impossible: {found}") if name in fit.impossible else found)
        rows.append((f"{name} ({UNITS[name]})", *cells))
    rows.append(("condition number", *(f"{fit.condition:.5g}" for fit in fits.values())))
    title = f"Identified, ± 95 %, relative standard deviation; excitation up to {band:.4g} Hz"
    return Table(title, ("", *fits), rows)


def matches_table(matches: Sequence[Match], method: str) -> Table:
    """The model that a method identified, beside the record."""
    rows = []
    for match in matches:
        force = match.channel == "force"
        error = f"{match.mean_error:.3g} N" if force else f"{1e3 * match.mean_error:.3g} mm"
        rows.append((match.channel, match.driven_by, number(match.performance), error))
    headings = ("series", "driven by", "fitting performance (%)", "mean error")
    return Table(f"Model by {method} beside the record", headings, rows, text_columns=len(headings))
