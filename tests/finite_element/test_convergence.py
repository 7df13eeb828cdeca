"""The judge is judged: its figures of every section with half of the element and half of the step."""

import pytest

from ..marks import some_in_proofs
from .figures import figures
from .sections import sections


@pytest.mark.parametrize("name", some_in_proofs(sections(), ["stitched-330"]))
def test_half_of_element_and_step_change_the_figures_little(name):
    """Extremes by a share of the mean force: the minimum converges last."""
    section = sections()[name]
    runs = (section.by_finite_elements(share * section.element) for share in (1.0, 0.5))
    coarse, fine = (figures(run, section.spans) for run in runs)
    assert (coarse.std, coarse.mean) == pytest.approx((fine.std, fine.mean), rel=0.005)
    extremes = coarse.maximum, coarse.minimum
    assert extremes == pytest.approx((fine.maximum, fine.minimum), abs=0.012 * fine.mean)
    assert coarse.uplifts_mm == pytest.approx(fine.uplifts_mm, abs=0.25)
