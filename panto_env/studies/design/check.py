"""What makes a design credible: other speeds and seeds, tolerances, control on and off, sensitivity.

And how much tension, or how many droppers, control replaces on a line as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...analysis.plots import save
from ...analysis.pool import in_threads
from ...base.errors import InputError
from ...base.files import write_text
from ...base.plotting import LIMIT, series_colour, stacked
from ...base.table import Alarm, Table, number
from ...catalog import load_catenary
from ...catalog.values import in_toml
from ...metrics.compliance import STD_OF_MEAN
from ...plant.catenary.flexible import FlexibleCatenaryData
from ..permissible.scan import PASSIVE, VERIFIED_FROM
from ..study import Columns, tabled
from .search import Design, Found, arguments_of, best_of, passes, tornado, worst

if TYPE_CHECKING:
    import optuna
    from matplotlib.figure import Figure

AS_BUILT = {"line_condition": "as-built", "pantograph_scatter": 0.05, "speed_drift": 0.5}
"""Tolerances of line, pantograph and speed, as in the benchmark."""
MOST_CHECKED = 5  # number of designs of a front that are checked, from its one end to the other


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
            others = _other_seeds(design)
            groups = (
                passes(own, searched, seeds),
                passes(own, design.held_out, others),
                passes(own | AS_BUILT, design.held_out, others),
            )
            done = iter(in_threads([job for jobs in groups for job in jobs]))
            parts = [list(islice(done, len(jobs))) for jobs in groups]
            by_speed = {
                speed: max(each.std_ratio for each in part[k * count : (k + 1) * count])
                for speeds, part, count in (
                    (searched, parts[0], design.seeds),
                    (design.held_out, parts[1], design.check_seeds),
                )
                for k, speed in enumerate(speeds)
            }
            some, unseen, built = (worst(part) if part else Found(math.nan, 0.0, ()) for part in parts)
            found.append(Checked(name, policy, some, unseen, built, dict(sorted(by_speed.items()))))
    return found


def _other_seeds(design: Design) -> range:
    return range(VERIFIED_FROM, VERIFIED_FROM + design.check_seeds)


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

    def ratio(found: Found) -> str:
        words = number(found.std_ratio, 3)
        return Alarm(words) if found.broken or found.refused else words

    columns: Columns = (
        ("design", "{.design}"),
        ("control", "{.policy}"),
        ("searched", lambda one: ratio(one.searched)),
        ("held out", lambda one: ratio(one.held_out)),
        ("as built", lambda one: ratio(one.as_built)),
        ("broken as built", lambda one: ", ".join(one.as_built.broken) or "none"),
    )
    return tabled("Largest σ/F_m of all passes and pantographs", columns, checked, 2)


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
    moved = sorted(tornado(design, values), key=lambda row: -np.nan_to_num(abs(row[1] - row[2]), nan=np.inf))
    rows = [(name, number(low, 3), number(high, 3)) for name, low, high in moved]
    return Table("σ/F_m with a variable moved by 5 % of its range", ("variable", "less", "more"), rows)


def plot_checked(design: Design, checked: Sequence[Checked], study: optuna.Study) -> Figure:
    """σ/F_m over speed of start and best, each under each policy; and the front, where there is one."""
    several = len(design.objectives) > 1
    figure, axes = stacked((8, 7), 2) if several else stacked((8, 4.5), 1)
    shown = [one for one in checked if one.design in ("start", "best", "front 1")]
    for k, one in enumerate(shown):
        style: dict[str, Any] = {"color": series_colour(k)}
        label = f"{one.design}, {one.policy}"
        axes[0].plot(list(one.by_speed), list(one.by_speed.values()), label=label, **style)
        held = {v: ratio for v, ratio in one.by_speed.items() if v not in design.speeds_kmh}
        axes[0].plot(list(held), list(held.values()), "o", mfc="white", **style)
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
        for part in ("catenary", "pantograph"):
            if any(key.startswith(f"{part}.") for key in values):
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
            words = in_toml("", value, "").partition("value = ")[2].rpartition(", source")[0]
            plain.append(f"{key} = {words}")
        else:
            plain.append(in_toml(key, value, SOURCE))
    return "\n".join([*plain, *tables, ""])


SOURCE = "the start of a search, or found by it (panto design)"


CONTACT, MESSENGER = "catenary.contact_wire.tension", "catenary.messenger_wire.tension"
SPACING = "catenary.droppers.spacing"
SHARES = tuple(1.0 - 0.05 * k for k in range(1, 11))  # shares of a tension that are tried, one after another


class Step(NamedTuple):
    """A line with less of something, under control."""

    value: float  # of the parameter
    droppers: int  # in a span
    std_ratio: float  # largest σ/F_m of all passes and pantographs; nan where the line is refused
    more_broken: tuple[str, ...]  # requirements broken in a pass in which the line as it is keeps them

    @property
    def keeps(self) -> bool:
        """Whether it keeps what the line as it is keeps without control."""
        return not self.more_broken and not math.isnan(self.std_ratio)


class Replaced(NamedTuple):
    """How far a parameter may go under control until it is worse than the line as it is without."""

    parameter: str
    policy: str
    limit: float  # largest σ/F_m of the line as it is, without control
    steps: tuple[Step, ...]  # the first one is the line as it is, under control; the last one fails in both

    @property
    def equal_std(self) -> Step | None:
        """The last of the steps up to which σ/F_m is no larger; None where control alone makes it larger."""
        return self._last([step.std_ratio <= self.limit for step in self.steps])

    @property
    def equal_requirements(self) -> Step | None:
        """The last of the steps up to which no more requirements are broken in any pass."""
        return self._last([step.keeps for step in self.steps])

    def _last(self, kept: Sequence[bool]) -> Step | None:
        first = kept.index(False) if False in kept else len(kept)
        return self.steps[first - 1] if first else None


def replaced(design: Design, policy: str) -> list[Replaced]:
    """Tension of either wire, and droppers, that a policy replaces on the line of a search, as built.

    All passes are at the speeds of the search, under seeds of the check. A line without these parts is
    refused with InputError.
    """
    line = _line(design)
    droppers, tensions = line.droppers.positions, (line.contact_wire.tension, line.messenger_wire.tension)
    room = line.span_length - 2 * min(droppers[0], line.span_length / 4)
    values = {
        name: [tension, *(share * tension for share in SHARES)]
        for name, tension in zip((CONTACT, MESSENGER), tensions, strict=True)
    }
    values[SPACING] = [room / gaps for gaps in range(len(droppers) - 1, 0, -1)]
    start = _passes(design, {}, PASSIVE)
    limit = worst(start).std_ratio
    as_it_is = _step(0.0, len(droppers), start, _passes(design, {}, policy))
    found = []
    for name, (own, *lower) in values.items():
        steps = [as_it_is._replace(value=own)]
        for value in lower:
            if not (steps[-1].keeps or steps[-1].std_ratio <= limit):
                break
            try:
                under_control = _passes(design, {name: value}, policy)
                count = len(_line(design, {name: value}).droppers.positions)
            except InputError:  # it cannot hang so
                break
            steps.append(_step(value, count, start, under_control))
        found.append(Replaced(name, policy, limit, tuple(steps)))
    return found


def _line(design: Design, values: dict[str, float] | None = None) -> FlexibleCatenaryData:
    line = load_catenary(design.settings["catenary"])
    if values:
        line = arguments_of(design, values, PASSIVE)["catenary"]
    if not isinstance(line, FlexibleCatenaryData):
        raise InputError("Only a line of wires and droppers has tension and droppers to replace.")
    return line


def _passes(design: Design, values: dict[str, float], policy: str) -> list[Found]:
    arguments = arguments_of(design, values, policy) | AS_BUILT
    return in_threads(passes(arguments, sorted(design.speeds_kmh), _other_seeds(design)))


def _step(value: float, droppers: int, start: Sequence[Found], found: Sequence[Found]) -> Step:
    pairs = zip(start, found, strict=True)
    more = {name for own, other in pairs for name in set(other.broken) - set(own.broken)}
    return Step(value, droppers, worst(found).std_ratio, tuple(sorted(more)))
