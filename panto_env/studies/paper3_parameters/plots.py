"""Paper 3's Figs 4 to 13: head displacement and contact force over the 11th and 12th span."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...base import plotting as marks
from ...base.plotting import series_colour
from .passes import SPANS, SPEED_KMH, Influence, Pass, Passes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIFFERENT = 0.5
"""Contact force (N) by which the two readings must differ for both to be drawn."""


def all_plots(influences: Sequence[Influence], pulling: Passes, pushing: Passes) -> dict[str, Figure]:
    """One plot per figure of the paper, by file name. Where contact is lost both readings are drawn.

    pulling, pushing: passes with a contact that may pull, as the paper's equations have it, and with
    one that can only push.
    """
    return {
        plot_name(influence, quantity): _draw(
            influence, quantity, pulling[influence.key], pushing[influence.key]
        )
        for influence in influences
        for quantity in ("displacement", "force")
    }


def plot_name(influence: Influence, quantity: str) -> str:
    """File name, without suffix; quantity is "displacement" or "force"."""
    return f"fig{_number(influence, quantity):02d}-{influence.key}-{quantity}"


def _number(influence: Influence, quantity: str) -> int:
    return influence.first_figure + (quantity == "force")


def _draw(influence: Influence, quantity: str, pulling: Sequence[Pass], pushing: Sequence[Pass]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(8, 4.4), layout="constrained")
    axis = figure.subplots()
    scale = 1e3 if quantity == "displacement" else 1.0
    handles = []
    for k, (value, pulled, pushed) in enumerate(zip(influence.values, pulling, pushing, strict=True)):
        axis.plot(pulled.position, scale * getattr(pulled, quantity), color=series_colour(k), linewidth=1.6)
        label = f"${influence.symbol}$ = {value:g} {influence.unit}"
        handles.append(Line2D([], [], color=series_colour(k), label=label))
        if np.abs(pulled.force - pushed.force).max() > DIFFERENT:
            axis.plot(
                pushed.position, scale * getattr(pushed, quantity), ":", color=series_colour(k), linewidth=1.6
            )
            label = f"{value:g} {influence.unit}, contact can only push"
            handles.append(Line2D([], [], color=series_colour(k), linestyle=":", label=label))
    if any(getattr(one_pass, quantity).min() < 0 for one_pass in pulling):
        axis.axhline(0.0, color="0.5", linewidth=0.8)
    span = pulling[0].span
    masts = [span * k for k in range(SPANS[0] - 1, SPANS[1] + 1)]
    axis.set(xlim=(masts[0], masts[-1]), xlabel=marks.POSITION)
    marks.mark_supports(axis, masts)
    what = "head displacement $z_1$" if quantity == "displacement" else "contact force $F_C$"
    axis.set(ylabel=f"{what} ({'mm' if quantity == 'displacement' else 'N'})")
    at = "" if influence.key == "speed" else f", {SPEED_KMH:g} km/h"
    axis.set_title(f"As Fig. {_number(influence, quantity)} of paper 3{at}", fontsize="medium")
    axis.grid(axis="y", color="0.92")
    figure.legend(handles=handles, fontsize="small", loc="outside lower center", ncols=len(handles))
    return figure
