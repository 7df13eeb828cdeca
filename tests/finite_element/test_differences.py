"""The simulator's lines at rest beside the finite elements: shapes, droppers, elasticity."""

import numpy as np
import pytest

from panto_env.plant.catenary.flexible.as_run import elasticity
from panto_env.plant.catenary.flexible.static import hang

from .differences import at_rest
from .rest import pairs_of
from .sections import STITCHED_330, sections, stitched
from .whole_line import ClosedLine, built

TILTED = {
    "sequence": [
        {"contact_height": 0.05, "encumbrance": 1.7},
        {"contact_height": 0.1, "stitch_wire": {"clamp_mass": 0.5}},
        {"contact_height": 0.05, "stitch_wire": {"length": 0.0}},
        {"contact_height": -0.05, "stitch_wire": {"length": 14.0, "tension": 2.5e3}},
    ],
    "end_support": {"contact_height": -0.2, "encumbrance": 1.65},
}
"""Both wires are cut on gradients, half a stitch wire with them."""


@pytest.mark.parametrize("name", [*sections(), "tilted"])
def test_lines_at_rest_are_the_same(name):
    """Heights and lengths within 0.5 mm, droppers' forces within 1 N; of every pair of wires."""
    line = stitched("re330", STITCHED_330 | TILTED) if name == "tilted" else sections()[name].line
    found = at_rest(line)
    assert max(found.contact, found.messenger, found.length) < 5e-4
    assert found.force < 1.0


@pytest.mark.longer
def test_elasticity_under_stitch_wires_is_the_same():
    """Of a force so small that every dropper stays taut."""
    line = sections()["some-stitched"].line
    places, yields = elasticity(line, 5.0)
    (pair,), shape = pairs_of(line), hang(line)
    closed = ClosedLine(pair.spans, pair.end, line.wires, 0.25)
    droppers = shape.dropper_length, shape.dropper_stiffness
    rest = built(closed, *droppers)
    for place in range(50, len(places) - 50, 23):
        node = int(np.searchsorted(rest.x, places[place]))
        lifts = []
        for each in (node - 1, node):
            lifted = built(closed, *droppers, pushed=(each, 5.0), at_arms=rest.contact[closed.masts])
            assert lifted.dropper_tension.min() > 0
            lifts.append((lifted.contact[each] - rest.contact[each]) / 5.0)
        theirs = np.interp(places[place], rest.x[node - 1 : node + 1], lifts)
        assert yields[place] == pytest.approx(theirs, rel=0.01)
