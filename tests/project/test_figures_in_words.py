"""Figures in sentences of the documents follow from the stored results of the benchmark.

`make benchmark` writes these anew; a test that fails then shows the sentence with today's figures.
"""

import re
from functools import cache

import numpy as np
import pytest

from panto_env.base.checksums import read_checked

from ..benchmark_tables import of_readme
from ..documents import ROOT

PASS = ("catenary", "pantograph", "speed_kmh", "seed")
ON_FAMILY = "adaptive:gains=adaptive-any-line"
FIVE = "agent-any-line, five trainings"


@cache
def stored(track):
    return read_checked(ROOT / "docs" / "benchmark" / f"{track}.json.gz")


def standing(track, policy):
    """What a policy reached over all of a track."""
    return next(each for each in stored(track)["standings"] if each["policy"] == policy)


def less(track, policy):
    """By how much a policy reduces σ on a track (%), with the interval's ends, the smaller one first."""
    found = standing(track, policy)
    return -found["change"], -found["interval"][1], -found["interval"][0]


def ahead(track, policy, other):
    """In how many passes a policy is ahead of another (%), with the interval's ends."""
    found = standing(track, policy)["better_than"][other]
    return tuple(100 * share for share in (found["share"], *found["interval"]))


@cache
def cells(track, policy):
    """By how much a policy reduces σ in each cell of a track (%)."""
    return {
        tuple(c[key] for key in PASS[:3]): -c["change"]
        for c in stored(track)["cells"]
        if c["policy"] == policy
    }


def cells_ahead(track, policy, other):
    """In how many cells of a track a policy reduces σ more than another."""
    than = cells(track, other)
    return sum(less > than[cell] for cell, less in cells(track, policy).items())


def at(track, policy, speed):
    """Cell of a track on one line."""
    (found,) = [less for (_, _, own), less in cells(track, policy).items() if own == speed]
    return found


def loss(track, policy, speed):
    """Contact loss CL in a cell of a track on one line (%)."""
    return next(
        cell["figures"]["contact_loss"]
        for cell in stored(track)["cells"]
        if cell["policy"] == policy and cell["speed_kmh"] == speed
    )


def passes(track, policy):
    """Change of σ in each pass of a policy (%), mean of both windows where there are two."""
    rows = [row for row in stored(track)["rows"] if row["policy"] == policy]
    both = ("", "late_") if "late_std" in rows[0] else ("",)
    return {
        tuple(row[key] for key in PASS): np.mean(
            [100 * (row[f"{window}std"] / row[f"{window}pressed_std"] - 1) for window in both]
        )
        for row in rows
    }


def behind(track, policy, other):
    """By how many points a policy is behind another, pass by pass."""
    own, its = passes(track, policy), passes(track, other)
    return np.array([own[key] - its[key] for key in its])


def behind_by_cell(track, policy, other):
    """By how many points a policy is behind another, cell by cell."""
    own, its = cells(track, policy), cells(track, other)
    return np.array([its[key] - own[key] for key in its])


def ends(numbers):
    """The least and the largest of numbers."""
    return min(numbers), max(numbers)


def ranked():
    """Standings of all tracks that have a place in the rankings, without passive, tapes and the blind."""
    apart = ("passive", "tape of", "blind of")
    return [
        each
        for path in sorted((ROOT / "docs" / "benchmark").glob("*.json.gz"))
        for each in read_checked(path)["standings"]
        if each["rank"] is not None and not each["policy"].startswith(apart)
    ]


def of_trainings(function, track, other):
    """A function of a track and two policies, over the five trainings of agent-any-line."""
    names = stored(track)["settings"]["trainings"][FIVE]
    return np.concatenate([function(track, name, other) for name in names])


def windows(track, policy, line=None):
    """Change of sigma (%) in the early and the late window, over a track or on one of its lines."""
    rows = stored(track)["standings" if line is None else "cells"]
    (one,) = (each for each in rows if each["policy"] == policy and line in (None, each.get("catenary")))
    return one["early"], one["late"]


def case(track, policy, which):
    """By how much a policy reduces σ in a case of a track on one line (%)."""
    (found,) = [c for c in stored(track)["cells"] if (c["policy"], c["case"]) == (policy, which)]
    return -found["change"]


def kilometres(track, policy):
    """Change of σ in each kilometre of a track's line (%)."""
    (found,) = [c for c in stored(track)["cells"] if c["policy"] == policy]
    return found["kilometres"]


SENTENCES = {
    "docs/benchmark.md": [
        (
            "`repetitive` reduces σ by {:.0f} to {:.0f} %, and `agent-any-pantograph`, which has met none of "
            "them, by {:.0f} to {:.0f} %, more in {} of the 10 cells",
            lambda: (
                *ends(cells("unknown-line", "repetitive").values()),
                *ends(cells("unknown-line", "agent-any-pantograph").values()),
                cells_ahead("unknown-line", "agent-any-pantograph", "repetitive"),
            ),
        ),
        (
            "by {:.0f} to {:.0f} % (`repetitive`: {:.0f} to {:.0f} %)",
            lambda: (
                *ends(cells("unknown-section", "agent-any-pantograph").values()),
                *ends(cells("unknown-section", "repetitive").values()),
            ),
        ),
        (
            "In {} of {} passes on unknown sections its minimum is lower, by up to {:.0f} N",
            lambda: [
                standing("unknown-section", "agent-any-pantograph")["harm"][key]
                for key in ("minimum", "passes", "lowest_minimum")
            ],
        ),
        (
            "`agent-any-pantograph` has −{:.0f} % instead of −{:.0f} %, behind the guard −{:.0f} %",
            lambda: [
                case("faults", policy, which)
                for policy, which in (
                    ("agent-any-pantograph", "force silent"),
                    ("agent-any-pantograph", "none"),
                    ("guarded:agent-any-pantograph", "force silent"),
                )
            ],
        ),
        (
            "agents reduce σ by {:.0f} to {:.0f} % in every kilometre",
            lambda: ends(
                [
                    -change
                    for policy in ("agent-any-line", "agent-any-pantograph")
                    for change in kilometres("journey", policy)
                ]
            ),
        ),
        (
            "`agent-robust` reduces σ by {:.1f} % there, `agent-any-pantograph` by {:.1f} %; `repetitive` is",
            lambda: [less("permissible", each)[0] for each in ("agent-robust", "agent-any-pantograph")],
        ),
        (
            "`agent-any-pantograph` reduces σ by {:.1f} % there, after {:.1f} % at first",
            lambda: [-one for one in windows("long", "agent-any-pantograph")[::-1]],
        ),
        (
            "the σ of `agent-any-line` is {:.0f} % below passive at first and {:.0f} % above it later; on "
            "`ln2` its gain of {:.0f} % is gone",
            lambda: (
                -windows("long", "agent-any-line", "sweden-st15")[0],
                windows("long", "agent-any-line", "sweden-st15")[1],
                -windows("long", "agent-any-line", "ln2")[0],
            ),
        ),
        ("no ranked one is above {:.1f} %", lambda: [max(abs(each["most_moved"]) for each in ranked())]),
        (
            "more than 1.5 % in a pass: of {}, {} never do",
            lambda: (len(ranked()), sum(each["moved"] == 0 for each in ranked())),
        ),
    ],
    "docs/policies.md": [
        (
            "at 400 km/h CL is {:.1f} % with `pd`, {:.1f} % with `pd:washout=1`, and {:.1f} % with the "
            "passive",
            lambda: [
                loss("high-speed-as-built", policy, 400) for policy in ("pd", "pd:washout=1", "passive")
            ],
        ),
    ],
    "docs/agents.md": [
        (
            "It is up to {:.0f} points behind its teacher, and ahead of it in {:.0f} % of passes",
            lambda: (
                max(behind_by_cell("known-line", "agent-known-line", "fitted-fb+ff")),
                ahead("known-line", "agent-known-line", "fitted-fb+ff")[0],
            ),
        ),
        (
            "and {:.0f} to {:.0f} % at 250, 300 and 325 km/h",
            lambda: ends(
                [
                    100 * cell["oracle_share"]
                    for cell in stored("known-line")["cells"]
                    if cell["policy"] == "fitted-fb+ff" and cell["speed_kmh"] in (250, 300, 325)
                ]
            ),
        ),
        (
            "−{:.1f} % on the track any-line (−{:.1f} to −{:.1f}; `repetitive` −{:.1f} %), in both windows "
            "alike",
            lambda: (
                *np.array(less("any-line", "agent-small"))[[0, 2, 1]],
                less("any-line", "repetitive")[0],
            ),
        ),
        (
            "−{:.1f} % in the mean (`repetitive` −{:.1f} %, its teacher −{:.1f} %)",
            lambda: [
                -standing("unknown-line", each)["change"]
                for each in ("agent-small", "repetitive", "agent-any-pantograph")
            ],
        ),
        (
            "First on unknown-line with −{:.1f} % (−{:.1f} to −{:.1f})",
            lambda: np.array(less("unknown-line", "agent-any-pantograph"))[[0, 2, 1]],
        ),
        (
            "a hundred spans on to {:.0f} % above passive in one pass",
            lambda: [standing("unknown-line", "agent-small")["harm"]["worst"]],
        ),
        (
            "(`sweden-st15` at 160 km/h) σ is {:.0f} % larger",
            lambda: [standing("unknown-line", "agent-any-line")["harm"]["worst"]],
        ),
        (
            "{:.1f} behind agent-any-line on any-line",
            lambda: [less("any-line", "agent-any-line")[0] - less("any-line", "agent-any-pantograph")[0]],
        ),
        (
            "on the track any-line, mean of the five trainings: −{:.1f} % (−{:.1f} to −{:.1f})",
            lambda: np.array(less("any-line", FIVE))[[0, 2, 1]],
        ),
        (
            "| `adaptive` with gains fitted to the family | −{:.1f} | {:.0f} % ({:.0f} to {:.0f}) | {:.1f} | "
            "| `repetitive` | −{:.1f} | all | ahead by {:.1f} |",
            lambda: (
                less("any-line", ON_FAMILY)[0],
                *ahead("any-line", FIVE, ON_FAMILY),
                max(of_trainings(behind, "any-line", ON_FAMILY)),
                less("any-line", "repetitive")[0],
                -max(of_trainings(behind, "any-line", "repetitive")),
            ),
        ),
        (
            "−{:.1f} % (−{:.1f} to −{:.1f}). It is ahead of `adaptive` in {:.0f} % of passes ({:.0f} to "
            "{:.0f}), and at most {:.1f} points behind it",
            lambda: (
                *np.array(less("any-line", "agent-any-line-five"))[[0, 2, 1]],
                *ahead("any-line", "agent-any-line-five", ON_FAMILY),
                max(behind("any-line", "agent-any-line-five", ON_FAMILY)),
            ),
        ),
        (
            "makes σ larger on `section:main-line`, by {:.0f} % at 120 km/h and {:.0f} % at 160",
            lambda: [
                -cells("unknown-section", "agent-any-line")["section:main-line", "dsa250", speed]
                for speed in (120, 160)
            ],
        ),
        (
            "first on the track unknown-section with −{:.1f} % (−{:.1f} to −{:.1f}; `repetitive` −{:.1f} %)",
            lambda: (
                *np.array(less("unknown-section", "agent-any-pantograph"))[[0, 2, 1]],
                less("unknown-section", "repetitive")[0],
            ),
        ),
        (
            "in {} of the ten cells and in {:.0f} % of the {} passes, at most {:.1f} points behind in any",
            lambda: (
                cells_ahead("unknown-line", "agent-any-pantograph", "repetitive"),
                ahead("unknown-line", "agent-any-pantograph", "repetitive")[0],
                len(passes("unknown-line", "repetitive")),
                max(behind("unknown-line", "agent-any-pantograph", "repetitive")),
            ),
        ),
        (
            "In every pass of both tracks σ is lower than passive, by {:.0f} % at least",
            lambda: [
                min(
                    -standing(track, "agent-any-pantograph")["harm"]["worst"]
                    for track in ("unknown-line", "unknown-section")
                )
            ],
        ),
        (
            "on the track high-speed-as-built: -{:.1f} % over all cells (-{:.1f} to -{:.1f}). It is first at "
            "337, 350 and 400 km/h, {:.1f} and {:.1f} points behind `agent-any-pantograph` at 262 and 300",
            lambda: (
                *np.array(less("high-speed-as-built", "agent-high-speed"))[[0, 2, 1]],
                *(
                    at("high-speed-as-built", "agent-any-pantograph", speed)
                    - at("high-speed-as-built", "agent-high-speed", speed)
                    for speed in (262, 300)
                ),
            ),
        ),
        (
            "−{:.1f} % on the track train-both (−{:.1f} to −{:.1f}), ahead of `repetitive` in {:.0f} % of "
            "passes. Where only the second one is controlled it has −{:.1f} %",
            lambda: (
                *np.array(less("train-both", "agent-train"))[[0, 2, 1]],
                ahead("train-both", "agent-train", "repetitive")[0],
                less("train-trailing", "agent-train")[0],
            ),
        ),
        (
            "on the track train-trailing: −{:.1f} % (−{:.1f} to −{:.1f}), first at 200 and 250 km/h",
            lambda: np.array(less("train-trailing", "agent-trailing"))[[0, 2, 1]],
        ),
        (
            "−{:.1f} % on the track train-trailing (−{:.1f} to −{:.1f}), ahead of every classical policy",
            lambda: np.array(less("train-trailing", "agent-trailing-alone"))[[0, 2, 1]],
        ),
        (
            "reduces σ by {:.0f} to {:.0f} %, {:.0f} to {:.0f} points less than `fitted-fb+ff` there",
            lambda: (
                *ends(cells("head", "agent-head").values()),
                *ends(behind_by_cell("head", "agent-head", "fitted-fb+ff")),
            ),
        ),
        (
            "`fitted-fb+ff` reaches {:.0f} % of the gain of an oracle that knows the future",
            lambda: [100 * standing("known-line", "fitted-fb+ff")["oracle_share"]],
        ),
        (
            "(`fitted-fb+ff` at 400 km/h: {:+.0f} % as designed, {:+.0f} % as built)",
            lambda: (-at("high-speed", "fitted-fb+ff", 400), -at("high-speed-as-built", "fitted-fb+ff", 400)),
        ),
        (
            "`adaptive-fb+ff`, comes within {:.1f} points of the agent",
            lambda: [
                less("high-speed-as-built", "agent-high-speed")[0]
                - less("high-speed-as-built", "adaptive-fb+ff")[0]
            ],
        ),
        ("`adaptive-fb+ff` by {:.1f} %.", lambda: less("as-built", "adaptive-fb+ff")[:1]),
    ],
}
"""By document: sentences with places for figures, and the figures from the stored results."""


@pytest.mark.slow
@pytest.mark.parametrize("page", SENTENCES)
def test_sentences_hold(page):
    text = re.sub(r"\s+", " ", (ROOT / page).read_text(encoding="utf-8").replace("*", ""))
    now = [sentence.format(*figures()) for sentence, figures in SENTENCES[page]]
    assert [sentence for sentence in now if sentence not in text] == []


def test_table_of_the_readme():
    assert of_readme() in (ROOT / "README.md").read_text(encoding="utf-8")
