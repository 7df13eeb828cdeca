"""Paper 2's study, and the page that shows its statements and tables."""

import pytest

from panto_env.studies import write

from ..pages import check_page, statements_table, tables_of
from . import made

PAGE, STATEMENTS = "paper2.md", "The paper's words beside ours"
pytestmark = pytest.mark.study


@pytest.fixture(scope="module")
def outcome():
    return made("paper2")


def test_the_page_shows_what_the_study_prints(outcome):
    printed = {each.title: each for each in outcome.tables}
    headings = ("statement", "unit", "ours", "the paper", "agrees")
    printed[STATEMENTS] = statements_table(STATEMENTS, headings, outcome)
    shown = tables_of(PAGE)
    assert set(shown) >= {title for title in printed if not title.startswith("Proportional control")}
    assert len(shown[STATEMENTS][1]) == len(outcome.comparisons)
    check_page(PAGE, printed)


def test_figures_and_numbers_are_written(outcome, tmp_path):
    names = {path.name for path in write(outcome, tmp_path)}
    figures = {
        "fig05-08-rig",
        "fig11-displacements-and-velocities",
        "fig12-displacements",
        "estimator-delay",
        "diagnosis",
        "diagnosis-false-alarms",
        "fig14-15-bench",
        "closed-loop",
    }
    assert names == {"numbers.json", *(f"{name}.png" for name in figures)}
