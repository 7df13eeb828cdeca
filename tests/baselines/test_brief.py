"""What `panto benchmark` prints by default: the headline first, in a hundred columns."""

import io
import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import pytest
from rich.console import Console

from panto_baselines.benchmark.brief import MOST_LINES, brief, headline
from panto_baselines.benchmark.run import read_result
from panto_baselines.benchmark.settings import Windows
from panto_env.base.table import number

from ..documents import ROOT
from ..marks import some_at_once

TRACKS = sorted(path.name.partition(".")[0] for path in (ROOT / "docs" / "benchmark").glob("*.json.gz"))


@cache
def stored(track):
    return read_result(ROOT / "docs" / "benchmark" / f"{track}.json.gz")


def outcome(track):
    found = stored(track)
    lines = list(dict.fromkeys(cell.place.line for cell in found.cells))
    return SimpleNamespace(
        settings=SimpleNamespace(title=found.title),
        cells=sorted(found.cells, key=lambda cell: lines.index(cell.place.line)),
        standings=found.standings[::-1],  # a benchmark has them in the order of its policies
        windows=[Windows((10, 19))] * len(lines),
    )


def printed(given, width=100):
    console = Console(file=io.StringIO(), width=width)
    console.print(brief(given))
    return console.file.getvalue()


@pytest.mark.parametrize("track", some_at_once(TRACKS, ["faults", "head", "high-speed"]))
def test_it_fits_into_a_hundred_columns_and_names_everybody(track):
    given = outcome(track)
    text = printed(given)
    assert len(text.splitlines()) <= 4 * len(given.standings) + 30  # a table of speeds, and no wall
    whole = "".join(text.split())
    for each in given.standings:
        assert each.policy.replace(" ", "") in whole or each.trainings
        if each.rank is not None and each.interval is not None:  # numbers are not broken
            half = (each.interval[1] - each.interval[0]) / 2
            assert re.search(rf" {each.rank} +{number(each.change, 1)} ± {half:.1f} ", text)
    assert text.count("Not ranked: ") == sum(bool(each.disqualified) for each in given.standings)
    assert ("\nΔσ (%), " in text) == (len(given.windows) <= MOST_LINES)


def test_the_headline_comes_first_and_is_the_best_ranked_policy():
    given = outcome("high-speed")
    first, second = (next(each for each in given.standings if each.rank == k) for k in (1, 2))
    text = printed(given, 200)
    assert text.startswith(f"{first.policy} is first: σ {first.change:.1f} ± ")
    share = 100 * first.better_than[second.policy].share
    assert f"{second.policy} follows with {second.change:.1f} %; better in {share:.0f} % of passes." in text


def test_without_a_policy_that_helps_the_headline_says_so():
    passive = next(each for each in outcome("high-speed").standings if each.policy == "passive")
    assert headline([passive]) == headline([]) == "No policy that is ranked lowers σ."
    assert headline([replace(passive, policy="x", change=-3.0, rank=1)]).startswith("x is first: σ -3.0 %")


def test_a_policy_that_ran_on_one_line_only_is_named_with_its_reason():
    given = outcome("high-speed")
    assert "Out there" not in printed(given)
    given.cells = [replace(cell, policy="mine") if cell.policy == "pd" else cell for cell in given.cells]
    given.standings = [each for each in given.standings if each.policy != "pd"]
    assert "Out there: mine: moves the mean force by +11.5 %, at 350 km/h." in printed(given, 200)
