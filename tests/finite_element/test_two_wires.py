"""The simulator's two contact wires beside finite elements of both (``twin.py``).

``python -m tests.finite_element --twin`` prints what is compared here, and the equivalent wire.
"""

from dataclasses import replace

import numpy as np
import pytest

from panto_env import simulate

from ..marks import some_in_proofs
from .figures import figures
from .twin import ALTERNATING, paired, section, train_along_twins, two_wires

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
    behind = [BEHIND] * (count - 1)
    train = {"pantographs": [one.pantograph] * 2, "distances": behind} if behind else {}
    run = simulate(
        two_wires(one.line),
        one.pantograph,
        speed,
        distance=one.distance + sum(behind),
        window=0,
        record_droppers=False,
        **train,
    )
    return one, run.train, train_along_twins(one, ALTERNATING, behind, time_step=5e-4)


@pytest.mark.parametrize("name", some_in_proofs(CASES, IN_PROOFS))
def test_figures_of_both_wires_are_those_of_finite_elements(name):
    """Sigma, and the uplift of each wire at each support, within 3 %, extremes within 3 % of the mean force."""
    one, ours, theirs = made(name)
    for run, judged in zip(ours, theirs, strict=True):
        own, other = figures(run, one.spans), figures(judged, one.spans)
        assert own.mean == pytest.approx(other.mean, rel=0.002)
        assert own.std == pytest.approx(other.std, rel=0.03)
        for key in ("maximum", "minimum"):
            assert getattr(own, key) == pytest.approx(getattr(other, key), abs=0.03 * own.mean), key
        assert own.loss_percent == pytest.approx(other.loss_percent, abs=0.5)
    supports = slice(one.spans[0] - 2, one.spans[1])
    for uplift, judged in zip(
        *(np.split(each[0].uplift.max(axis=0), 2) for each in (ours, theirs)), strict=True
    ):
        np.testing.assert_allclose(uplift[supports], judged[supports], rtol=0.03)
