"""What makes a design credible: other speeds and seeds, tolerances, control on and off, sensitivity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...analysis.plots import save
from ...analysis.pool import in_threads
from ...base.files import write_text
from ...base.plotting import LIMIT, series_colour, stacked
from ...base.table import Alarm, Table
from ...catalog.values import in_toml
from ...metrics.compliance import STD_OF_MEAN
from ...terminal import number
from ..permissible.scan import PASSIVE, VERIFIED_FROM
from .search import Design, Found, arguments_of, best_of, passes, tornado, worst

if TYPE_CHECKING:
    import optuna
    from matplotlib.figure import Figure

AS_BUILT = {"line_condition": "as-built", "pantograph_scatter": 0.05, "speed_drift": 0.5}
"""Tolerances of line, pantograph and speed, as in the benchmark."""
MOST_CHECKED = 5
"""Number of designs of a front that are checked, from its one end to the other."""


class Checked(NamedTuple):
    """One design under one policy; the worst of all passes."""

    design: str
    policy: str
    searched: Found  # at the speeds and seeds of the search
    held_out: Found  # at others
    as_built: Found  # at these, with tolerances
    by_speed: dict[float, float]  # largest σ/F_m at each speed, searched and held out


def check(design: Design, candidates: Mapping[str, Mapping[str, float]]) -> list[Checked]:
    """Run designs at full accuracy; candidates: values of the variables by a name, none for the start."""
    found = []
    for name, values in candidates.items():
        for policy in dict.fromkeys((PASSIVE, design.policy, *design.check_policies)):
            own = arguments_of(design, values, policy)
            own.pop("accuracy", None)
            searched, seeds = sorted(design.speeds_kmh), range(design.seeds)
            others = range(VERIFIED_FROM, VERIFIED_FROM + design.check_seeds)
            groups = (
                (searched, passes(own, searched, seeds)),
                (design.held_out, passes(own, design.held_out, others)),
                (design.held_out, passes(own | AS_BUILT, design.held_out, others)),
            )
            done = in_threads([job for _, jobs in groups for job in jobs])
            parts, first = [], 0
            for _, jobs in groups:
                parts.append(done[first : first + len(jobs)])
                first += len(jobs)
            by_speed = {
                speed: max(each.std_ratio for each in part[k * count : (k + 1) * count])
                for (speeds, _), part, count in zip(
                    groups[:2], parts[:2], (design.seeds, design.check_seeds), strict=True
                )
                for k, speed in enumerate(speeds)
            }
            some, others_too, built = (worst(part) if part else Found(math.nan, 0.0, ()) for part in parts)
            found.append(Checked(name, policy, some, others_too, built, dict(sorted(by_speed.items()))))
    return found


def candidates_of(design: Design, study: optuna.Study) -> dict[str, dict[str, float]]:
    """The start, which has the values that the line and the pantograph have, and the best or the front."""
    front = best_of(design, study)
    if len(front) > MOST_CHECKED:
        front = [front[round(k * (len(front) - 1) / (MOST_CHECKED - 1))] for k in range(MOST_CHECKED)]
    names = ["best"] if len(design.objectives) == 1 else [f"front {k + 1}" for k in range(len(front))]
    values = [dict(trial.params) for trial in front]
    return {"start": dict[str, float]()} | dict(zip(names, values, strict=True))


def checked_table(checked: Sequence[Checked]) -> Table:
    """A row for each design and policy."""
    return Table.of(
        "Largest σ/F_m of all passes and pantographs",
        checked,
        {
            "design": lambda one: one.design,
            "control": lambda one: one.policy,
            "searched": lambda one: _ratio(one.searched),
            "held out": lambda one: _ratio(one.held_out),
            "as built": lambda one: _ratio(one.as_built),
            "broken as built": lambda one: ", ".join(one.as_built.broken) or "none",
        },
        2,
    )


def _ratio(found: Found) -> str:
    words = number(found.std_ratio, 3)
    return Alarm(words) if found.broken or found.refused else words


def values_table(design: Design, candidates: Mapping[str, Mapping[str, float]]) -> Table:
    """The variables with their ranges, and their values in each design."""
    names = [name for name in candidates if candidates[name]]
    rows = [
        (name, f"{low:.6g}", f"{high:.6g}", *(f"{candidates[each][name]:.6g}" for each in names))
        for name, (low, high) in design.variables.items()
    ]
    return Table("Variables", ("variable", "from", "to", *names), rows)


def tornado_table(design: Design, values: Mapping[str, float]) -> Table:
    """The effect of each variable at the optimum."""
    rows = [(name, number(low, 3), number(high, 3)) for name, low, high in tornado(design, values)]
    rows.sort(key=lambda row: -abs(float(row[1]) - float(row[2])))
    return Table("σ/F_m with a variable moved by 5 % of its range", ("variable", "less", "more"), rows)


def plot_checked(design: Design, checked: Sequence[Checked], study: optuna.Study) -> Figure:
    """σ/F_m over speed of start and best, each under each policy; and the front, where there is one."""
    several = len(design.objectives) > 1
    figure, axes = stacked((8, 7), 2) if several else stacked((8, 4.5), 1)
    shown = [one for one in checked if one.design in ("start", "best", "front 1")]
    for k, one in enumerate(shown):
        speeds = list(one.by_speed)
        label = f"{one.design}, {one.policy}"
        axes[0].plot(speeds, list(one.by_speed.values()), color=series_colour(k), label=label)
        open_ones = [v for v in speeds if v not in design.speeds_kmh]
        axes[0].plot(
            open_ones, [one.by_speed[v] for v in open_ones], "o", color=series_colour(k), mfc="white"
        )
    axes[0].axhline(STD_OF_MEAN, color=LIMIT, linestyle=(0, (5, 3)), linewidth=0.9)
    axes[0].set(xlabel="speed (km/h); circles: held out", ylabel="σ / F_m (-)")
    axes[0].legend(fontsize="small")
    axes[0].set_ylim(bottom=0)
    if several:
        front = best_of(design, study)
        axes[1].plot(*zip(*(trial.values for trial in front), strict=True), "o-", color=series_colour(0))
        axes[1].set(xlabel=design.objectives[0], ylabel=design.objectives[1])
    for axis in axes:
        axis.grid(color="0.92")
    return figure


def write(
    design: Design,
    study: optuna.Study,
    checked: Sequence[Checked],
    candidates: Mapping[str, Mapping[str, float]],
    folder: str | Path,
) -> list[Path]:
    """Write the picture, and the line and pantograph of each design, where they are others; their paths."""
    made = [Path(folder) / "design.png"]
    save(plot_checked(design, checked, study), made[0])
    for name, values in candidates.items():
        arguments = arguments_of(design, values, design.policy)
        for part, family in (("catenary", "catenary."), ("pantograph", "pantograph.")):
            if not values or not any(key.startswith(family) for key in values):
                continue
            several = arguments.get("pantographs") if part == "pantograph" else None
            made.append(Path(folder) / f"{name.replace(' ', '-')}-{part}.toml")
            write_text(made[-1], text_of(several[0] if several else arguments[part]))
    return made


def text_of(entry: Any) -> str:
    """A line or a pantograph as the text of a TOML file, all values of which are from a search."""
    given = entry.model_dump(mode="json", exclude_none=True, exclude_unset=True)
    given = {"kind": getattr(entry, "kind", None)} | given
    plain, tables = [], []
    for key, value in given.items():
        if key in ("name", "sources", "published") or value is None:
            continue
        if isinstance(value, Mapping):
            tables += [f"\n[{key}]", *(in_toml(k, v, SOURCE) for k, v in value.items() if v is not None)]
        elif key in ("kind", "description"):
            plain.append(
                f"{key} = {in_toml('', value, '').partition('value = ')[2].rpartition(', source')[0]}"
            )
        else:
            plain.append(in_toml(key, value, SOURCE))
    return "\n".join([*plain, *tables, ""])


SOURCE = "the start of a search, or found by it (panto design)"
