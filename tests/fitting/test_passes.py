"""Passes that go on from shortly before what differs give what passes from the line's start give."""

import numpy as np
import pytest

from panto_env.catalog import load_catenary, load_pantograph
from panto_env.fitting.passes import Passes, Variant
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics

from ..documents import ROOT

ROOM = LineCondition(dropper_scatter=5e-3, support_scatter=5e-3, tension_scatter=0.017)
DROPPER_SPANS, SUPPORT_SPANS = 3, 6


CLOSE = {"single": 5e-4, "double": 2e-4}
"""Largest difference, relative to the change of the force."""


@pytest.fixture(
    scope="module",
    params=[
        ("en50318-2002", "single"),
        (ROOT / "examples" / "overlap.toml", "single"),
        *(
            pytest.param((name, "double"), marks=pytest.mark.slow)
            for name in ("en50318-2002", "re250", ROOT / "examples" / "overlap.toml")
        ),
    ],
    ids=lambda case: f"{case[0]}, {case[1]}",
)
def passes(request):
    """On spans that are alike, and with an overlap of two contact wires."""
    name, precision = request.param
    line, pantograph = load_catenary(name), load_pantograph("dsa380")
    spans = line.spans if line.ends else 18
    distance = float(line.alignment(spans).support(spans - 2))
    own = Passes(
        line, pantograph, ROOM, 65.0, distance, spans, Numerics(accuracy="fast", precision=precision)
    )
    return line, pantograph, own, CLOSE[precision]


def test_they_give_what_whole_passes_give(passes):
    line, pantograph, own, close = passes
    random = np.random.default_rng(0)
    droppers_at, supports_at = own.layout.positions, np.array(own.layout.supports[1:-1])
    scatter, heights = 2e-3 * random.standard_normal(len(droppers_at)), np.zeros(len(supports_at))

    def variant(dropper=None, support=None):
        droppers, supports = scatter.copy(), heights.copy()
        if dropper is not None:
            droppers[dropper] += 5e-3
        if support is not None:
            supports[support] += 5e-3
        drawn = DrawnLine(ROOM, np.zeros((0, 3)), droppers, supports, (1.01, 0.99))
        return Variant(line, drawn, pantograph, pantograph.static_force)

    span = own.alignment.mean_length
    which = np.flatnonzero(droppers_at > 4.5 * span)[[0, 5, 16, -25]]
    support = int(np.flatnonzero(supports_at > 7 * span)[0])
    variants = [variant(), *(variant(dropper=k) for k in which), variant(support=support), variant()]
    places = [
        *(droppers_at[which] - DROPPER_SPANS * span),
        supports_at[support] - SUPPORT_SPANS * span,
        350.0,
    ]
    begins = np.array([0.0, *places])
    assert (begins[1:] > 0).all()
    whole, late = own.forces(variants), own.forces(variants, begins)
    for same in (0, -1):  # the same line goes on bit for bit
        np.testing.assert_array_equal(late[same], whole[0])
    change = np.abs(whole - whole[0]).max(axis=1)
    assert (change > 1).sum() >= 4  # in an overlap, the train may not touch the wire of one
    assert (np.abs(late - whole).max(axis=1) <= close * np.maximum(change, 1)).all()


@pytest.mark.longer
def test_lines_of_other_damping_have_plants_of_their_own_on_the_same_grid(passes):
    """Also where one call has several of them."""
    line, pantograph, own, _ = passes
    droppers, supports = np.zeros(len(own.layout.droppers)), np.zeros(len(own.layout.spans) - 1)
    drawn = DrawnLine(ROOM, np.zeros((0, 3)), droppers, supports)

    def variant(share):
        damping = line.damping.model_copy(update={"beta": share * line.damping.beta})
        catenary = line.model_copy(update={"damping": damping})
        return Variant(catenary, drawn, pantograph, pantograph.static_force)

    mixed = [variant(share) for share in (1.0, 1.2, 1.0, 0.7, 1.2)]
    together = own.forces(mixed, np.array([0.0, 0.0, 300.0, 300.0, 300.0]))
    for each, force in zip(mixed, together, strict=True):
        np.testing.assert_array_equal(force, own.forces([each])[0])
    assert np.abs(together[1] - together[0]).max() > 0.1
    assert np.abs(together[3] - together[0]).max() > 0.1
