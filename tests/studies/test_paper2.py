"""Paper 2's study, and the pages that show its statements and tables."""

import pytest

from panto_env.studies import write

from ..pages import check_page, check_statements, statements_table, tables_of
from . import made

PAGE, OTHER_PAGE, STATEMENTS = "paper2.md", "paper2-diagnosis.md", "The paper's words beside ours"
LEFT_TO_THE_COMMAND = (
    "Amplitude of the contact force's harmonics",
    "Proportional control",
    "What the loop of rig bears",
    "Estimated force,",
    "Noise, velocities' in proportion",
    "Noticed, and within a dropper interval, by severity",
    "Taken for (%), mean of 3",
    "Motors of at most 50 N",
    "Motors at 300 km/h",
    "Parameters from one pass",
    "own-two-mass on en50318-2002, ideal actuator on the frame",
)
"""What titles of tables begin with that no page shows."""
pytestmark = pytest.mark.study


@pytest.fixture(scope="module")
def outcome():
    return made("paper2")


def test_the_pages_show_what_the_study_prints(outcome):
    printed = {each.title: each for each in outcome.tables}
    headings = ("statement", "unit", "ours", "the paper", "agrees")
    printed[STATEMENTS] = statements_table(STATEMENTS, headings, outcome)
    shown = tables_of(PAGE)
    left = {title for title in printed if title.startswith(LEFT_TO_THE_COMMAND)}
    assert set(printed) - set(shown) - set(tables_of(OTHER_PAGE)) == left
    check_statements(PAGE, STATEMENTS, outcome)
    for page in (PAGE, OTHER_PAGE):
        check_page(page, printed)


def test_figures_and_numbers_are_written(outcome, tmp_path):
    names = {path.name for path in write(outcome, tmp_path)}
    names_of = ("fig11-displacements-and-velocities", "fig12-displacements", "fig14-15-bench", "closed-loop")
    others = ("fig05-08-rig", "estimator-delay", "diagnosis", "diagnosis-false-alarms")
    assert names == {"numbers.json", *(f"{name}.png" for name in (*names_of, *others))}
