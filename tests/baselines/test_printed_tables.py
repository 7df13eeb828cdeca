"""The tables of a benchmark are as they were, word for word, of cells and standings that are made up.

python -m tests.baselines.test_printed_tables   # writes printed_tables.txt anew
"""

import io
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from panto_baselines.benchmark.harm import Harm
from panto_baselines.benchmark.overall import Standing
from panto_baselines.benchmark.report import FIGURES, _overall, tables
from panto_baselines.benchmark.settings import Windows
from panto_env.terminal import PlainConsole

from ..render.made_up_plots import cells

STORED = Path(__file__).with_name("printed_tables.txt")
HARM = Harm(24, 2, 3, 0, 7, 1, 4.56, "a, 250 km/h, seed 3, late", 12.3, 0.0021)
FIRST = Standing(
    "p", -12.34, (-14.0, -10.5), None, -14.2, -10.1, -3.21, -1.05, "a at 250 km/h", 0.957, 4.32, -21.4,
    31.4, 2.7, 0.01, 0.62, 24, 1, 2.3, HARM, "", 1,
    {"lqg": "20 of 24", "passive": "24 of 24"},
)  # fmt: skip
STANDINGS = (
    FIRST,
    replace(
        FIRST,
        policy="lqg",
        change=-8.0,
        interval=None,
        rank=2,
        oracle_share=None,
        interval_for_lines=(-20.0, 4.0),
        better_than={},
    ),
    replace(FIRST, policy="ppo", rank=3, trainings={"ppo-1": -7.0, "ppo-2": -9.0}, better_than={}),
    replace(FIRST, policy="ppo-1", change=-7.0, rank=None, better_than={}),
    replace(FIRST, policy="q", disqualified="it moves the mean", rank=None, improved=np.nan, better_than={}),
)


def with_figures(cell, number):
    """The same cell with all the figures that a table shows."""
    shown = {name: (number + 1.234) / (1e3 if "uplift" in name else 1) for name in FIGURES}
    oracle = -31.5 if cell.policy == "passive" and cell.speed_kmh == 250.0 else None
    return replace(
        cell, figures=shown | cell.figures, rank=number or None, spread=0.4 * number, oracle=oracle
    )


def printed():
    made = sorted(cells(), key=lambda cell: cell.speed_kmh)
    own = [with_figures(cell, number) for number, cell in enumerate(made)]
    other = [replace(cell, catenary="c", seeds=1, oracle=None) for cell in own]
    settings = SimpleNamespace(title="made up", lines=())
    outcome = SimpleNamespace(
        cells=(*own, *other),
        windows=(Windows((3, 7)), Windows((2, 4), (9, 11))),
        standings=STANDINGS,
        settings=settings,
    )
    said = io.StringIO()
    PlainConsole(file=said, width=200).print(tables(outcome))
    return "".join(f"{line.rstrip()}\n" for line in said.getvalue().splitlines())


def test_the_tables_of_a_benchmark_are_as_they_were():
    assert printed() == STORED.read_text(encoding="utf-8")


def test_the_best_policy_is_bold_and_one_that_is_disqualified_red():
    outcome = SimpleNamespace(standings=STANDINGS, settings=SimpleNamespace(title="made up"))
    assert [row.style for row in _overall(outcome).rows] == ["bold", "", "", "", "red"]


if __name__ == "__main__":
    STORED.write_text(printed(), encoding="utf-8")
