"""The tables of README.md and docs/benchmark.md from the stored results: python -m tests.benchmark_tables.

`make benchmark` calls it. Each table stays where it is; one of a new track comes last.
"""

from __future__ import annotations

import re

from panto_baselines.benchmark.run import read_result
from panto_baselines.report.tables import tables_of
from panto_env.base.files import write_whole
from panto_env.base.table import Table

from .documents import ROOT

PAGE = ROOT / "docs" / "benchmark.md"
README = ROOT / "README.md"
RESULTS = ROOT / "docs" / "benchmark"
BEGIN, END = "<!-- python -m tests.benchmark_tables -->", "<!-- end -->"
TRACK = "unknown-line"
CHECKS = ("as-built", "head", "high-speed", "known-line", "without-position")
"""Tracks that check single abilities, whose tables the page leaves to `panto report --markdown`."""
SHOWN = {
    "agent-any-pantograph": "learned, for four pantographs",
    "agent-any-line": "learned",
    "repetitive": "learns during the run",
    "fb+ff:gain=0.3,washout=1": "paper 1's",
    "pd:washout=1": "feedback",
    "passive": "no control",
}
"""Policies of the README's table, and what each is."""


def with_tables(text: str) -> str:
    """The page's text with the tables of the stored results."""
    for path in sorted(RESULTS.glob("*.json.gz")):
        if path.name.partition(".")[0] in CHECKS:
            continue
        result = read_result(path)
        blocks = [f"*{table.title}*\n\n{table.markdown.rstrip()}\n" for table in tables_of(result)]
        block = "\n".join(blocks)
        title = re.escape(result.title)
        old = rf"^\*{title}: Δσ.*\*\n\n(?:\|.*\n)+(?:\n\*{title}: .*\*\n\n(?:\|.*\n)+)*"
        text, found = re.subn(old, lambda _, block=block: block, text, flags=re.MULTILINE)
        text += "" if found else f"\n{block}"
    return text


def of_readme() -> str:
    """The README's table between its markers."""
    standings = {each.policy: each for each in read_result(RESULTS / f"{TRACK}.json.gz").standings}
    rows = []
    for policy, what in SHOWN.items():
        own = standings[policy]
        change = "not ranked" if own.rank is None else f"{own.change:.1f}"
        if own.rank is not None and own.interval_for_lines is not None:
            change += " ({:.1f} to {:.1f})".format(*own.interval_for_lines)
        losses = f"{own.contact_loss:.2f}", f"{own.cost_change:+.0f}"
        rows.append((f"`{policy}`", change, *losses, what))
    table = Table("", ("policy", "Δσ (%)", "CL (%)", "ΔCF (%)", "what it is"), tuple(rows))
    return f"{BEGIN}\n\n{table.markdown.rstrip()}\n\n{END}"


def with_table_of_readme(text: str) -> str:
    """The README's text with its table."""
    return re.sub(f"{BEGIN}.*?{END}", lambda _: of_readme(), text, flags=re.DOTALL)


if __name__ == "__main__":
    for page, written in ((PAGE, with_tables), (README, with_table_of_readme)):
        text = written(page.read_text(encoding="utf-8"))
        with write_whole(page) as temporary:
            temporary.write_text(text, encoding="utf-8")
