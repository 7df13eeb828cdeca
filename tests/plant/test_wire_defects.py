"""Hard spots, worn stretches, lost tension and ice: at rest and under a train against finite elements."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.metrics.low_pass import zero_phase_low_pass
from panto_env.plant.catenary.flexible.defects import DefectiveLine, with_tension_left
from panto_env.plant.catenary.flexible.resolution import HARD_SPOT_GRID
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.flexible.wire_defects import RAMP, worn_depth
from panto_env.plant.catenary.flexible.wires import rise_by_defects
from panto_env.plant.line_condition import LineCondition

from ..finite_element.hermite import matrices, uniform_load
from ..finite_element.static import GRAVITY, static_shape
from ..finite_element.system import _placement, build
from ..marks import some_at_once
from .test_flexible import under_a_train
from .test_uneven import MIXED, line_of

of_defects = python_function(rise_by_defects)
EN50318, BENCHMARK = "en50318-2002", "benchmark-2015"
SPOT = {"hard_spots": [(3, 27.0, 8.0, 3000.0)]}
WORN = {"worn_stretches": [(3, 10.5, 19.5, 0.2)]}
LOST = {"lost_contact_tension": 0.1, "lost_messenger_tension": 0.15}
BUMP = {"surface_bumps": [(3, 36.0, 4.0, 0.005)]}
ICE = {"ice": 0.3}
CONDITIONS = {
    "hard spot": SPOT,
    "worn stretch": WORN,
    "bump": BUMP,
    "lost tension": LOST,
    "ice": ICE,
    "all": SPOT | WORN | BUMP | LOST | ICE,
}


def without(system, data, condition, element):
    """Matrices of mass and stiffness that a condition takes away, and the load of it at rest (N)."""
    nodes, size = system.nodes, system.free.size
    mass, stiffness, load = 0 * system.mass, 0 * system.mass, np.zeros(size)
    for span, offset, length, share in condition.worn_stretches:
        begin = (span - 1) * data.span_length + offset
        inside = np.flatnonzero((nodes > begin - 1e-6) & (nodes < begin + length + 1e-6))
        place = _placement(size, 4 * inside[:, None] + [2, 3])
        gone = data.contact_wire.model_copy(update={"mass": share * data.contact_wire.mass})
        mass = mass + place @ matrices(nodes[inside], gone)[1] @ place.T
        load += place @ uniform_load(nodes[inside], gone.mass * GRAVITY)
    for first in (0, 2) if condition.ice else ():  # messenger, contact wire
        place = _placement(size, 4 * np.arange(len(nodes))[:, None] + [first, first + 1])
        coat = data.contact_wire.model_copy(update={"mass": condition.ice})
        mass = mass - place @ matrices(nodes, coat)[1] @ place.T
        load -= place @ uniform_load(nodes, condition.ice * GRAVITY)
    if not condition.lost_contact_tension and not condition.lost_messenger_tension:
        return mass, stiffness, load
    shape = static_shape(data, element)
    for wire, share, first, heights in (
        (data.contact_wire, condition.lost_contact_tension, 2, (shape.contact, shape.contact_slope)),
        (data.messenger_wire, condition.lost_messenger_tension, 0, (shape.messenger, shape.messenger_slope)),
    ):
        place = _placement(size, 4 * np.arange(len(nodes))[:, None] + [first, first + 1])
        lost = wire.model_copy(update={"tension": share * wire.tension, "bending_stiffness": 0.0})
        own = place @ matrices(nodes, lost)[0] @ place.T
        span = np.stack(heights, axis=1)
        spans = round(nodes[-1] / data.span_length)
        load += own @ place @ np.append(np.tile(span[:-1], (spans, 1)), span[-1:], axis=0).ravel()
        stiffness = stiffness + own
    return mass, stiffness, load


def surface(nodes, data, condition):
    """How much higher the running surface of worn wire or of a bump is, and its slope, (nodes, 2)."""
    rise, profiles = np.zeros((len(nodes), 2)), []
    for span, offset, length, share in condition.worn_stretches:
        begin, depth = (span - 1) * data.span_length + offset, worn_depth(data.contact_wire, share)
        profiles.append(([begin, begin + RAMP, begin + length - RAMP, begin + length], [0, depth, depth, 0]))
    for span, offset, length, height in condition.surface_bumps:
        middle, quarter = (span - 1) * data.span_length + offset, length / 4
        knots = [middle - 2 * quarter, middle - quarter, middle + quarter, middle + 2 * quarter]
        profiles.append((knots, [0, height, height, 0]))
    for profile in profiles:
        rise[:, 0] += np.interp(nodes, *profile)
        rise[:, 1] += (np.interp(nodes + 1e-6, *profile) - np.interp(nodes - 1e-6, *profile)) / 2e-6
    return rise


def defective(data, spans, element, condition):
    """Finite elements of a line whose wires have these defects, about their own static state.

    A spot is a mass and a spring at a node. Worn wire is lighter in its elements, and what the pantograph
    touches is higher. Tension is lost in the wires' matrices; droppers stay as long as they were cut.
    """
    system = build(data, spans, element)
    mass, stiffness, load = without(system, data, condition, element)
    point, spring = np.zeros((2, system.free.size))
    for span, offset, kilograms, held in condition.hard_spots:
        at = (span - 1) * data.span_length + offset
        unknown = 4 * int(np.argmin(np.abs(system.nodes - at))) + 2
        point[unknown], spring[unknown] = kilograms, held
    keep = diags_array(system.free)
    mass, stiffness = keep @ mass @ keep, keep @ stiffness @ keep
    left = system.stiffness - stiffness
    load = system.free * (load - GRAVITY * point)
    change = spsolve((left + diags_array(1 - system.free)).tocsc(), load)
    tension = system.dropper_tension + system.dropper_stiffness * (system.extension @ change)
    assert (tension > 0).all()
    alpha, beta = data.damping.alpha, data.damping.beta
    return replace(
        system,
        static=system.static + change.reshape(-1, 4)[:, 2:] + surface(system.nodes, data, condition),
        mass=(system.mass - mass + diags_array(point)).tocsr(),
        damping=(system.damping - beta * stiffness - alpha * mass).tocsr(),
        stiffness=(left + diags_array(spring)).tocsr(),
        dropper_tension=tension,
    )


@pytest.mark.parametrize("name", [EN50318, BENCHMARK])
@pytest.mark.parametrize("defects", CONDITIONS.values(), ids=CONDITIONS)
def test_static_state_agrees_with_finite_elements(name, defects):
    data, spans = load_catenary(name), 8
    condition = LineCondition(**defects)
    whole, other = build(data, spans, 0.25), defective(data, spans, 0.25, condition)
    line = DefectiveLine(data.layout(spans), condition)
    state = line.solve()
    # Where tension is lost, the anchors of ours stand where the tension left would have them.
    inner = (whole.nodes > data.span_length) & (whole.nodes < (spans - 1) * data.span_length)
    each = len(data.droppers.positions)
    base = with_tension_left(data, condition)
    start = build(base, spans, 0.25).static[:, 0]
    ours = start + [of_defects(state.rise, line.breaks, line.decay, x) for x in whole.nodes]
    np.testing.assert_allclose(ours[inner], other.static[inner, 0], atol=1e-4)
    np.testing.assert_allclose(state.tension[each:-each], other.dropper_tension[each:-each], atol=0.5)
    assert np.abs(ours - whole.static[:, 0]).max() > 4e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", some_at_once(CONDITIONS, ["all"]))
def test_contact_force_agrees_with_finite_elements(monkeypatch, name):
    condition = LineCondition(**CONDITIONS[name])

    def changed(data, spans, element):
        return defective(data, spans, element, condition)

    ours, theirs, intact, *_ = under_a_train(monkeypatch, changed, condition, 250.0, 2.05 * 60, 241.0)
    assert (ours - theirs).std() < 3.0
    assert (intact - theirs).std() > 9.0


def test_worn_depth_of_half_a_wire_is_its_radius():
    wire = load_catenary(EN50318).contact_wire
    section = wire.mass / 8900
    assert worn_depth(wire, 0.0) == 0
    assert worn_depth(wire, 0.5) == pytest.approx(np.sqrt(section / np.pi), rel=1e-6)
    # A thin segment of height h: 4/3 sqrt(2 r h^3).
    thin = worn_depth(wire, 0.01)
    assert 4 / 3 * np.sqrt(2 * np.sqrt(section / np.pi) * thin**3) == pytest.approx(0.01 * section, rel=0.02)


def test_a_grid_as_usual_carries_a_section_insulator():
    """Low-passed forces beside those of a fine grid, as a share of what the spot does to them.

    The head is thrown off for 25 ms and lands a little early or late: there most of the 5 % arise.
    """
    spot = {"hard_spots": [(4, 33.0, 15.0, 0.0)]}
    runs = [
        simulate(speed_kmh=250.0, line_condition=condition, distance=300.0, spans=8, **how)
        for condition, how in (
            (spot, {}),
            (spot, {"spacing": 0.1, "time_step": 2e-4}),
            ("new", {"spacing": 0.1, "time_step": 2e-4, "window": 0}),
        )
    ]
    at = np.linspace(200, 280, 1000)
    ours, fine, intact = (
        np.interp(at, run.position, zero_phase_low_pass(run.contact_force, run.time_step)) for run in runs
    )
    assert (ours - fine).std() < 0.08 * (intact - fine).std()


@pytest.mark.parametrize(
    "defects", [SPOT, WORN, BUMP, LOST], ids=["hard spot", "worn stretch", "bump", "lost tension"]
)
def test_a_defect_of_no_size_changes_nothing(defects):
    """But rounding: what carries a line out of its design is there, with zeros in it."""
    zeros = {"hard_spots": (0.0, 0.0), "worn_stretches": (0.0,), "surface_bumps": (0.0,)}
    none = {
        key: [(*row[: -len(zeros[key])], *zeros[key]) for row in value] if key in zeros else 0.0
        for key, value in defects.items()
    }
    given = {"distance": 300.0, "window": 0, "spacing": HARD_SPOT_GRID}
    intact, same = (simulate(line_condition=c, **given) for c in ("new", none))
    np.testing.assert_allclose(intact.contact_force, same.contact_force, atol=0.02)


def test_lanes_share_what_is_wrong_with_the_wires_and_draw_the_rest():
    condition = SPOT | {"irregularity": 1.0, "dropper_scatter": 0.005}
    settings = {"line_condition": condition, "distance": 300.0, "spans": 8}
    batch = Task(run_settings(settings), lanes=2, record_droppers=True)
    for lane in range(2):
        batch.reset(lane, np.random.default_rng(lane))
    batch.run_passively()
    alone = [simulate(seed=seed, **settings) for seed in range(2)]
    for run, single in zip(map(batch.trajectory, range(2)), alone, strict=True):
        np.testing.assert_array_equal(run.contact_force, single.contact_force)
        np.testing.assert_array_equal(run.dropper_force, single.dropper_force)
    assert (alone[0].contact_force - alone[1].contact_force).std() > 1.0


def test_less_tension_is_a_slower_line_and_more_a_faster_one():
    """A loss below 0 is a gain, of up to a tenth: a train may then be faster than on the line as designed."""
    lost, gained = {"lost_contact_tension": 0.19}, {"lost_contact_tension": -0.1}
    slower, faster, intact = (
        Task(run_settings({"line_condition": each})).plant.model.wave_speed for each in (lost, gained, "new")
    )
    assert (slower, faster) == pytest.approx((0.9 * intact, np.sqrt(1.1) * intact))
    with pytest.raises(InputError, match="below the wave speed of the contact wire, 394 km/h"):
        Task(run_settings({"line_condition": lost, "speed_kmh": 400.0}))
    with pytest.raises(InputError, match="below the wave speed"):
        Task(run_settings({"speed_kmh": 3.6 * 1.02 * intact}))
    Task(run_settings({"speed_kmh": 3.6 * 1.02 * intact, "line_condition": gained}))


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ({"hard_spots": [(11, 1.0, 5.0, 0.0)]}, "no place 1 m from the first support of span 11: it has 10"),
        ({"hard_spots": [(2, 61.0, 5.0, 0.0)]}, "no place 61 m from the first support of span 2"),
        ({"hard_spots": [(1, 0.0, 5.0, 0.0)]}, "must lie between the line's anchors, at 0 and 600 m"),
        ({"hard_spots": [(2, 1.0, 5.0, 0.0), (2, 1.0, 6.0, 0.0)]}, r"names \(2, 1.0\) twice"),
        ({"hard_spots": [(2, 1.0, 500.0, 0.0)]}, "hard_spots.1.3"),
        ({"worn_stretches": [(10, 50.0, 11.0, 0.1)]}, "ends at 601 m, but the line at 600 m"),
        ({"worn_stretches": [(2, 5.0, 9.0, 0.1), (2, 1.0, 5.0, 0.1)]}, "must not overlap: .* 61 and 65 m"),
        ({"worn_stretches": [(2, 5.0, 1.0, 0.1)]}, "worn_stretches.1.3"),
        ({"lost_contact_tension": 0.6}, "lost_contact_tension"),
        ({"lost_messenger_tension": -0.11}, "lost_messenger_tension"),
    ],
)
def test_defects_that_the_wire_cannot_have_are_refused(condition, message):
    with pytest.raises(InputError, match=message):
        Task(run_settings({"line_condition": condition}))


def test_wires_of_several_kinds_in_one_plant_are_refused():
    with pytest.raises(InputError, match="must not differ in hard_spots, worn_stretches"):
        Task(run_settings({"line_condition": [SPOT, "new"]}), lanes=2)


def test_a_window_that_travels_is_refused_where_the_wire_is_not_even():
    with pytest.raises(InputError, match=r"computed as a whole, .* leave out window=8, or set it to 0"):
        simulate(line_condition=WORN, window=8)
    assert simulate(line_condition=WORN, distance=200.0).settings["window"] == 10


def test_spans_that_differ_bear_ice_as_finite_elements_say():
    data, condition, spans = line_of(MIXED), LineCondition(ice=0.6), len(MIXED)
    other, line = defective(data, spans, 0.1, condition), DefectiveLine(data.layout(spans), condition)
    state, begins = line.solve(), data.alignment().supports
    ours = solve(with_tension_left(data, condition)).contact.height(other.nodes)
    ours = ours + line.rise(state).height(other.nodes)
    inner = (other.nodes > begins[3]) & (other.nodes < begins[-4])
    np.testing.assert_allclose(ours[inner], other.static[inner, 0], atol=5e-4)
    droppers = data.layout().positions
    own = (droppers > begins[3]) & (droppers < begins[-4])
    np.testing.assert_allclose(state.tension[own], other.dropper_tension[own], atol=0.5)


def test_ice_under_which_a_line_cannot_hang_is_refused():
    said = r"would differ by 0.\d+ m in height, more than 0.5 m, in this line_c"
    with pytest.raises(InputError, match=said):
        simulate(EN50318, speed_kmh=100.0, line_condition={"ice": 3.0}, distance=100.0)
    with pytest.raises(InputError, match=r"must not differ in .* ice or temp"):
        simulate(line_condition=["new", {"ice": 0.3}])
