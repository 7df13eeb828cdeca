"""What a policy makes worse than the passive pantograph, pass by pass, and which harm takes its rank away.

An interquartile mean leaves out the worst quarter of the passes, and a window of ten spans what comes after
it. A railway asks for both: each pass is compared with the passive one on the same line under the same seed,
in each window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from panto_env.base.arrays import Array
from panto_env.base.errors import beside

from .settings import Number
from .single_pass import Row

WORSE = {"sigma": 1.0, "loss": 0.0, "minimum": 1.0, "uplift": 1.0}
"""By how much a pass must be worse than the passive one to count: σ in %, CL in points, N, mm."""
MOST_WORSE = 10.0  # change of σ (%) above which no pass of a ranked policy may be, in any window
MOST_GROWN = 10.0
"""Points (%) by which the interquartile mean of the change of σ may be larger in the late window.

With 16 seeds its standard error is two points, with 4 seeds four.
"""


def window_changes(rows: Sequence[Row]) -> Array:
    """Relative changes of σ from the passive pantograph at the same mean, (windows, rows).

    nan where no passive pantograph has this mean.
    """
    return relative(
        [[each.figures.std for each in row.windows] for row in rows],
        [[each.pressed_std for each in row.windows] for row in rows],
    ).T


def relative(values: Sequence[Sequence[float]], to: Sequence[Sequence[float]]) -> Array:
    """Relative changes, of the shape of both."""
    with np.errstate(divide="ignore", invalid="ignore"):  # a sigma of 0 has no relative change
        return np.asarray(np.asarray(values) / np.asarray(to) - 1)


@dataclass(frozen=True)
class Harm:
    """In how many passes a policy is worse than the passive pantograph in any window, and by how much.

    σ is compared with a passive pantograph at the same mean force, the other figures with the unchanged one.
    Of several controlled pantographs the one with the largest σ is compared, with that of the passive run.
    """

    passes: int
    sigma: int  # passes with a σ more than 1 % above
    loss: int  # with more contact loss
    lost: int  # that lose contact in a window where the passive pantograph keeps it
    minimum: int  # with a minimum more than 1 N below
    uplift: int  # with an uplift more than 1 mm above
    worst: Number  # maximum change of σ of any pass (%)
    worst_at: str  # its seed and window
    lowest_minimum: Number  # maximum (N) by which a minimum lies below the passive one; negative: all above
    most_uplift: Number  # maximum (m) by which an uplift lies above the passive one; negative: all lie below

    @classmethod
    def over(cls, parts: Sequence[tuple[str, Harm]]) -> Self:
        """Harm over several cells, each with the name of its place."""
        each = [harm for _, harm in parts]
        place, worst = max(parts, key=lambda part: last_if_nan(part[1].worst))
        counts = ("passes", "sigma", "loss", "lost", "minimum", "uplift")
        return cls(
            **{name: sum(getattr(harm, name) for harm in each) for name in counts},
            worst=worst.worst,
            worst_at=f"{place}, {worst.worst_at}",
            lowest_minimum=max((harm.lowest_minimum for harm in each), key=last_if_nan),
            most_uplift=max((harm.most_uplift for harm in each), key=last_if_nan),
        )


def harm_of(rows: Sequence[Row], passive_rows: Sequence[Row]) -> Harm:
    """Harm in one cell; the rows of the policy and of the passive pantograph are for the same seeds."""

    def figure(name: str) -> Array:
        """Of the policy's passes, and of the passive ones, (2, windows, passes)."""
        return np.array(
            [
                [[getattr(each.figures, name) for each in row.windows] for row in some]
                for some in (rows, passive_rows)
            ]
        ).swapaxes(1, 2)

    changes = 100 * window_changes(rows)
    most = int(np.nanargmax(changes)) if np.isfinite(changes).any() else 0
    late, number = divmod(most, len(rows))
    loss, passive_loss = figure("contact_loss")
    minimum, passive_minimum = figure("min")
    uplift, passive_uplift = figure("max_uplift")
    below, above = passive_minimum - minimum, uplift - passive_uplift

    def passes_with(harmful: NDArray[np.bool_]) -> int:
        return int(harmful.any(axis=0).sum())

    return Harm(
        passes=len(rows),
        sigma=passes_with(changes > WORSE["sigma"]),
        loss=passes_with(loss - passive_loss > WORSE["loss"]),
        lost=passes_with((loss > 0) & (passive_loss == 0)),
        minimum=passes_with(below > WORSE["minimum"]),
        uplift=passes_with(1e3 * above > WORSE["uplift"]),
        worst=float(changes[late, number]),
        worst_at=f"seed {rows[number].seed}" + (", late" if late else ""),
        lowest_minimum=float(max(below.flat, key=last_if_nan)),
        most_uplift=float(max(above.flat, key=last_if_nan)),
    )


def last_if_nan(value: float) -> float:
    """A value for a maximum that passes over nan."""
    return -np.inf if np.isnan(value) else value


def harmful(harm: Harm, early: float, late: float | None) -> str:
    """Reason why a policy is not ranked for its harm in a cell; empty if it is.

    early, late: changes of σ in the windows (%), late None without one.
    """
    if harm.worst > MOST_WORSE:
        worst = beside(harm.worst, MOST_WORSE, "+.1f")
        return f"it changes σ by {worst} % in one pass ({harm.worst_at}), more than {MOST_WORSE:g} %"
    if harm.lost:
        where = f"{harm.lost} of {harm.passes} passes in which the passive pantograph keeps it"
        return f"it loses contact in {where}"
    if late is not None and late - early > MOST_GROWN:
        grown = beside(late - early, MOST_GROWN, ".1f")
        return (
            f"its change of σ grows along the line by {grown} points, from {early:+.1f} % to {late:+.1f} %, "
            f"more than {MOST_GROWN:g}"
        )
    return ""
