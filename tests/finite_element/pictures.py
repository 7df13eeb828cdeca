"""Contact forces by both codes, overlaid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from .figures import Run, filtered


def draw(runs: Mapping[str, Sequence[Run]], spans: tuple[int, int], path: Path) -> None:
    """Force low-passed at 20 Hz over the position, a panel for each collector, each run under its name.

    Supports are dashed lines. The last collector's end is the picture's.
    """
    count = len(next(iter(runs.values())))
    picture = Figure(figsize=(11, 4 if count == 1 else 2.6 * count + 1), layout="constrained")
    panels = picture.subplots(count, sharex=True, squeeze=False)[:, 0]
    for number, axes in enumerate(panels):
        for (name, own), style in zip(runs.items(), ("-", "--"), strict=True):
            run = own[number]
            axes.plot(run.position, filtered(run), style, linewidth=1.2, label=name)
        bounds = [0.0, *run.support_position]
        for support in bounds:
            axes.axvline(support, color="0.7", linestyle="--", linewidth=0.6, zorder=0)
        axes.axvspan(bounds[spans[0] - 1], bounds[spans[1]], color="0.95", zorder=-1, label="spans compared")
        if count > 1:
            axes.set_title(f"collector {number + 1}", loc="left", fontsize="medium")
    panels[0].set_xlim(0.0, min(float(run.position[-1]) for own in runs.values() for run in own))
    panels[-1].set_xlabel("position (m)")
    picture.supylabel("contact force, below 20 Hz (N)", fontsize="medium")
    picture.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.savefig(path, dpi=120 if count == 1 else 90)
