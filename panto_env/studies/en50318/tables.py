"""Tables of the validation, for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...base.table import Alarm, Table
from ...metrics.figures import LABELS
from ...terminal import number
from . import conditions, convergence, kinds, lines, reference, start, wear, window

Row = tuple[str, ...]
ERRORS = ("std", "max", "min", "contact_loss")
ERROR_HEADINGS = (
    f"{LABELS['std'].short}\n(%)",
    *(f"{LABELS[name].short}\n(% of {LABELS['mean'].short})" for name in ("max", "min")),
    f"{LABELS['contact_loss'].short}\n(points)",
)
"""Of errors: of sigma, of maximum and minimum, of contact loss."""


def checks_table(checks: Sequence[reference.Check]) -> Table:
    """The standard's table."""
    headings = ["figure"]
    for speed in reference.SPEEDS_KMH:
        headings += [f"{speed:g} km/h", "accepted"]
    rows: list[Row] = []
    for name in reference.ACCEPTED:
        cells = [LABELS[name].heading]
        for check in (check for check in checks if check.figure == name):
            value = number(check.value, 2)
            low, high = number(check.lowest, 0), number(check.highest, 0)
            cells += [
                value if check.inside else Alarm(f"{value} outside"),
                low if low == high else f"{low} to {high}",
            ]
        rows.append(tuple(cells))
    title = "EN 50318:2002 reference model, spans 5 and 6, low-passed at 20 Hz"
    return Table(title, tuple(headings), rows)


def kinds_table(checks: Sequence[kinds.KindCheck]) -> Table:
    """Figures of lines of several kinds."""
    rows = [
        (
            *(check.line_kind, check.catenary, check.pantograph, f"{check.speed_kmh:g}"),
            *(number(value, 1) for value in (check.mean, check.std, check.max, check.min)),
            number(1e3 * check.max_uplift, 1),
            number(check.contact_loss, 2),
        )
        for check in checks
    ]
    return Table(
        "Lines of the kinds that EN 50318:2018 asks for; its own lines, and DC ones, were in no source",
        (
            *("kind", "line", "pantograph", "km/h"),
            *(LABELS[name].column for name in ("mean", "std", "max", "min")),
            "uplift (mm)",
            LABELS["contact_loss"].column,
        ),
        rows,
        text_columns=3,
        section_ends=tuple(k for k, row in enumerate(rows[1:]) if row[0] != rows[k][0]),
    )


def convergence_table(runs: Sequence[dict[str, Any]]) -> Table:
    """Figures of the reference model over grid, time step, window and precision."""
    rows: list[Row] = []
    section_ends = []
    for speed in convergence.SPEEDS_KMH:
        at_speed = [row for row in runs if row["speed_kmh"] == speed]
        converged = at_speed[0]["std"]
        for row in at_speed:
            discretisation = (
                f"{row['spacing']:.3g}",
                f"{1e3 * row['time_step']:.3g}",
                str(row["window"] or "all"),
                row["precision"],
            )
            change = 100 * (row["std"] / converged - 1)
            figures = (row["mean"], row["std"], change, row["max"], row["min"], _scaled(row, "max_uplift"))
            rows.append((f"{speed:g}", *discretisation, *(number(value, 2) for value in figures)))
        section_ends.append(len(rows) - 1)
    headings = (
        *("km/h", "grid\n(m)", "step\n(ms)", "window\n(spans)", "precision"),
        *(LABELS[name].column for name in ("mean", "std")),
        _in_percent("std"),
        *(LABELS[name].column for name in ("max", "min", "max_uplift")),
    )
    title = "Convergence; σ relative to the first row of its speed"
    return Table(title, headings, rows, text_columns=0, section_ends=tuple(section_ends))


def windows_table(checks: Sequence[window.WindowCheck]) -> Table:
    """Travelling windows beside the whole line: the largest changes over all lines at each speed."""
    rows, section_ends = [], []
    for speed in dict.fromkeys(check.speed_kmh for check in checks):
        at_speed = [check for check in checks if check.speed_kmh == speed]
        for asked in dict.fromkeys(check.asked for check in at_speed):
            those = [check for check in at_speed if check.asked == asked]
            used = sorted({check.window for check in those})
            shown = str(asked) if asked else f"default: {' or '.join(map(str, used))}"
            worst = max(those, key=lambda check: abs(check.std)).catenary
            changes = (f"{_largest(those, name):.2f}" for name in ("std", "max", "min", "uplift"))
            rows.append(
                (worst, f"{speed:g}", str(len(those)), shown, *changes, number(_largest(those, "rms")))
            )
        section_ends.append(len(rows) - 1)
    first, last = window.COMPARED
    share = f"(% of {LABELS['mean'].short})"
    return Table(
        f"Travelling windows beside whole lines, spans {first} to {last}: largest changes over the flexible "
        "lines of the catalogue",
        (
            *("worst line\nfor σ", "km/h", "lines", "window\n(spans)", _in_percent("std")),
            *(f"{LABELS[name].short}\n{share}" for name in ("max", "min")),
            _in_percent("max_uplift"),
            "force, rms\ndifference (N)",
        ),
        rows,
        section_ends=tuple(section_ends),
    )


def wear_table(checks: Sequence[wear.WearCheck]) -> Table:
    """Figures on worn lines over grid and time step."""
    rows = []
    for check in checks:
        numerics = (
            f"{check.wavelength:g}",
            f"{1e3 * check.depth:g}",
            f"{check.spacing:.3g}",
            f"{1e3 * check.time_step:.3g}",
            f"{check.steps:.1f}",
        )
        forces = (_spread(values, 1) for values in (check.std, check.max, check.min, check.raw_max))
        rows.append((*numerics, *forces, _spread(check.contact_loss, 2)))
    first, last = wear.SPANS
    return Table(
        f"Worn line of EN 50318:2002 at {wear.SPEED_KMH:g} km/h, spans {first} to {last}; "
        f"mean ± standard deviation over {wear.SEEDS} seeds",
        (
            *("wave\n(m)", "depth\n(mm)", "grid\n(m)", "step\n(ms)", "steps\nper wave"),
            *(LABELS[name].column for name in ("std", "max", "min")),
            f"raw {LABELS['max'].column}",
            LABELS["contact_loss"].column,
        ),
        rows,
        text_columns=0,
    )


def conditions_table(checks: Sequence[conditions.ConditionCheck]) -> Table:
    """Figures on lines in each named condition."""
    rows = []
    for check in checks:
        forces = (_spread(values, 1) for values in (check.std, check.max, check.min, check.raw_max))
        case = (check.catenary, check.pantograph, f"{check.speed_kmh:g}", check.condition)
        std, *others = forces
        changes = f"{check.change:+.1f}", f"{check.worse} of {check.seeds}"
        rows.append((*case, std, *changes, *others, _spread(check.contact_loss, 2)))
    ends = (
        k
        for k in range(len(checks))
        if k + 1 == len(checks) or checks[k + 1].speed_kmh != checks[k].speed_kmh
    )
    return Table(
        f"Passive runs in each condition; mean ± standard deviation over {conditions.SEEDS} seeds",
        (
            *("line", "pantograph", "km/h", "condition"),
            *(LABELS["std"].column, "σ from\nnew (%)", "worse\nthan new"),
            *(LABELS[name].column for name in ("max", "min")),
            f"raw {LABELS['max'].column}",
            LABELS["contact_loss"].column,
        ),
        rows,
        text_columns=4,
        section_ends=tuple(ends),
    )


def lines_table(checks: Sequence[lines.LineCheck]) -> Table:
    """Every line at every speed beside converged figures."""
    rows: list[Row] = []
    section_ends = []
    for k, check in enumerate(checks):
        accuracy = f"{check.accuracy}, warned" if check.warned else check.accuracy
        used = (f"{check.spacing:.3g}", f"{1e3 * check.time_step:.3g}")
        figures = ["ended early", *("" for _ in ERRORS)]
        if check.converged is not None:
            figures = [number(check.converged, 2), *(f"{getattr(check, name):+.2f}" for name in ERRORS)]
        rows.append((check.catenary, f"{check.speed_kmh:.0f}", accuracy, *used, *figures))
        if k + 1 == len(checks) or checks[k + 1].catenary != check.catenary:
            section_ends.append(k)
    first, last = lines.SPANS
    return Table(
        f"Every flexible line beside a grid of {lines.GRID:g} m and a step of at most "
        f"{1e3 * lines.LONGEST_STEP:g} ms, spans {first} to {last}",
        (
            *("line", "km/h", "accuracy", "grid\n(m)", "step\n(ms)"),
            f"converged\n{LABELS['std'].column}",
            *ERROR_HEADINGS,
        ),
        rows,
        section_ends=tuple(section_ends),
    )


def largest_table(checks: Sequence[lines.LineCheck]) -> Table:
    """The largest change of each figure, by kind of line, accuracy and warning, and by speed."""
    rows: list[Row] = []
    section_ends = []
    for drawn, accuracy in dict.fromkeys((check.drawn, check.accuracy) for check in checks):
        group = [check for check in checks if (check.drawn, check.accuracy) == (drawn, accuracy)]
        complete = [check for check in group if check.std is not None]
        for warned in (False, True):
            those = [check for check in complete if check.warned == warned]
            if those:
                rows.append(
                    (
                        "drawn" if drawn else "catalogue",
                        accuracy,
                        "yes" if warned else "no",
                        str(len(those)),
                        str(len(group) - len(complete)),
                        *(f"{_largest(those, name):.2f}" for name in ERRORS),
                    )
                )
        section_ends.append(len(rows) - 1)
    return Table(
        "Largest errors",
        (
            *("lines", "accuracy", "warned", "runs", "ended\nearly"),
            *ERROR_HEADINGS,
        ),
        rows,
        text_columns=2,
        section_ends=tuple(section_ends),
    )


def start_table(checks: Sequence[start.StartCheck]) -> Table:
    """What the start does to σ, by the first span evaluated."""
    rows = []
    for speed in dict.fromkeys(check.speed_kmh for check in checks):
        at_speed = [check for check in checks if check.speed_kmh == speed]
        errors = (f"{check.rms:.1f} ({check.worst:.1f})" for check in at_speed)
        rows.append((f"{speed:g}", str(at_speed[0].lines), *errors))
    first, last = start.SETTLED
    spans = (f"{check.first}-{check.last}" for check in checks[: len(start.FIRST_SPANS)])
    return Table(
        f"Error of σ over these spans beside spans {first} to {last} (%): rms over the lines (worst)",
        ("km/h", "lines", *spans),
        rows,
        text_columns=0,
    )


def _scaled(row: dict[str, Any], name: str) -> float:
    """A figure in its label's unit."""
    value: float = LABELS[name].scale * row[name]
    return value


def _largest(checks: Sequence[Any], name: str) -> float:
    return float(max(abs(getattr(check, name)) for check in checks))


def _in_percent(name: str) -> str:
    return f"{LABELS[name].short}\n(%)"


def _spread(values: wear.Spread, digits: int) -> str:
    mean, deviation = values
    return f"{mean:.{digits}f} ± {deviation:.{digits}f}"
