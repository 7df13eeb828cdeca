"""Ice on the wires of a line that was built without it: at rest and under a train against finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.defects import DefectiveLine, with_tension_left
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.flexible.wires import rise_by_defects
from panto_env.plant.line_condition import LineCondition

from ..finite_element.hermite import matrices, uniform_load
from ..finite_element.static import GRAVITY
from ..finite_element.system import _placement, build
from .test_flexible import under_a_train
from .test_uneven import MIXED, line_of

of_defects = python_function(rise_by_defects)
EN50318 = "en50318-2002"
LINES = [EN50318, "benchmark-2015", "re250"]


def iced(data, spans, element, ice):
    """Finite elements of a line on whose wires ice lies: a load and a mass, on the line as it was built."""
    system = build(data, spans, element)
    size, load, mass = system.free.size, np.zeros(system.free.size), 0 * system.mass
    for first in (0, 2):  # messenger, contact wire
        place = _placement(size, 4 * np.arange(len(system.nodes))[:, None] + [first, first + 1])
        load -= place @ uniform_load(system.nodes, ice * GRAVITY)
        coat = data.contact_wire.model_copy(update={"mass": ice})
        mass = mass + place @ matrices(system.nodes, coat)[1] @ place.T
    keep = diags_array(system.free)
    change = spsolve((system.stiffness + diags_array(1 - system.free)).tocsc(), system.free * load)
    tension = system.dropper_tension + system.dropper_stiffness * (system.extension @ change)
    assert (tension > 0).all()
    return replace(
        system,
        static=system.static + change.reshape(-1, 4)[:, 2:],
        mass=(system.mass + keep @ mass @ keep).tocsr(),
        damping=(system.damping + data.damping.alpha * (keep @ mass @ keep)).tocsr(),
        dropper_tension=tension,
    )


@pytest.mark.parametrize("name", LINES)
@pytest.mark.parametrize("ice", [0.3, 1.0])
def test_static_state_agrees_with_finite_elements(name, ice):
    data, spans = load_catenary(name), 10
    condition = LineCondition(ice=ice)
    whole, other = build(data, spans, 0.1), iced(data, spans, 0.1, ice)
    line = DefectiveLine(data.layout(spans), condition)
    state = line.solve()
    inner = (whole.nodes > 3 * data.span_length) & (whole.nodes < 7 * data.span_length)
    own = slice(3 * len(data.droppers.positions), 7 * len(data.droppers.positions))
    start = build(with_tension_left(data, condition), spans, 0.1).static[:, 0]
    ours = start + [of_defects(state.rise, line.breaks, line.decay, x) for x in whole.nodes]
    np.testing.assert_allclose(ours[inner], other.static[inner, 0], atol=2e-4)
    np.testing.assert_allclose(state.tension[own], other.dropper_tension[own], atol=0.5)
    assert np.abs(ours - whole.static[:, 0])[inner].max() > 0.05 * ice


@pytest.mark.parametrize("name", LINES)
def test_droppers_and_supports_carry_the_wires_and_the_ice(name):
    """Forces balance: a span's droppers and its steady arm hold the contact wire's weight and its ice's."""
    data, spans, ice = load_catenary(name), 12, 0.8
    line = DefectiveLine(data.layout(spans), LineCondition(ice=ice))
    state, designed, droppers = line.solve(), solve(data), data.droppers
    own = slice(5 * len(droppers.positions), 6 * len(droppers.positions))
    at_mast = 5 * data.span_length
    left = solve(with_tension_left(data, LineCondition(ice=ice)))
    sunk = designed.contact.height(np.zeros(1))[0] - left.contact.height(np.zeros(1))[0]
    sunk -= of_defects(state.rise, line.breaks, line.decay, at_mast)
    arm = designed.arm_force + data.steady_arm.stiffness * sunk
    hung = GRAVITY * (designed.dropper_mass / 2 + droppers.contact_clamp_mass).sum()
    weight = GRAVITY * (data.contact_wire.mass + ice) * data.span_length
    assert state.tension[own].sum() + arm == pytest.approx(weight + hung, rel=1e-5)


def test_both_wires_together_carry_the_ice_between_droppers():
    """Closed form: where taut droppers hold both together, T_c y_c + T_m y_m bends by the ice on both."""
    base = load_catenary(EN50318)
    wires = {
        name: getattr(base, name).model_copy(update={"bending_stiffness": 0.0})
        for name in ("contact_wire", "messenger_wire")
    }
    arm = base.steady_arm.model_copy(update={"holds_wire": False, "stiffness": 0.0})
    many = tuple(np.arange(1.0, 60.0, 2.0).tolist())
    hung = base.droppers.model_copy(update={"positions": many, "sag": (0.0,) * len(many), "stiffness": 1e8})
    data = base.model_copy(update={"droppers": hung, "steady_arm": arm, **wires})
    line = DefectiveLine(data.layout(20), LineCondition(ice=0.5))
    left = solve(with_tension_left(data, LineCondition(ice=0.5))).contact
    x = 60 * 10 + np.array([1.0, 29.0])  # droppers, 29 and 1 m from mid-span
    now = left.height(x) + line.rise(line.solve()).height(x)
    was = solve(data).contact.height(x)
    tension = data.contact_wire.tension + data.messenger_wire.tension
    expected = 2 * 0.5 * GRAVITY / tension * (29**2 - 1**2) / 2
    assert (now - was)[0] - (now - was)[1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_under_a_train_it_is_the_finite_elements_line(monkeypatch):
    ice, mass = 0.4, load_catenary(EN50318).contact_wire.mass

    def changed(data, spans, element):
        return iced(data, spans, element, ice)

    condition = LineCondition(ice=ice)
    ours, theirs, bare, run, other = under_a_train(monkeypatch, changed, condition, 250.0, 3.05 * 60, 361.0)
    assert (ours - theirs).std() < 3.0
    assert (bare - theirs).std() > 9.0
    assert ours.std() == pytest.approx(theirs.std(), rel=0.02)
    np.testing.assert_allclose(run.uplift.max(axis=0)[3:5], other.uplift.max(axis=0)[3:5], atol=1e-3)
    dry = load_catenary(EN50318).contact_wire.wave_speed
    assert run.line.wave_speed == pytest.approx(dry * np.sqrt(mass / (mass + ice)))


def test_what_cannot_hang_or_has_no_wires_is_refused():
    with pytest.raises(
        InputError, match=r"would differ by 0.\d+ m in height, more than 0.5 m, in this line_c"
    ):
        simulate(EN50318, speed_kmh=100.0, line_condition={"ice": 3.0}, distance=100.0)
    with pytest.raises(InputError, match=r"must not differ in .* ice or temp"):
        simulate(line_condition=["new", {"ice": 0.3}])


def test_spans_that_differ_bear_ice_as_finite_elements_say():
    data, ice = line_of(MIXED), 0.6
    condition, spans = LineCondition(ice=ice), len(MIXED)
    other, line = iced(data, spans, 0.1, ice), DefectiveLine(data.layout(spans), condition)
    state, begins = line.solve(), data.alignment().supports
    ours = solve(with_tension_left(data, condition)).contact.height(other.nodes)
    ours = ours + line.rise(state).height(other.nodes)
    inner = (other.nodes > begins[3]) & (other.nodes < begins[-4])
    np.testing.assert_allclose(ours[inner], other.static[inner, 0], atol=5e-4)
    droppers = data.layout().positions
    own = (droppers > begins[3]) & (droppers < begins[-4])
    np.testing.assert_allclose(state.tension[own], other.dropper_tension[own], atol=0.5)
