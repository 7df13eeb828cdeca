"""The finite elements themselves on unlike spans: against equal ones, closed forms, energy, convergence."""

import numpy as np
import pytest

from panto_env.catalog import load_catenary, load_pantograph

from ..marks import some_at_once
from .contacts import Collector
from .energy import balance
from .rest import at_rest
from .sections import STITCHED_330, line_of, of_catalogue, sections, stitched
from .simulation import figures, simulate, stretch
from .system import build

SECTIONS = sections()


EQUAL = ("en50318-2002", "benchmark-2015", "re330, stitched")


@pytest.mark.slow
@pytest.mark.parametrize("name", some_at_once(EQUAL, ["en50318-2002"]))
def test_equal_spans_of_a_sequence_move_as_one_span_repeated(name):
    """The shape of a whole line, with half a stitch wire at its ends, and of a periodic span."""
    spans, changes, make, pantograph = 7, {}, line_of, name
    if name == "re330, stitched":
        own = STITCHED_330["stitch_wire"] | {"clamp_mass": 0.4}
        spans, changes, make, name, pantograph = 5, {"stitch_wire": own}, stitched, "re330", "cx"
    line = make(name, changes)
    unlike = [{}] * (spans - 4) + [{"encumbrance": line.encumbrance + 1e-9}] + [{}] * 3
    many = make(name, changes | {"sequence": unlike})  # one that is all alike would be the uniform line again
    assert many.sequence
    one, other = (simulate(each, load_pantograph(pantograph), 250.0, spans=spans) for each in (line, many))
    for key in ("position", "contact_force", "head", "wire", "uplift", "support_position", "dropper_tension"):
        expected = getattr(one, key)
        np.testing.assert_allclose(getattr(other, key), expected, rtol=0, atol=1e-6 * np.abs(expected).max())


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


@pytest.mark.parametrize("name", ["mixed", "bridge", "both", "stitched-250"])
def test_the_wire_is_at_its_wanted_height_at_droppers(name):
    line = SECTIONS[name].line
    (rest,), layout = at_rest(line, line.spans, 1.0), line.layout()
    spans, heights = layout.spans, layout.contact_heights
    supports = np.append(0.0, np.cumsum([span.span_length for span in spans]))
    x = rest.nodes[rest.droppers]
    wanted = np.interp(x, supports, heights) - np.concatenate([span.droppers.sag for span in spans])
    np.testing.assert_allclose(rest.contact[rest.droppers, 0], wanted, atol=1e-12)
    assert np.ptp(wanted) > 0.015


def test_a_line_on_a_gradient_is_the_level_one_tilted():
    """Wires are nearly level: a tilt changes no force. The ends go on at the gradient."""
    heights = [0.05 * k for k in range(7)]
    tilted = line_of(
        "re250",
        {"sequence": [{"contact_height": h} for h in heights[:-1]], "end_support": {"contact_height": 0.3}},
    )
    level = of_catalogue("re250").model_copy(update={"spans": 6})
    (one,), (other,) = at_rest(tilted, 6, 0.5), at_rest(level, 6, 0.5)
    np.testing.assert_allclose(one.contact[:, 0] - 0.05 / 65 * one.nodes, other.contact[:, 0], atol=1e-9)
    np.testing.assert_allclose(one.contact[:, 1] - 0.05 / 65, other.contact[:, 1], atol=1e-9)
    np.testing.assert_allclose(one.dropper_tension, other.dropper_tension, atol=1e-5)
    np.testing.assert_allclose(one.dropper_length, other.dropper_length, atol=1e-8)
    with pytest.raises(ValueError, match="14 spans, not 12"):
        build(SECTIONS["mixed"].line, 12, 1.0)


@pytest.fixture(scope="module")
def climbing():
    """Mean force (N) and head (m) on a line that climbs 0.36 m at 2 per mille, less those on a level one."""
    heights = [0.0] * 3 + [0.12, 0.24] + [0.36] * 7
    uneven = line_of("en50318-2002", {"sequence": [{"contact_height": height} for height in heights]})
    level = load_catenary("en50318-2002").model_copy(update={"spans": len(heights)})

    def differences(pantograph, first, last):
        runs = [simulate(line, pantograph, 250.0, element=2.0, time_step=2e-3) for line in (level, uneven)]
        inside = (runs[0].position >= 60.0 * (first - 1)) & (runs[0].position < 60.0 * last)
        return [(getattr(runs[1], key) - getattr(runs[0], key))[inside].mean() for key in FORCE_AND_HEAD]

    return differences


FORCE_AND_HEAD = ("contact_force", "head")


@pytest.mark.slow
def test_uphill_the_damping_to_ground_takes_c_v_g(climbing):
    """dsa380: 70 N s/m, hardly a spring."""
    force, _ = climbing(load_pantograph("dsa380"), 4, 5)
    assert force == pytest.approx(-70.0 * 250 / 3.6 * 0.12 / 60, rel=0.02)  # -9.7 N


@pytest.mark.slow
def test_high_up_the_spring_to_ground_takes_k_h(climbing):
    """en50318-2002: 50 N/m. With less force the head stands a little lower, and the frame nearer to it."""
    pantograph = load_pantograph("en50318-2002")
    force, head = climbing(pantograph, 8, 10)
    ground, between = pantograph.stiffnesses[-1], pantograph.stiffnesses[0]
    assert head == pytest.approx(0.36, abs=0.02)
    assert force == pytest.approx(-ground * head / (1 + ground / between), abs=0.15)
    assert -18.0 < force < -16.5


@pytest.mark.slow
def test_energy_is_balanced_under_a_bridge():
    section = SECTIONS["bridge"]
    found = balance(section.line, [Collector(section.pantograph)], section.speed_kmh, distance=500.0)
    assert found.steps_with_slack > 0
    assert found.error < 1e-3 * found.turnover


@pytest.mark.longer
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
