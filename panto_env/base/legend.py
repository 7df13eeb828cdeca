"""The legend of plots."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def legend_above(axis: Axes, columns: int = 5) -> None:
    """Draw a legend above the axis, at the right, where it covers no data."""
    axis.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=columns, fontsize="small", frameon=False)
