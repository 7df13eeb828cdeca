"""docs/evidence.md shows what ``python -m tests.spanish_lines`` prints."""

import pytest

from ..pages import check_page, tables_of
from ..spanish_lines import LINES, made, tables, yields


@pytest.mark.parametrize("name", [name for name, own in LINES.items() if own.elasticity is not None])
def test_the_page_shows_the_elasticity_of_a_line(name):
    _, rows = tables_of("evidence.md")["Elasticity at 100 N, mid-span / support (mm/N)"]
    (row,) = (row for row in rows if row[0] == name)
    cases = {2: (False, False), 4: (True, False)} | ({3: (False, True)} if LINES[name].wires == 2 else {})
    for column, case in cases.items():
        assert [float(each) for each in row[column].split(" / ")] == pytest.approx(
            yields(name, *case), abs=6e-4
        )


def test_arms_are_the_pendulums_of_the_source():
    """Its form: 4 b T / L over the length, 336 N/m on C-350 and 433 N/m on SICAT, and 0.76 kg."""
    for name, stiffness in (("C-350", 336), ("SICAT H1.0", 433)):
        line = made(name, arm=True)
        assert 4 * line.plan.stagger[
            0
        ] * line.contact_wire.tension / line.span_length / 1.15 == pytest.approx(stiffness, rel=0.005)
    assert pytest.approx(0.76) == 0.9 / 3 + 0.46


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::panto_env.base.errors.AccuracyWarning")
def test_the_page_shows_what_the_command_prints():
    check_page("evidence.md", {table.title: table for table in tables()})
