"""The simulator's two contact wires beside finite elements of both (``twin.py``).

``python -m tests.finite_element --twin`` prints what is compared here, and the equivalent wire.
"""

from dataclasses import replace

import numpy as np
import pytest

from ..marks import some_in_proofs
from .contacts import Collector
from .figures import figures
from .trains import Case
from .twin import ALTERNATING, mirrored, paired, section, train_along_twins, two_wires

BEHIND = 100.0  # m, of the second of two pantographs
CASES = {
    "far apart, 120 km/h": (120.0, "far apart", 1),
    "far apart, 160 km/h": (160.0, "far apart", 1),
    "far apart, two at 160 km/h": (160.0, "far apart", 2),
    "far apart, two at 200 km/h": (200.0, "far apart", 2),
    "in pairs, 160 km/h": (160.0, "in pairs", 1),
    "in pairs, 200 km/h": (200.0, "in pairs", 1),
    "in pairs, two at 160 km/h": (160.0, "in pairs", 2),
    "in pairs, two at 200 km/h": (200.0, "in pairs", 2),
}
IN_PROOFS = ("far apart, 160 km/h",)


def made(name):
    """Section, runs of its collectors by the simulator, and by the judge."""
    speed, droppers, count = CASES[name]
    one = replace(section(speed), element=0.5 if count == 1 else 0.25)  # waves from train to train are short
    if droppers == "in pairs":
        one = replace(one, line=paired())
    behind = (BEHIND,) * (count - 1)
    collectors = tuple(Collector(one.pantograph, each) for each in (0.0, *behind))
    ours = Case(mirrored(two_wires(one.line)), collectors, speed, one.spans).by_simulator()
    return one, ours, train_along_twins(one, ALTERNATING, behind, time_step=5e-4)


@pytest.mark.parametrize("name", some_in_proofs(CASES, IN_PROOFS))
def test_figures_of_both_wires_are_those_of_finite_elements(name):
    """Sigma and the uplift of each wire at each support within 2 %, extremes within 2 % of the mean force."""
    one, ours, theirs = made(name)
    for run, judged in zip(ours, theirs, strict=True):
        own, other = figures(run, one.spans), figures(judged, one.spans)
        assert own.mean == pytest.approx(other.mean, rel=0.002)
        assert own.std == pytest.approx(other.std, rel=0.02)
        for key in ("maximum", "minimum"):
            assert getattr(own, key) == pytest.approx(getattr(other, key), abs=0.02 * own.mean), key
        assert own.loss_percent == pytest.approx(other.loss_percent, abs=0.5)
    supports = slice(one.spans[0] - 2, one.spans[1])
    for uplift, judged in zip(
        *(np.split(each[0].uplift.max(axis=0), 2) for each in (ours, theirs)), strict=True
    ):
        np.testing.assert_allclose(uplift[supports], judged[supports], rtol=0.02)
