"""All that a run gives in a travelling window beside the whole line, on lines of each kind."""

import pytest

from ..every_output import cases, differences

CASES = cases()
DROPPERS = {"uniform, `en50318-2002`": 3.5}
"""Bound of the largest force of a dropper (N) where it is not 3: 8 spans take 3.4 N of 221 at any step."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_every_output_in_a_window_is_that_of_the_whole_line(name):
    """Droppers ahead of the train too: there new spans come in."""
    found = differences(*CASES[name])
    assert abs(found["σ (%)"]) < 1
    assert max(abs(found["max (% of F_m)"]), abs(found["min (% of F_m)"])) < 1
    assert abs(found["force, 20 Hz (N)"]) < 10.5
    for key in ("wire (mm)", "head (mm)", "frame (mm)"):
        assert abs(found[key]) < 2.5, key
    assert abs(found["largest uplift (mm)"]) < 0.5
    assert found["the same within two spans of the train (mm)"] < 3.5
    assert abs(found["largest dropper force (N)"]) < DROPPERS.get(name, 3)
    whole = found["the same on the whole line"]
    assert found["dropper ahead of the train (N over rest)"] == pytest.approx(
        whole, abs=0.5 if name.startswith("uniform") else 5
    )


@pytest.mark.slow
def test_a_long_pass_on_a_stitched_line_has_no_forces_of_its_own_ahead():
    """Waves ahead of the train grow on the way; 314 N stood there where the whole line has 16 N."""
    found = differences(*CASES["stitched, EAC-350"], last=36)
    assert found["dropper ahead of the train (N over rest)"] < 20
    assert abs(found["largest dropper force (N)"]) < 3
    assert abs(found["σ (%)"]) < 1
