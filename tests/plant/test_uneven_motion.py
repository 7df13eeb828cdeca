"""Trains on lines whose spans differ, beside finite elements of the whole line.

``python -m tests.finite_element --sections`` prints what is compared here, and draws it.
"""

import pytest

from panto_env.catalog import load_catenary, load_pantograph

from ..finite_element import __main__ as comparison
from ..finite_element.figures import figures
from ..finite_element.sections import Section, sections
from ..marks import some_in_proofs

SECTIONS = sections()
IN_PROOFS = ("both", "stitched-330", "overlap-2002")
"""One of each kind, and "both" is "mixed" under "bridge". The others are compared in `make studies`."""


@pytest.mark.slow
def test_contact_force_and_uplift_on_unlike_spans_are_those_of_finite_elements():
    agrees(SECTIONS["mixed"], element=1.0)


@pytest.mark.parametrize("name", some_in_proofs(SECTIONS, IN_PROOFS))
def test_every_section_agrees_with_fine_finite_elements(name):
    agrees(SECTIONS[name], element=0.25)


@pytest.mark.slow
def test_both_codes_are_printed_and_drawn_section_by_section(monkeypatch, tmp_path, capsys):
    line = load_catenary("en50318-2002").model_copy(update={"spans": 5})
    short = Section(line, load_pantograph("en50318-2002"), 250.0, spans=(2, 3))
    monkeypatch.setattr(comparison, "sections", lambda: {"short": short})
    monkeypatch.setenv("COLUMNS", "150")
    comparison.compare_sections("short", tmp_path / "pictures")
    rows = [line.split("│") for line in capsys.readouterr().out.splitlines() if "short" in line]
    ours, theirs = ([float(each) for each in row[3:7] + row[7].split()] for row in rows)
    assert ours == pytest.approx(theirs, abs=1.5)
    assert len(ours) == 4 + 3
    assert (tmp_path / "pictures" / "short.png").read_bytes().startswith(b"\x89PNG")
    agrees(short, element=0.5)


def agrees(section, element):
    """Sigma within 2 %; mean, maximum, minimum within 2 % of the mean; uplift at each support within 1 mm."""
    ours = figures(section.by_simulator(), section.spans)
    theirs = figures(section.by_finite_elements(element), section.spans)
    near = 0.02 * theirs.mean
    assert ours.std == pytest.approx(theirs.std, rel=0.02)
    assert ours.mean == pytest.approx(theirs.mean, abs=near)
    assert ours.maximum == pytest.approx(theirs.maximum, abs=near)
    assert ours.minimum == pytest.approx(theirs.minimum, abs=near)
    assert len(ours.uplifts_mm) == section.spans[1] - section.spans[0] + 2
    assert ours.uplifts_mm == pytest.approx(theirs.uplifts_mm, abs=1.0)
