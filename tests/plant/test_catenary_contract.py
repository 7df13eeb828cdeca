"""What every kind of catenary promises a kernel, by the operations of ``plant.catenary.protocol``."""

import numpy as np
import pytest

from panto_env.backend import kernel
from panto_env.catalog import load_catenary
from panto_env.plant.catenary import CATENARIES
from panto_env.plant.catenary.protocol import advance_wire, apply_force, look_at_contact, place_contact
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics, Runs

pytestmark = pytest.mark.plain


@kernel
def press(line, wire, x, force, seen):
    """Wire height and its yield at x before a force is applied there, and the height afterwards."""
    place_contact(line, wire, 0, 0, x)
    advance_wire(line, wire, 0)
    seen[0], seen[1], _, _ = look_at_contact(line, wire, 0, 0, x)
    apply_force(line, wire, 0, 0, x, force)
    seen[2], _, _, _ = look_at_contact(line, wire, 0, 0, x)


@pytest.mark.parametrize("x", [40.17, 40.5])
@pytest.mark.parametrize("name", ["en50318-2002", "ohl-three-span"])
def test_the_wire_yields_to_a_force_as_it_was_said_to(name, x):
    """The contact law solves for the force with this yield: or else gap and force would not agree."""
    data, condition = load_catenary(name), LineCondition()
    numerics = Numerics(precision="double", window=3) if data.kind == "flexible" else Numerics()
    model = CATENARIES[data.kind].model(data, lanes=1, collectors=1, spans=10, numerics=numerics, runs=Runs())
    model.settle(0, DrawnLine(condition), 150.0)
    force, seen = 90.0, np.zeros(3)
    press(model.line, model.wire, x, force, seen)
    assert seen[1] != 0
    assert seen[2] - seen[0] == pytest.approx(seen[1] * force, rel=1e-8)
