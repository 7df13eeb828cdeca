"""Figures in sentences of the documents follow from the stored results of the benchmark.

`make benchmark` writes these anew; a test that fails then shows the sentence with today's figures.
"""

import re

import numpy as np
import pytest

from ..benchmark_tables import of_readme
from ..documents import ROOT
from .results import (
    FIVE,
    ON_FAMILY,
    TRAILING,
    ahead,
    at,
    behind,
    behind_by_cell,
    cells,
    ends,
    less,
    loss,
    of_trainings,
    passes,
    ranked,
    standing,
    stored,
)

SENTENCES = {
    "docs/benchmark.md": [
        (
            "reduces σ by {:.1f} % ({:.1f} to {:.1f}). It is ahead of the best reference that was fitted to"
            " such lines",
            lambda: less("high-speed-as-built", "agent-high-speed"),
        ),
        (
            "fitted to such lines ({:.1f} %, in {:.0f} % of passes: {:.0f} to {:.0f}) and of all others",
            lambda: (
                less("high-speed-as-built", "adaptive-fb+ff")[0],
                *ahead("high-speed-as-built", "agent-high-speed", "adaptive-fb+ff"),
            ),
        ),
        ("and of all others ({:.1f} % and less)", lambda: less("high-speed-as-built", "lqg")[:1]),
        (
            "`repetitive` reduces σ by {:.0f} to {:.0f} %, and `agent-any-pantograph`, one network for four"
            " pantographs that has met none of these lines, by {:.0f} to {:.0f} %, more on each",
            lambda: (
                *ends(cells("unknown-line", "repetitive").values()),
                *ends(cells("unknown-line", "agent-any-pantograph").values()),
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
            "`repetitive` reduces σ by {:.0f} %, `adaptive` with gains fitted to other lines of the family "
            "by {:.1f} %, and `agent-any-line`, which is told nothing of the line, by {:.1f} % ({:.1f} to "
            "{:.1f}, five trainings)",
            lambda: (
                less("any-line", "repetitive")[0],
                less("any-line", ON_FAMILY)[0],
                *less("any-line", FIVE),
            ),
        ),
        (
            "`agent-trailing` reduces σ by {:.1f} %, the best reference by {:.1f} %",
            lambda: (less("train-trailing", "agent-trailing")[0], less("train-trailing", TRAILING)[0]),
        ),
        ("no ranked one is above {:.1f} %", lambda: [max(abs(each["most_moved"]) for each in ranked())]),
        (
            "of {} places in the rankings below, {} have none",
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
            "It qualifies at every speed, keeps the mean force within 1 %, and is up to {:.0f} points "
            "behind its teacher ({:.1f} ahead at 262 km/h; ahead in {:.0f} % of passes)",
            lambda: (
                max(behind_by_cell("known-line", "agent-known-line", "fitted-fb+ff")),
                at("known-line", "agent-known-line", 262) - at("known-line", "fitted-fb+ff", 262),
                ahead("known-line", "agent-known-line", "fitted-fb+ff")[0],
            ),
        ),
        (
            "It is ahead of `periodic` in {:.0f} % of passes, and of every other policy in {:.0f} % and more",
            lambda: (
                ahead("known-line", "agent-known-line", "periodic")[0],
                min(
                    ahead("known-line", "agent-known-line", other)[0]
                    for other in ("adaptive", "repetitive", "mpc", "lqg")
                ),
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
            "−{:.1f} % on the track any-line, mean of the five trainings (−{:.1f} to −{:.1f}; each of them "
            "between −{:.1f} and −{:.1f} %)",
            lambda: (
                *np.array(less("any-line", FIVE))[[0, 2, 1]],
                *ends(
                    [less("any-line", name)[0] for name in stored("any-line")["settings"]["trainings"][FIVE]]
                ),
            ),
        ),
        (
            "(−{:.1f} %) in {:.0f} % of passes ({:.0f} to {:.0f}), at most {:.1f} points behind it in any; "
            "of `repetitive` (−{:.1f} %) in all but one, by {:.1f} points",
            lambda: (
                less("any-line", ON_FAMILY)[0],
                *ahead("any-line", FIVE, ON_FAMILY),
                max(of_trainings(behind, "any-line", ON_FAMILY)),
                less("any-line", "repetitive")[0],
                max(of_trainings(behind, "any-line", "repetitive")),
            ),
        ),
        (
            "−{:.1f} % (−{:.1f} to −{:.1f}), ahead of `adaptive` in {:.0f} % of passes ({:.0f} to {:.0f})",
            lambda: (
                *np.array(less("any-line", "agent-any-line-five"))[[0, 2, 1]],
                *ahead("any-line", "agent-any-line-five", ON_FAMILY),
            ),
        ),
        (
            "at most {:.1f} points behind it; of `repetitive` and",
            lambda: [max(behind("any-line", "agent-any-line-five", ON_FAMILY))],
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
            "in each of the ten cells and in {:.0f} % of the {} passes, at most {:.1f} points behind in any",
            lambda: (
                ahead("unknown-line", "agent-any-pantograph", "repetitive")[0],
                len(passes("unknown-line", "repetitive")),
                max(behind("unknown-line", "agent-any-pantograph", "repetitive")),
            ),
        ),
        (
            "In every pass of both tracks σ is lower than passive, by {:.0f} % at least",
            lambda: [
                min(
                    -max(passes(track, "agent-any-pantograph").values())
                    for track in ("unknown-line", "unknown-section")
                )
            ],
        ),
        (
            "-{:.1f} % over all cells of the track high-speed-as-built (-{:.1f} to -{:.1f}), first at 337, "
            "350 and 400 km/h, {:.1f} and {:.1f} points behind `agent-any-pantograph` at 262 and 300",
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
            "passes; −{:.1f} % where",
            lambda: (
                *np.array(less("train-both", "agent-train"))[[0, 2, 1]],
                ahead("train-both", "agent-train", "repetitive")[0],
                less("train-trailing", "agent-train")[0],
            ),
        ),
        (
            "−{:.1f} % on the track train-trailing (−{:.1f} to −{:.1f}), first at each speed",
            lambda: np.array(less("train-trailing", "agent-trailing"))[[0, 2, 1]],
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


@pytest.mark.parametrize("page", SENTENCES)
def test_sentences_hold(page):
    text = re.sub(r"\s+", " ", (ROOT / page).read_text(encoding="utf-8").replace("*", ""))
    now = [sentence.format(*figures()) for sentence, figures in SENTENCES[page]]
    assert [sentence for sentence in now if sentence not in text] == []


def test_table_of_the_readme():
    assert of_readme() in (ROOT / "README.md").read_text(encoding="utf-8")
