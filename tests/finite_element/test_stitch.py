"""Stitch wires in the finite elements: closed forms, and where each stands in the matrices."""

import numpy as np
import pytest

from panto_env.catalog import load_catenary

from .rest import at_rest
from .sections import BARE, STITCHED_330, stitched
from .static import GRAVITY, static_shape
from .system import build

CLAMPED = STITCHED_330 | {"stitch_wire": STITCHED_330["stitch_wire"] | {"clamp_mass": 0.4}}
DROPPERS = {"mass": 0.1, "contact_clamp_mass": 0.2, "messenger_clamp_mass": 0.3}


def test_a_stitch_wire_hangs_as_a_string_under_two_droppers():
    """From the clamp at 9 m its slope carries the dropper at 5 m and its own weight up to the middle."""
    line, x = stitched("re330", CLAMPED), load_catenary("re330").droppers.positions
    table = {"positions": x, "sag": (0.0,) * len(x)}  # one on either side between the clamps
    line = line.model_copy(update={"droppers": line.droppers.model_copy(update=DROPPERS | table)})
    shape, stitch, droppers = static_shape(line, 0.5), line.stitch_wire, line.droppers
    below = shape.dropper_tension[0] + GRAVITY * (
        droppers.mass * shape.dropper_length[0] / 2 + droppers.messenger_clamp_mass
    )

    def sag(x):
        """Below the clamp, at x (m) from the support beyond the dropper (m)."""
        weight = stitch.mass * GRAVITY
        return ((below + weight * 9.0) * (9.0 - x) - weight * (9.0 - x) ** 2 / 2) / stitch.tension

    def at(x):
        return int(np.abs(shape.x - x).argmin())

    clamp = shape.hanger[at(9.0)]
    assert clamp == shape.messenger[at(9.0)]
    for x in (8.0, 7.0, 5.0):
        assert clamp - shape.hanger[at(x)] == pytest.approx(sag(shape.x[at(x)]), abs=1e-9)
    # Inside of both droppers it hangs in a parabola of its own.
    deepest = stitch.mass * GRAVITY * 5.0**2 / (2 * stitch.tension)
    assert shape.hanger[at(5.0)] - shape.hanger[0] == pytest.approx(deepest, abs=1e-9)


def test_every_support_has_its_own_span_s_stitch_wire_and_the_ends_have_none_in_motion():
    """Droppers hang from it between its clamps, elsewhere from the messenger; clamps' masses are there."""

    def line_of(clamp_mass, other, dropper_clamp=0.0):
        usual = {"stitch_wire": STITCHED_330["stitch_wire"] | {"clamp_mass": clamp_mass}}
        sequence = [{}, {}, {"stitch_wire": {"length": 12.0, "clamp_mass": other}}, BARE, {}]
        line = stitched("re330", usual | {"sequence": sequence})
        droppers = {"messenger_clamp_mass": dropper_clamp}
        return stitched(
            "re330", usual | {"sequence": [{"droppers": droppers} | span for span in line.sequence]}
        )

    line = line_of(0.4, 1.0)
    system, (rest,) = build(line, 5, 1.0), at_rest(line, 5, 1.0)
    rows = (system.extension[[k]] for k in range(len(rest.droppers)))
    upper_end = np.array([row.indices[row.data > 0][0] for row in rows])
    x = rest.nodes[rest.droppers]
    within = (abs(x - 65) < 9) | (abs(x - 130) < 6) | (abs(x - 260) < 9)
    assert (upper_end >= 4 * rest.nodes.size).tolist() == within.tolist()
    assert within.sum() == 10  # at 12 m only those at 2.5 m
    assert upper_end[~within].tolist() == (4 * rest.droppers[~within]).tolist()

    def heavier(*more):
        """Unknowns whose mass is less without something, and by how much."""
        added = (build(line_of(*more), 5, 1.0).mass - build(line_of(0.0, 0.0), 5, 1.0).mass).diagonal()
        return np.flatnonzero(abs(added) > 1e-9), added[abs(added) > 1e-9]

    where, by = heavier(0.4, 1.0)
    assert (where % 4 == 0).all()
    assert rest.nodes[where // 4] == pytest.approx([56, 74, 124, 136, 251, 269])
    assert by == pytest.approx([0.4, 0.4, 1.0, 1.0, 0.4, 0.4])
    where, by = heavier(0.0, 0.0, 0.3)
    assert where.tolist() == sorted(upper_end)
    assert by == pytest.approx(0.3)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="more tension than the messenger"):
        static_shape(stitched("re250", {"stitch_wire": {"length": 18.0, "tension": 16e3, "mass": 0.3}}))
    close = stitched(
        "re330", STITCHED_330 | {"sequence": [{}, {"span_length": 15.0, "droppers": {"spacing": 5}}, {}]}
    )
    with pytest.raises(ValueError, match="stitch wires at 65 and 80 m overlap"):
        at_rest(close, 3, 1.0)
