"""The tables of docs/benchmark.md from the stored results of the benchmark: python -m tests.benchmark_tables.

`make benchmark` calls it. Each table stays where it is; one of a new track comes last.
"""

from __future__ import annotations

import re

from panto_baselines.report.result import read_result
from panto_baselines.report.summary import summary
from panto_env.base.files import write_whole

from .documents import ROOT

PAGE = ROOT / "docs" / "benchmark.md"


def with_tables(text: str) -> str:
    """The page's text with the tables of the stored results."""
    for path in sorted((ROOT / "docs" / "benchmark").glob("*.json")):
        result = read_result(path)
        table = summary(result)
        block = f"*{table.title}*\n\n{table.markdown.rstrip()}\n"
        old = rf"^\*{re.escape(result.title)}: Δσ.*\*\n\n(?:\|.*\n)+"
        text, found = re.subn(old, lambda _, block=block: block, text, flags=re.MULTILINE)
        text += "" if found else f"\n{block}"
    return text


if __name__ == "__main__":
    written = with_tables(PAGE.read_text(encoding="utf-8"))
    with write_whole(PAGE) as temporary:
        temporary.write_text(written, encoding="utf-8")
