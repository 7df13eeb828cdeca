"""How a model's displacements match the recorded ones (paper 1, Eqs 9 and 10): tables, pictures, a file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.files import check_output, write_text
from ..base.plotting import BLUE, ORANGE, stacked
from ..base.settings import ranges_of
from ..base.table import Alarm, Table, number
from ..catalog.values import in_toml
from ..plant.pantograph.schema import PantographData
from .model import HEAD, PLATE, SUPPORT, UNITS, Fit, Parameters, matrices
from .record import Record
from .response import contact_force, fitted_response, force_matrices

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Match:
    """One displacement of the model beside the recorded one."""

    channel: str
    driven_by: str  # "force" or "plate"
    recorded: Array  # (n,): m, or N for the force
    modelled: Array  # (n,): likewise

    def as_dict(self) -> dict[str, str | float]:
        """What was compared and how well it matches, without the series."""
        names = ("channel", "driven_by", "performance", "mean_error", "squared_error")
        return {name: getattr(self, name) for name in names}

    @property
    def performance(self) -> float:
        """Fitting performance P_f (%), Eq. 9."""
        spread = np.linalg.norm(self.recorded - self.recorded.mean())
        return float(100 * (1 - np.linalg.norm(self.modelled - self.recorded) / spread))

    @property
    def mean_error(self) -> float:
        """Mean of the absolute error, our reading of Table 5's mean error (m or N)."""
        return float(np.abs(self.modelled - self.recorded).mean())

    @property
    def squared_error(self) -> float:
        """Sum of squared errors, Eq. 10 (m^2 or N^2)."""
        return float(np.sum((self.modelled - self.recorded) ** 2))


def matches(record: Record, parameters: Parameters) -> list[Match]:
    """The model driven by the recorded plate and, where it was recorded, by the contact force.

    The paper validates by the force. The state at the first sample, which nobody measures, is the one
    that matches best. Raises InputError where the model is not stable.
    """
    step = record.time_step
    recorded = np.column_stack([record.head, record.support])
    states = fitted_response(*matrices(parameters), record.plate, step, [HEAD, SUPPORT], recorded)
    under_plate = [
        Match("y_p2", "plate", record.head, states[:, HEAD]),
        Match("y_p3", "plate", record.support, states[:, SUPPORT]),
    ]
    if record.force is None:
        return under_plate
    force = contact_force(parameters, record.plate, states, step)
    under_plate.append(Match("force", "plate", record.force, force))
    return under_plate + (force_matches(record, parameters) if parameters["c1T"] > 0 else [])


def force_matches(record: Record, parameters: Parameters) -> list[Match]:
    """y_p1, y_p2 and y_p3 of the model driven by the recorded contact force, as in paper 1's Table 5.

    Raises InputError where no force was recorded, c1T is not above 0, or the model is not stable.
    """
    if record.force is None:
        raise InputError("The record has no contact force to drive the model with.")
    recorded = np.column_stack([record.head, record.support, record.plate])
    a, b = force_matrices(parameters)
    states = fitted_response(a, b, record.force, record.time_step, [HEAD, SUPPORT, PLATE], recorded)
    return [
        Match("y_p1", "force", record.plate, states[:, PLATE]),
        Match("y_p2", "force", record.head, states[:, HEAD]),
        Match("y_p3", "force", record.support, states[:, SUPPORT]),
    ]


def parameters_table(fits: Mapping[str, Fit], band: float) -> Table:
    """What was identified, a column for each method; band: of the excitation (Hz).

    Values that no pantograph can have are marked.
    """

    def cell(fit: Fit, k: int, name: str) -> str:
        low, high = fit.interval[k]
        found = f"{fit.values[k]:.5g} ± {(high - low) / 2:.2g}\nRSD {fit.rsd[k]:.3g} %"
        return Alarm(f"impossible: {found}") if name in fit.impossible else found

    names = next(iter(fits.values())).names
    rows = [
        (f"{name} ({UNITS[name]})", *(cell(fit, k, name) for fit in fits.values()))
        for k, name in enumerate(names)
    ]
    rows.append(("condition number", *(f"{fit.condition:.5g}" for fit in fits.values())))
    title = f"Identified, ± 95 %, relative standard deviation; excitation up to {band:.4g} Hz"
    return Table(title, ("", *fits), rows)


def matches_table(matches: Sequence[Match], method: str) -> Table:
    """The model that a method identified, beside the record."""

    def error(match: Match) -> str:
        _, unit, scale = _axis_of(match.channel)
        return f"{scale * match.mean_error:.3g} {unit}"

    columns = {
        "series": lambda match: match.channel,
        "driven by": lambda match: match.driven_by,
        "fitting performance (%)": lambda match: number(match.performance),
        "mean error": error,
    }
    return Table.of(f"Model by {method} beside the record", matches, columns, text_columns=4)


EXPLAINS = 50.0
"""Fitting performance (%) of a displacement from which a model explains it."""
(_FORCE,) = set(ranges_of(PantographData.model_fields["static_force"].rebuild_annotation()))
MOST_FORCE = _FORCE.high
"""Maximum lifting force (N) of a pantograph."""
SUFFIXES = (".toml",)


def check_possible(fit: Fit) -> None:
    """Raise InputError for parameters that no pantograph can have."""
    p = fit.parameters
    if fit.impossible:
        shown = ", ".join(f"{name} = {p[name]:.4g} {UNITS[name]}" for name in fit.impossible)
        raise InputError(
            f"The {fit.method} found {shown}: no pantograph has that, so none is written; take a record that "
            "determines it, another --method, or give its value with --measured."
        )


def write_pantograph(
    fit: Fit,
    path: str | Path,
    *,
    matches: Sequence[Match],
    record: str,
    static_force: float,
    force_source: str,
) -> None:
    """Write what ``panto simulate --pantograph`` takes, whole or not at all.

    matches: of the model beside the record. record: its name, for the sources. static_force: lifting force
    (N), and where it is from.
    Raises InputError for a file that is not .toml, for parameters that no pantograph can have, and for a
    model that does not explain the motion that it was identified from.
    """
    check_output(path, SUFFIXES)
    check_possible(fit)
    for match in matches:
        if match.driven_by == "plate" and match.channel != "force" and not match.performance >= EXPLAINS:
            raise InputError(
                f"The model by {fit.method} does not explain the motion of {match.channel} (fitting "
                f"performance {match.performance:.3g} %, {EXPLAINS:g} % is required), so none is written; "
                "check units and signs, or take a record with more motion, another --method, or known values "
                "by --measured."
            )
    if not 0 <= static_force <= MOST_FORCE:
        raise InputError(
            f"The static force must be a number from 0 to {MOST_FORCE:g} N, not {static_force:g}; give it "
            "with --static-force."
        )

    p = fit.parameters
    rsd = dict(zip(fit.names, fit.rsd, strict=True))

    def source(*names: str) -> str:
        return "; ".join(
            f"{name} identified from {record} (RSD {rsd[name]:.3g} %)" if name in rsd else f"{name} measured"
            for name in names
        )

    description = f"Identified from {record} by {fit.method}; two masses, no aerodynamic uplift."
    lines = [
        'kind = "pantograph"',
        f"description = {json.dumps(description, ensure_ascii=False)}",
        in_toml("masses", [p["m2"], p["m3"]], source("m2", "m3")),
        in_toml("stiffnesses", [p["k2"], p["k3"]], source("k2", "k3")),
        in_toml("dampings", [p["c2"], p["c3"]], source("c2", "c3")),
        in_toml("static_force", static_force, force_source),
        in_toml("aerodynamic_coefficient", 0.0, "own choice: a rig in a laboratory has no wind"),
        in_toml("contact_stiffness", p["k1T"], source("k1T")),
        in_toml("contact_damping", p["c1T"], source("c1T")),
    ]
    write_text(path, "\n".join(lines) + "\n")


SHOWN = 2000
"""Points drawn of a series at most: more cannot be seen and make files large."""


def plot_record(record: Record, title: str, seconds: float) -> Figure:
    """Contact force and displacements over the first ``seconds``, as paper 1's Figs 6 to 8."""
    series = record.displacements if record.force is None else {"force": record.force} | record.displacements
    figure, axes = stacked((7, 6.2), len(series))
    for axis, (name, values) in zip(axes, series.items(), strict=True):
        lines = [(values, BLUE, 1.0)]
        _draw(axis, record.time, lines, name, record.start, record.start + seconds)
    axes[-1].set(xlabel="time (s)")
    figure.suptitle(title)
    return figure


def plot_matches(time: Array, matches: Sequence[Match], title: str, first: float, last: float) -> Figure:
    """Recorded and modelled series over ``first`` to ``last`` (s), as paper 1's Figs 9 to 11."""
    figure, axes = stacked((6.5, 0.8 + 1.5 * len(matches)), len(matches))
    for axis, match in zip(axes, matches, strict=True):
        lines = [(match.recorded, ORANGE, 3.0), (match.modelled, "black", 0.8)]
        _draw(axis, time, lines, match.channel, first, last)
        _, unit, scale = _axis_of(match.channel)
        axis.set_title(
            f"driven by the {match.driven_by}: fitting performance {match.performance:.1f} %, "
            f"mean error {scale * match.mean_error:.3g} {unit}",
            loc="right",
            fontsize="small",
        )
    figure.legend(axes[0].lines, ("record", "model"), loc="outside lower center", ncols=2, fontsize="small")
    axes[-1].set(xlabel="time (s)")
    figure.suptitle(title, fontsize="medium")
    return figure


def _draw(
    axis: Axes, time: Array, lines: list[tuple[Array, str, float]], channel: str, first: float, last: float
) -> None:
    """Draw series of a channel, (n,) in SI units, with colours and widths, over ``first`` to ``last`` (s)."""
    inside = (time >= first) & (time <= last)
    step = max(1, int(inside.sum()) // SHOWN)
    symbol, unit, scale = _axis_of(channel)
    for values, colour, width in lines:
        axis.plot(time[inside][::step], scale * values[inside][::step], color=colour, linewidth=width)
    axis.set(ylabel=f"${symbol}$ ({unit})", xlim=(first, last))
    axis.grid(color="0.9")


def _axis_of(channel: str) -> tuple[str, str, float]:
    """Symbol and unit of a record's channel, and the scale from SI to this unit."""
    if channel == "force":
        return "f_1", "N", 1.0
    return f"y_{{{channel.removeprefix('y_')}}}", "mm", 1e3
