"""The finite elements themselves on unlike spans: against equal ones, and tilted ones."""

import numpy as np
import pytest

from panto_env.catalog import load_catenary

from .rest import at_rest
from .sections import line_of, sections
from .simulation import figures, simulate, stretch
from .system import build

SECTIONS = sections()


def test_every_support_arm_and_dropper_is_its_own_span_s():
    """Where each value stands in the matrices, less those of a line without it."""
    own = {
        "support": {"stiffness": 4e5, "damping": 700.0},
        "steady_arm": {"mass": 2.0, "stiffness": 900.0},
        "droppers": {"positions": [6.0, 19.0, 33.0], "stiffness": 8e4, "contact_clamp_mass": 0.3},
        "span_length": 45.0,
    }
    line = line_of("en50318-2002", {"sequence": [{}, own, {}, {}]})
    system, (rest,) = build(line, 4, 1.0), at_rest(line, 4, 1.0)
    assert system.support_position.tolist() == [60.0, 105.0, 165.0]
    places = rest.nodes[rest.droppers]
    assert places[9:12] == pytest.approx([66.0, 79.0, 93.0], abs=1e-9)
    assert system.dropper_stiffness.tolist() == [1e5] * 9 + [8e4] * 3 + [1e5] * 18

    def added(key, unknown):
        """Diagonal of a matrix at the unknowns of the first two interior supports."""
        bare = build(line_of("en50318-2002", {"sequence": [{}, plain, {}, {}]}), 4, 1.0)
        return (getattr(system, key) - getattr(bare, key)).diagonal()[4 * rest.masts + unknown].tolist()

    plain = own | {"support": {}, "steady_arm": {}}
    assert added("stiffness", 0) == pytest.approx([4e5 - 5e5, 0, 0], abs=1e-6)
    assert added("damping", 0) == pytest.approx([700.0 - 1000.0, 0, 0], abs=1e-6)
    assert added("stiffness", 2) == pytest.approx([900.0, 0, 0], abs=1e-6)
    assert added("mass", 2) == pytest.approx([2.0, 0, 0], abs=1e-9)


def test_a_line_on_a_gradient_is_the_level_one_tilted():
    """Wires are nearly level: a tilt changes no force. The ends go on at the gradient."""
    heights = [0.05 * k for k in range(7)]
    tilted = line_of(
        "re250",
        {"sequence": [{"contact_height": h} for h in heights[:-1]], "end_support": {"contact_height": 0.3}},
    )
    level = load_catenary("re250").model_copy(update={"spans": 6})
    (one,), (other,) = at_rest(tilted, 6, 0.5), at_rest(level, 6, 0.5)
    np.testing.assert_allclose(one.contact[:, 0] - 0.05 / 65 * one.nodes, other.contact[:, 0], atol=1e-9)
    np.testing.assert_allclose(one.contact[:, 1] - 0.05 / 65, other.contact[:, 1], atol=1e-9)
    np.testing.assert_allclose(one.dropper_tension, other.dropper_tension, atol=1e-5)
    np.testing.assert_allclose(one.dropper_length, other.dropper_length, atol=1e-8)
    with pytest.raises(ValueError, match="14 spans, not 12"):
        build(SECTIONS["mixed"].line, 12, 1.0)


def test_figures_of_a_stretch_are_those_of_its_spans():
    section = SECTIONS["mixed"]
    run = simulate(
        section.line, section.pantograph, section.speed_kmh, element=2.0, time_step=2e-3, distance=270
    )
    supports = section.line.alignment().supports
    assert run.support_position == pytest.approx(supports[1:-1], abs=1e-9)
    some = figures(run, (2, 4))
    assert stretch(run, supports[1], supports[4]) == some
    assert some.uplifts_mm == pytest.approx((1e3 * run.uplift[:, :4].max(axis=0)).tolist())
    first, second = (stretch(run, a, b) for a, b in ((60.0, 140.0), (140.0, 228.0)))
    assert some.maximum == max(first.maximum, second.maximum)
    assert some.minimum == min(first.minimum, second.minimum)
    with pytest.raises(ValueError, match="no stretch from"):
        figures(run, (4, 6))
