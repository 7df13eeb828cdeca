"""Picture of a diagnosis along the line. Matplotlib is imported late: it is slow to import."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..base import plotting as marks
from ..base.plotting import BLUE, LIMIT, ORANGE, legend_above
from .diagnosis import Diagnosis, place

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_diagnosis(diagnosis: Diagnosis, title: str) -> Figure:
    """Force beside healthy passes, and the score with its threshold, findings, supports and droppers."""
    from matplotlib.figure import Figure

    evidence = diagnosis.evidence
    shown = (evidence.position >= diagnosis.begin) & (evidence.position <= diagnosis.end)
    x = evidence.position[shown]
    figure = Figure(figsize=(12, 6), layout="constrained")
    force, score = figure.subplots(2, 1, sharex=True)
    force.plot(x, evidence.rest[shown], color=BLUE, linewidth=0.9)
    force.set(ylabel="force beside healthy passes (N)")
    score.semilogy(x, np.maximum(evidence.score[shown], 1e-2), color=BLUE, linewidth=0.9, label="score")
    words = f"threshold: {diagnosis.false_alarms:g} false alarms per km"
    score.axhline(evidence.threshold, color=LIMIT, linestyle="--", linewidth=0.9, label=words)
    inside = evidence.droppers[(evidence.droppers > diagnosis.begin) & (evidence.droppers < diagnosis.end)]
    score.plot(inside, np.full(len(inside), 1e-2), "|", color="0.5", markersize=5, label="droppers")
    for axis in (force, score):
        supports = evidence.alignment.supports_within(diagnosis.begin, diagnosis.end)
        marks.mark_supports(axis, map(evidence.alignment.support, supports))
        for finding in diagnosis.findings:
            axis.axvline(finding.position, color=ORANGE, linewidth=1.5, zorder=1)
    for finding in diagnosis.findings:
        words = f"{finding.kind}, span {evidence.alignment.span_name(finding.span)}, {place(finding)}"
        above = force.get_xaxis_transform()
        force.text(finding.position, 1.02, words, transform=above, rotation=12, fontsize="small")
    score.set(ylabel="score (-)", xlabel=marks.POSITION, xlim=(diagnosis.begin, diagnosis.end))
    legend_above(score, 3)
    figure.suptitle(title)
    return figure
