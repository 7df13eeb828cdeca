"""A self-contained HTML page; the same results give the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from panto_env.base.files import PAGES, check_output, write_whole
from panto_env.report.template import page_template

from ..benchmark.report import LEGEND
from .charts import BOTTOM, GAP, HEIGHT, LEFT, RIGHT, TOP, WIDTH
from .result import Result
from .tables import BAR, signed
from .track import track


def page(results: Sequence[Result]) -> str:
    """HTML of the page for one or several tracks.

    All text from a result is escaped, names of policies too: a result may come from anyone.
    """
    template = page_template("panto_baselines.report", signed=signed)
    return template.render(
        tracks=[track(result) for result in results],
        legend=LEGEND,
        box={
            "width": WIDTH,
            "height": HEIGHT,
            "left": LEFT,
            "right": WIDTH - RIGHT,
            "top": TOP,
            "bottom": HEIGHT - BOTTOM,
            "gap": GAP,
        },
        bar=BAR,
    )


def save(results: Sequence[Result], path: str | Path) -> None:
    """Write the page, whole or not at all. Raises InputError for a file name without a page's suffix."""
    check_output(path, PAGES)
    with write_whole(path) as temporary:
        temporary.write_text(page(results), encoding="utf-8")
