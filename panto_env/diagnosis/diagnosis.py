"""Is the line healthy; if not, where, and what is it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Array
from ..base.errors import beside
from ..base.plotting import BLUE, LIMIT, ORANGE, POSITION, legend_above, mark_supports, stacked
from ..base.table import Table
from ..catalog import load_pantograph
from ..fitting.stored import GOES_ON, Stored
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData
from ..records.record import Record
from .features import (
    ENOUGH,
    FALSE_ALARMS,
    Classifier,
    Evidence,
    Region,
    Sort,
    cautious_threshold,
    regions,
    trained,
)
from .healthy import Healthy
from .measured_passes import measured_passes
from .passes import Passes, side_by_side

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENOUGH_PASSES = 10
"""Healthy passes from which on how they differ is well known: with fewer, what a pantograph unlike all of
theirs does is taken for defects (``studies/paper2``)."""
MANY = 6
"""Healthy passes from which on their mean is well known."""
ALIKE = 2.0
"""Level of healthy passes (N) that those over one line keep to: simulated ones have 0.6 to 1.6 N at 160 to
280 km/h on two lines. Over several lines of a design, droppers differing by 5 mm rms, it is 2.2 to 5.9 N."""
CHANGED, RARE = 2.0, 1e-3
"""Level of a pass over that of healthy ones from which on the whole line counts as changed, where no more
than this share of healthy passes would have it (Student's t of log levels)."""


@dataclass(frozen=True)
class Finding:
    """A defect that was found."""

    kind: str  # the most likely one
    shares: Mapping[str, float]  # how likely each kind is
    position: float  # m
    span: int  # counted from 1
    offset: float  # from the span's first support (m)
    interval: int  # of the span: 1 lies before its first dropper
    dropper: int | None  # of the span, counted from 1, where it is one
    score: float  # over the threshold


@dataclass(frozen=True)
class Diagnosis:
    """What passes say about a line."""

    findings: tuple[Finding, ...]  # in their order along the line
    changed: bool  # whether the whole line differs: findings are then what stands out beyond that
    level: float  # of what the force has where passes are quiet, over that of healthy ones
    evidence: Evidence
    begin: float  # of what is judged (m)
    end: float
    false_alarms: float  # of the threshold, per km
    notes: tuple[str, ...]  # why the answer is less good than it could be

    @property
    def healthy(self) -> bool:
        """Whether nothing was found."""
        return not (self.findings or self.changed)


def diagnose(
    runs: Sequence[Trajectory],
    healthy: Sequence[Trajectory],
    *,
    false_alarms: float = FALSE_ALARMS,
    classifier: Classifier | None = None,
    seed: int = 0,
    pantograph: str | Path | PantographData | None = None,
) -> Diagnosis:
    """Hold one pass over a line, or the mean of several, against healthy passes over it at the same speed.

    false_alarms: per km of healthy line, by which the threshold is set. classifier: of the kinds, by default
    the one that comes with the project. seed: of the noise of the sensors that forces are estimated from.
    pantograph: of all passes, as the estimator knows it; by default each one's own, as designed.
    Raises InputError where passes are too few or too short, cannot be compared, or cannot be a pantograph's.
    """
    known = None if pantograph is None else load_pantograph(pantograph)
    passes, reference = side_by_side(runs, healthy, seed, known)
    return judge(passes, Healthy.of(reference), false_alarms, classifier)


def diagnose_records(
    records: Sequence[Record],
    known: Stored,
    *,
    false_alarms: float = FALSE_ALARMS,
    classifier: Classifier | None = None,
    seed: int = 0,
) -> Diagnosis:
    """Hold records of a measuring train, or the mean of several, against the line of a fit.

    known: what the fit knows. false_alarms, classifier: as of ``diagnose``. seed: of the healthy passes,
    which are simulated. Raises InputError as ``measured_passes`` does.
    """
    passes, reference, notes = measured_passes(records, known, seed)
    found = judge(passes, Healthy.of(reference), false_alarms, classifier)
    ahead = [GOES_ON] if found.findings and not known.design.ends else []
    return replace(found, notes=(*notes, *known.notes, *ahead, *found.notes))


def judge(
    passes: Passes,
    healthy: Healthy,
    false_alarms: float = FALSE_ALARMS,
    classifier: Classifier | None = None,
) -> Diagnosis:
    """As ``diagnose``, of passes that lie side by side with those that ``healthy`` was learned from."""
    limit = cautious_threshold(healthy.scores, passes.per_span, passes.span, false_alarms)
    evidence, levels = healthy.score(passes, limit)
    found = [_finding(evidence, region, classifier or trained()) for region in regions(evidence)]
    level, changed = _whole_line(levels, healthy.levels)
    return Diagnosis(
        findings=tuple(sorted(found, key=lambda each: each.position)),
        changed=changed,
        level=level,
        evidence=evidence,
        begin=float(passes.position[passes.lead]),
        end=float(passes.position[-1] + passes.step),
        false_alarms=false_alarms,
        notes=tuple(_notes(healthy, passes.per_span)),
    )


def _finding(evidence: Evidence, region: Region, network: Classifier) -> Finding:
    answer, alignment = network.answer(evidence, region), evidence.alignment
    position = answer.place.position
    number = math.floor(alignment.in_spans(position) + 1e-9)
    begin, end = alignment.limits((number + 1, number + 1))
    offset = position - begin
    own = evidence.droppers[(evidence.droppers > begin) & (evidence.droppers < end)] - begin
    return Finding(
        kind=answer.kind,
        shares=answer.shares,
        position=position,
        span=number + 1,
        offset=max(offset, 0.0),
        interval=int((own < offset - 1e-6).sum()) + 1,
        dropper=int(np.argmin(np.abs(own - offset))) + 1 if answer.place.sort is Sort.DROPPER else None,
        score=float(evidence.score[region.peak]) / evidence.threshold,
    )


def _whole_line(levels: Array, healthy: Array) -> tuple[float, bool]:
    from scipy.stats import t  # slow to import

    usual = np.log(healthy)
    above = float(np.log(levels).mean() - usual.mean())
    spread = float(usual.std(ddof=1)) * math.sqrt(1 / len(levels) + 1 / len(usual))
    rare = above > t.isf(RARE, len(usual) - 1) * spread
    return math.exp(above), bool(rare and above > math.log(CHANGED))


def _notes(healthy: Healthy, per_span: int) -> list[str]:
    notes = []
    count, spans = len(healthy.scores), healthy.scores.size // per_span
    if count < ENOUGH_PASSES:
        notes.append(
            f"Only {count} healthy passes: how much they differ is not well known; less is found, and more "
            f"of it is false, than with {ENOUGH_PASSES}."
        )
    if spans < ENOUGH:
        notes.append(
            f"Only {spans} healthy spans set the threshold: with fewer than {ENOUGH}, false alarms may be "
            "several times as many, or as few."
        )
    level = float(np.median(healthy.levels))
    if count >= MANY and level > ALIKE:  # of fewer, the mean itself is off by as much
        notes.append(
            f"Healthy passes differ by {beside(level, ALIKE, '.1f')} N rms, more than the {ALIKE:g} N of "
            "passes over one line: if they are over other lines of its design, much less is found."
        )
    return notes


def place(finding: Finding) -> str:
    """Where a finding is, in words."""
    if finding.dropper is not None:
        return f"dropper {finding.dropper}"
    # A support has the number of the span before it, as in a line condition.
    return f"support {finding.span - 1}" if finding.offset < 1e-6 else f"interval {finding.interval}"


def findings_table(diagnosis: Diagnosis) -> Table:
    """A row for each finding."""

    def next_kind(finding: Finding) -> str:
        others = [kind for kind in finding.shares if kind != finding.kind]
        second = max(others, key=lambda kind: finding.shares[kind])
        return f"{second} ({100 * finding.shares[second]:.0f})"

    columns = {
        "what": lambda finding: finding.kind,
        "%": lambda finding: f"{100 * finding.shares[finding.kind]:.0f}",
        "or (%)": next_kind,
        "where": place,
        "span": lambda finding: diagnosis.evidence.alignment.span_name(finding.span),
        "from its support (m)": lambda finding: f"{finding.offset:.1f}",
        "position (m)": lambda finding: f"{finding.position:.0f}",
        "score/threshold": lambda finding: f"{finding.score:.1f}",
    }
    return Table.of("Defects found", diagnosis.findings, columns, text_columns=4)


def verdict(diagnosis: Diagnosis) -> list[str]:
    """What passes say, in sentences."""
    stretch = f"{diagnosis.begin:.0f} to {diagnosis.end:.0f} m"
    expected = diagnosis.false_alarms * (diagnosis.end - diagnosis.begin) / 1e3
    sentences = []
    if diagnosis.changed:
        sentences.append(
            f"The whole line differs from its healthy state, {diagnosis.level:.1f} times as much as healthy "
            "passes do from one another: lost tension, a pantograph unlike theirs, or, of a measured record, "
            "noisier sensors or an odometer that is off."
        )
    if diagnosis.findings:
        count = len(diagnosis.findings)
        sentences.append(f"{count} defect{'s' if count > 1 else ''} from {stretch}.")
    elif not diagnosis.changed:
        sentences.append(f"Healthy from {stretch}.")
    sentences.append(f"A healthy line would show {expected:.2g} false ones along this way.")
    return sentences


def plot_diagnosis(diagnosis: Diagnosis, title: str) -> Figure:
    """Force beside healthy passes, and the score with its threshold, findings, supports and droppers."""
    evidence, begin, end = diagnosis.evidence, diagnosis.begin, diagnosis.end
    shown = (evidence.position >= begin) & (evidence.position <= end)
    x = evidence.position[shown]
    figure, (force, score) = stacked((12, 6), 2)
    force.plot(x, evidence.residual[shown], color=BLUE, linewidth=0.9)
    force.set(ylabel="force beside healthy passes (N)")
    score.semilogy(x, np.maximum(evidence.score[shown], 1e-2), color=BLUE, linewidth=0.9, label="score")
    words = f"threshold: {diagnosis.false_alarms:g} false alarms per km"
    score.axhline(evidence.threshold, color=LIMIT, linestyle="--", linewidth=0.9, label=words)
    inside = evidence.droppers[(evidence.droppers > begin) & (evidence.droppers < end)]
    score.plot(inside, np.full(len(inside), 1e-2), "|", color="0.5", markersize=5, label="droppers")
    for axis in (force, score):
        mark_supports(axis, evidence.alignment.supports_within(begin, end))
    for finding in diagnosis.findings:
        for axis in (force, score):
            axis.axvline(finding.position, color=ORANGE, linewidth=1.5, zorder=1)
        words = f"{finding.kind}, span {evidence.alignment.span_name(finding.span)}, {place(finding)}"
        above = force.get_xaxis_transform()
        force.text(finding.position, 1.02, words, transform=above, rotation=12, fontsize="small")
    score.set(ylabel="score (-)", xlabel=POSITION, xlim=(begin, end))
    legend_above(score, 3)
    figure.suptitle(title)
    return figure
