"""Contact-force figures as EN 50317 / EN 50318 define them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import butter, sosfilt, sosfilt_zi

from panto_env.analysis.plots import save

from .hermite import Array


class Run(Protocol):
    """What the figures need of a run, by either code."""

    time: Array
    position: Array
    contact_force: Array
    uplift: Array
    support_position: Array


@dataclass(frozen=True)
class Figures:
    """Forces (N) low-passed at 20 Hz; loss (%) of the raw force; uplift (mm) of the whole run."""

    mean: float
    std: float
    maximum: float
    minimum: float
    uplifts_mm: tuple[float, ...]
    """Maximum at each support of the stretch, both its ends included; the line's own ends have none."""
    loss_percent: float

    @property
    def uplift_mm(self) -> float:
        """Maximum at all supports of the stretch."""
        return max(self.uplifts_mm)


def low_passed(force: Array, time_step: float, cutoff: float = 20.0) -> Array:
    """Causal sixth-order Butterworth (Hz), started in steady state at the first value."""
    sections = butter(6, cutoff, fs=1 / time_step, output="sos")
    return sosfilt(sections, force, zi=sosfilt_zi(sections) * force[0])[0]


def filtered(run: Run) -> Array:
    """Contact force of a run below 20 Hz (N), shape (n_times,)."""
    return low_passed(run.contact_force, float(run.time[1] - run.time[0]))


def figures(run: Run, spans: tuple[int, int] = (5, 6)) -> Figures:
    """Figures over spans first..last, counted from 1, whatever their lengths; not the one before the end."""
    first, last = spans
    supports = [0.0, *run.support_position]
    return stretch(run, supports[first - 1], supports[last])


def stretch(run: Run, begin: float, end: float) -> Figures:
    """Figures between two positions (m). Raises ValueError where the run does not cover them."""
    if not 0 <= begin < end <= run.position[-1] + (run.position[1] - run.position[0]):
        raise ValueError(f"the run ends at {run.position[-1]:g} m; it has no stretch from {begin} to {end} m")
    force = filtered(run)
    inside = (run.position >= begin) & (run.position <= end)
    near = (run.support_position > begin - 1e-6) & (run.support_position < end + 1e-6)
    return Figures(
        mean=float(force[inside].mean()),
        std=float(force[inside].std()),
        maximum=float(force[inside].max()),
        minimum=float(force[inside].min()),
        uplifts_mm=tuple((1e3 * run.uplift[:, near].max(axis=0)).tolist()),
        loss_percent=100 * float(np.mean(run.contact_force[inside] <= 0)),
    )


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
    save(picture, path, dpi=120 if count == 1 else 90)
