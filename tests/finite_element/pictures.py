"""The contact force of a section by both codes, overlaid."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from .figures import Run, filtered


def draw(runs: dict[str, Run], spans: tuple[int, int], path: Path) -> None:
    """Force low-passed at 20 Hz over the position, each run under its name; supports are dashed lines."""
    picture = Figure(figsize=(11, 4), layout="constrained")
    axes = picture.add_subplot(xlabel="position (m)", ylabel="contact force, below 20 Hz (N)")
    for (name, run), style in zip(runs.items(), ("-", "--"), strict=True):
        axes.plot(run.position, filtered(run), style, linewidth=1.2, label=name)
    bounds = [0.0, *run.support_position]
    for support in bounds:
        axes.axvline(support, color="0.7", linestyle="--", linewidth=0.6, zorder=0)
    axes.axvspan(bounds[spans[0] - 1], bounds[spans[1]], color="0.95", zorder=-1, label="spans compared")
    axes.set_xlim(0.0, float(run.position[-1]))
    picture.legend(loc="outside upper right", ncols=3)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.savefig(path, dpi=120)
