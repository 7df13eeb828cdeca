"""Table of a tuning's outcome."""

from __future__ import annotations

from collections.abc import Sequence

from panto_env.base.table import Table
from panto_env.terminal import number

from .tune import Tuned


def table(policy: str, tuned: Sequence[Tuned]) -> Table:
    """Table with a row per speed: objective before and after, sigma and mean force relative to passive."""
    headings = (
        "speed (km/h)",
        "passes",
        "iterations",
        "objective before",
        "after",
        "σ to passive (%)",
        "mean force (%)",
    )
    rows = [
        (
            f"{each.speed_kmh:g}",
            str(each.passes),
            str(len(each.history) - 1),
            number(each.history[0], 3),
            number(each.history[-1], 3),
            f"{100 * each.std_change:+.1f}",
            f"{100 * each.mean_change:+.2f}",
        )
        for each in tuned
    ]
    return Table(f"{policy}, tuned: σ and mean on selection seeds", headings, rows)
