"""Pages of a record, and of a record beside a run: tables and charts in one file."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from ..base.checksums import __version__
from ..base.files import PAGES, check_output, write_whole
from ..base.table import Alarm, Table
from ..report.charts import drawn
from ..report.page import FILTER, page_template
from . import compare as compared
from . import judge as tables
from . import plots
from .compare import Comparison
from .judge import Judgement


def save_record_page(found: Judgement, title: str, path: str | Path) -> None:
    """Write the page of a record, whole or not at all. Raises InputError for a name with another suffix."""
    supports = found.alignment is not None
    charts = [
        (
            "Contact force along the line",
            drawn(lambda axes: plots.draw_force(axes, found), along_line=supports),
        ),
        ("Spectrum of the force as recorded", drawn(lambda axes: plots.draw_spectrum(axes, found))),
    ]
    shown = [
        tables.whole_table(found, "Figures of the whole record"),
        tables.requirements_table(found),
        *tables.part_tables(found),
    ]
    _save(title, FILTER, found.notes, charts, shown, tables.requirement_remarks(found), path)


def save_comparison_page(found: Comparison, title: str, path: str | Path) -> None:
    """Write the page of a record beside a run, as ``save_record_page`` does."""
    charts = [
        (
            "Both forces by place, low-passed at 20 Hz, not delayed",
            drawn(lambda axes: plots.draw_overlay(axes, found), along_line=True),
        ),
        ("Standard deviation by span", drawn(lambda axes: plots.draw_spans(axes, found))),
    ]
    shown = [compared.acceptance_table(found), compared.figures_table(found), compared.spans_table(found)]
    words = f"The simulation is {found.verdict}. {compared.shift_sentence(found)} {FILTER}"
    _save(title, words, found.notes, charts, shown, compared.criterion_notes(found), path)


def _save(
    title: str,
    introduction: str,
    notes: Sequence[str],
    charts: Sequence[tuple[str, str]],
    shown: Sequence[Table],
    sentences: Sequence[str],
    path: str | Path,
) -> None:
    check_output(path, PAGES)
    template = page_template("panto_env.records", alarm=lambda cell: isinstance(cell, Alarm))
    style = (files("panto_env.report") / "templates" / "style.css").read_text(encoding="utf-8")
    text = template.render(
        version=__version__,
        title=title,
        style=style,
        introduction=introduction,
        notes=notes,
        charts=charts,
        tables=shown,
        remarks=sentences,
    )
    with write_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
