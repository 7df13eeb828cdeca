"""Tables of a diagnosis, for people."""

from __future__ import annotations

from ..base.table import Table
from .diagnosis import Diagnosis, Finding


def place(finding: Finding) -> str:
    """Where a finding is, in words."""
    if finding.dropper is not None:
        return f"dropper {finding.dropper}"
    # A support has the number of the span before it, as in a line condition.
    return f"support {finding.span - 1}" if finding.offset < 1e-6 else f"interval {finding.interval}"


def findings_table(diagnosis: Diagnosis) -> Table:
    """A row for each finding."""
    rows = []
    for finding in diagnosis.findings:
        others = sorted(finding.shares, key=lambda kind: -finding.shares[kind])
        second = next(kind for kind in others if kind != finding.kind)
        rows.append(
            (
                finding.kind,
                f"{100 * finding.shares[finding.kind]:.0f}",
                f"{second} ({100 * finding.shares[second]:.0f})",
                place(finding),
                diagnosis.evidence.alignment.span_name(finding.span),
                f"{finding.offset:.1f}",
                f"{finding.position:.0f}",
                f"{finding.score:.1f}",
            )
        )
    headings = (
        "what",
        "%",
        "or (%)",
        "where",
        "span",
        "from its support (m)",
        "position (m)",
        "score/threshold",
    )
    return Table("Defects found", headings, tuple(rows), text_columns=4)


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
