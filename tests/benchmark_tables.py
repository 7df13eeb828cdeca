"""The tables of README.md and docs/benchmark.md from the stored results: python -m tests.benchmark_tables.

`make benchmark` calls it. Each table stays where it is. The page has a short ranking of each headline track;
`panto report --markdown` prints all tables in full.
"""

from __future__ import annotations

import re
from itertools import compress

from panto_baselines.benchmark.run import Result, read_result
from panto_baselines.benchmark.settings import control_of
from panto_baselines.report.tables import ranking
from panto_env.base.files import write_whole
from panto_env.base.table import Table

from .documents import ROOT

PAGE = ROOT / "docs" / "benchmark.md"
README = ROOT / "README.md"
RESULTS = ROOT / "docs" / "benchmark"
BEGIN, END = "<!-- python -m tests.benchmark_tables -->", "<!-- end -->"
TRACK = "unknown-line"
HEADLINE = (
    "any-line",
    "high-speed-as-built",
    "train-trailing",
    "train-both",
    "unknown-line",
    "unknown-section",
)
"""Tracks that the page ranks: a policy can't win them without feedback."""
COLUMNS = ("policy", "Δσ (%)", "95 %", "other lines", "100 spans on", "worst pass (%)", "not ranked, since")
"""Those of a full ranking that the page shows."""
BEST = 3
"""How many of the best policies the page shows of each track."""
SHOWN = {
    "agent-any-pantograph": "learned, for four pantographs",
    "agent-robust": "learned, also with faults",
    "agent-small": "learned, 4 kB of weights",
    "repetitive": "learns during the run",
    "fb+ff:gain=0.3,washout=1": "paper 1's",
    "pd:washout=1": "feedback",
    "passive": "no control",
}
"""Policies of the README's table, and what each is. The page shows them on each track, too."""
FALLEN = "agent-any-line"
"""An agent that the page shows, too: the second window and other lines take its rank."""


def short_ranking(result: Result) -> Table:
    """The rows of a track's ranking that matter, with ranks among all policies.

    They are those of the best policies, of ``SHOWN`` and of the best tape that has a rank, and none of a
    method's trainings.
    """
    full = ranking(result)
    listed = [
        (one, row)
        for one, row in zip(result.by_rank, full.cells, strict=True)
        if one.policy not in result.method_of
    ]
    ranked = [one.policy for one, _ in listed if one.rank is not None and not control_of(one.policy)]
    tapes = [one.policy for one, _ in listed if one.rank is not None and one.policy.startswith("tape of")]
    names = {*SHOWN, FALLEN, *ranked[:BEST], *tapes[:1]}
    kept = [heading in COLUMNS for heading in full.headings]
    rows = [
        ("–" if one.rank is None else str(one.rank), *compress(row, kept))
        for one, row in listed
        if one.policy in names
    ]
    return Table(full.title, ("rank", *compress(full.headings, kept)), rows, text_columns=2)


def with_tables(text: str) -> str:
    """The page's text with rankings of the stored results; raises ValueError where one is missing."""
    for track in HEADLINE:
        result = read_result(RESULTS / f"{track}.json.gz")
        table = short_ranking(result)
        block = f"*{table.title}*\n\n{table.markdown.rstrip()}\n"
        old = rf"^\*{re.escape(result.title)}: Δσ.*\*\n\n(?:\|.*\n)+"
        text, found = re.subn(old, lambda _, block=block: block, text, flags=re.MULTILINE)
        if found != 1:
            raise ValueError(f"{PAGE} has {found} rankings with the title {result.title}.")
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
