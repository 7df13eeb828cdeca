"""Wires fixed at both ends: tension by temperature and ice, beside closed form and finite elements."""

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary
from panto_env.catalog.loader import FOLDERS
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.as_run import as_run, elasticity
from panto_env.plant.catenary.flexible.defects import DefectiveLine, with_tension_left
from panto_env.plant.catenary.flexible.fixed_wires import tensions_of_fixed
from panto_env.plant.catenary.flexible.static import droppers_at_rest
from panto_env.plant.catenary.flexible.wires import rise_by_defects
from panto_env.plant.line_condition import LineCondition
from panto_env.report.findings import Findings
from panto_env.report.page import page

from ..command import panto
from ..finite_element.hermite import matrices, uniform_load
from ..finite_element.sections import of_catalogue
from ..finite_element.static import GRAVITY, static_shape
from ..finite_element.system import _placement, build
from .test_uneven import line_of

of_defects = python_function(rise_by_defects)
EN50318, SPANS, ELEMENT = "en50318-2002", 9, 0.1
COPPER = 17e-6
EA = {"contact_wire": 15e6, "messenger_wire": 10e6}


def fixed(name, wires):
    """A line of the catalogue with these wires fixed at both ends."""
    data = of_catalogue(name)
    own = {each: getattr(data, each).model_copy(update={"axial_stiffness": EA[each]}) for each in wires}
    return data.model_copy(update=own)


def judged(data, ice, tensions):
    """A line as finite elements have it with other tensions (N) and with ice.

    Returns nodes, heights of the contact wire (m), dropper tensions (N), and the slack of contact and of
    messenger wire in the middle span: the mean of y'^2 / 2, from the elements' matrix of tension.
    """
    system, shape = build(data, SPANS, ELEMENT), static_shape(data, ELEMENT)
    size, load, more = system.free.size, np.zeros(system.free.size), 0 * system.stiffness
    both = shape.messenger, shape.messenger_slope, shape.contact, shape.contact_slope
    one = np.stack(both, axis=1)
    static = np.append(np.tile(one[:-1], (SPANS, 1)), one[-1:], axis=0)
    for wire, first, tension in zip(data.wires, (2, 0), tensions, strict=True):
        place = _placement(size, 4 * np.arange(len(system.nodes))[:, None] + [first, first + 1])
        taken = wire.model_copy(update={"tension": tension - wire.tension, "bending_stiffness": 0.0})
        stiffness = place @ matrices(system.nodes, taken)[0] @ place.T
        load -= stiffness @ static.ravel() + place @ uniform_load(system.nodes, ice * GRAVITY)
        more = more + stiffness
    keep = diags_array(system.free)
    left = system.stiffness + keep @ more @ keep + diags_array(1 - system.free)
    change = spsolve(left.tocsc(), system.free * load).reshape(-1, 4)
    now = static + change
    begin, end = np.searchsorted(system.nodes, np.array([4, 5]) * data.span_length - 1e-6)
    middle = slice(begin, end + 1)
    unit = data.contact_wire.model_copy(update={"tension": 1.0, "bending_stiffness": 0.0})
    of_length = matrices(system.nodes[middle], unit)[0]
    slack = [
        float(y @ of_length @ y) / (2 * data.span_length)
        for y in (now[middle, first : first + 2].ravel() for first in (2, 0))
    ]
    pull = system.dropper_tension + system.dropper_stiffness * (system.extension @ change.ravel())
    return system.nodes, now[:, 2], pull, np.array(slack)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "wires", "weather"),
    [
        (EN50318, ["messenger_wire"], {"temperature": 25.0}),
        ("benchmark-2015", ["contact_wire"], {"temperature": -30.0, "ice": 0.3}),
        ("re250", list(EA), {"ice": 0.6}),
        (EN50318, list(EA), {"temperature": -30.0, "ice": 0.3}),
    ],
)
def test_fixed_wires_are_as_long_as_finite_elements_say(name, wires, weather):
    data, condition = fixed(name, wires), LineCondition(**weather)
    shares = np.array(tensions_of_fixed(data, condition))
    designed = np.array([wire.tension for wire in data.wires])
    nodes, height, pull, slack = judged(data, condition.ice, shares * designed)
    _, _, _, before = judged(data, 0.0, designed)
    for k, wire in enumerate(data.wires):
        if wire.axial_stiffness is None:
            assert shares[k] == 1
        else:
            longer = slack[k] - before[k] - COPPER * condition.temperature
            assert shares[k] - 1 == pytest.approx(longer * wire.axial_stiffness / designed[k], abs=2e-3)
    assert np.abs(shares - 1).max() > 3e-3
    # So is its shape.
    line = DefectiveLine(data.layout(SPANS), condition, tuple(shares))
    state = line.solve()
    left = with_tension_left(data, condition, tuple(shares))
    ours = build(left, SPANS, ELEMENT).static[:, 0]
    ours = ours + [of_defects(state.rise, line.breaks, line.decay, x) for x in nodes]
    inner = (nodes > 4 * data.span_length) & (nodes < 5 * data.span_length)
    np.testing.assert_allclose(ours[inner], height[inner], atol=2e-4)
    own = slice(4 * len(data.droppers.positions), 5 * len(data.droppers.positions))
    np.testing.assert_allclose(state.tension[own], pull[own], atol=0.5)


def test_a_straight_wire_loses_ea_alpha_theta():
    data = fixed(EN50318, ["contact_wire"])
    for temperature in (-40.0, 30.0):
        contact, messenger = tensions_of_fixed(data, LineCondition(temperature=temperature))
        lost = EA["contact_wire"] * COPPER * temperature / data.contact_wire.tension
        assert contact == pytest.approx(1 - lost, abs=2e-3)
        assert messenger == 1


def test_a_run_has_the_tension_of_its_temperature_in_every_lane():
    data = fixed(EN50318, ["contact_wire"])
    settings = {"catenary": data, "speed_kmh": 250.0, "distance": 200.0}
    cold, built = (simulate(**settings, line_condition={"temperature": each}) for each in (-30.0, 0.0))
    share, _ = tensions_of_fixed(data, LineCondition(temperature=-30.0))
    assert cold.line.wave_speed == pytest.approx(built.line.wave_speed * np.sqrt(share))
    np.testing.assert_array_equal(built.contact_force, simulate(**settings).contact_force)
    scattered = {"temperature": -30.0, "tension_scatter": 1e-9}
    task = Task(run_settings(settings | {"line_condition": scattered}), lanes=2)
    for lane in range(2):
        task.reset(lane, np.random.default_rng(lane))
    task.run_passively()
    for lane in range(2):
        np.testing.assert_allclose(task.trajectory(lane).contact_force, cold.contact_force, atol=0.5)


def test_slack_that_only_a_temperature_makes_is_refused_and_so_is_one_that_does_nothing():
    stiff = load_catenary(EN50318).contact_wire.model_copy(update={"axial_stiffness": 25e6})
    data = load_catenary(EN50318).model_copy(update={"contact_wire": stiff})
    slack = r"At \+80 K \(95 °C, built at 15 °C\) the contact wire of line 'en50318-2002', fixed at both"
    nothing = "Temperature changes nothing on line 'en50318-2002', as weights keep the tension"
    for catenary, temperature, said in ((data, 80.0, slack), (EN50318, 10.0, nothing)):
        with pytest.raises(InputError, match=said):
            simulate(catenary, speed_kmh=200.0, line_condition={"temperature": temperature}, distance=600.0)


def test_a_long_line_of_spans_that_nearly_agree_has_the_tension_of_the_uniform_one():
    data, condition = fixed(EN50318, EA), LineCondition(temperature=-20.0, ice=0.2)
    nearly = line_of([60, 60.001] * 15, data.model_copy(update={"spans": 30}))
    np.testing.assert_allclose(
        tensions_of_fixed(nearly, condition), tensions_of_fixed(data, condition), rtol=5e-3
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "weather"),
    [
        (fixed(EN50318, EA), {"temperature": 20.0, "ice": 0.2}),
        (load_catenary("re250"), {"lost_contact_tension": 0.1, "ice": 0.3}),
        (load_catenary("re250-curves"), {"lost_messenger_tension": 0.05}),
    ],
    ids=lambda each: getattr(each, "name", ""),
)
def test_a_line_at_rest_as_run_is_the_one_that_a_run_has(line, weather):
    """Nothing named these tensions and dropper forces: reports listed the design's."""
    condition = LineCondition(**weather, miscut_droppers=((2, 1, 0.005),))
    found = as_run(line, condition, 100.0)
    task = Task(run_settings({"catenary": line, "line_condition": LineCondition(**weather)}))
    assert found.wires[0].wave_speed == task.plant.model.wave_speed
    first = 0 if line.sequence else task.plant.spans // 2 * len(found.droppers)
    middle = slice(first, first + len(found.droppers))
    own = task.plant.model.rest_tension(0)[middle]
    assert [each.static_force for each in found.droppers] == pytest.approx(own.tolist(), abs=0.05)
    designed = droppers_at_rest(line)
    assert [each.length for each in found.droppers] == [each.length for each in designed]
    assert (
        max(abs(a.static_force - b.static_force) for a, b in zip(found.droppers, designed, strict=True)) > 1
    )
    np.testing.assert_allclose(as_run(line, LineCondition(), 100.0).droppers, designed, atol=1e-9)


def test_a_line_in_no_condition_is_at_rest_as_designed():
    line = load_catenary("en50318-2002")
    found = as_run(line, LineCondition(), 100.0).droppers
    np.testing.assert_allclose(found, droppers_at_rest(line), atol=1e-9)


def test_its_elasticity_is_that_of_a_line_designed_for_these_tensions():
    """Where no dropper goes slack, wires and droppers are linear, whatever the wires weigh and carry."""
    line = load_catenary("en50318-2002")
    condition = LineCondition(lost_contact_tension=0.2, lost_messenger_tension=0.1)
    found = as_run(line, condition, 10.0)
    places, lifts = elasticity(with_tension_left(line, condition), 10.0)
    np.testing.assert_array_equal(found.places, places)
    np.testing.assert_allclose(found.elasticities, lifts, rtol=1e-3)
    assert lifts.max() > 1.05 * elasticity(line, 10.0)[1].max()


@pytest.mark.longer
def test_the_report_and_the_command_show_the_line_as_it_was_run(tmp_path):
    data = fixed(EN50318, EA)
    run = simulate(data, speed_kmh=250.0, line_condition={"temperature": 20.0})
    (found,) = Findings.of(run, "run.parquet")
    shown = page([found])
    table = shown[shown.index('class="as-run"') :]
    tension = found.as_run.wires[0].tension
    assert f"<td>20,000</td><td>{tension:,.5g}</td>" in table.replace("\n", "")
    assert "wires at +20 K (35 °C, built at 15 °C)" in table
    assert found.elasticity[1].max() > 1.1 * elasticity(data, found.figures.mean)[1].max()
    text = (FOLDERS["catenary"] / f"{EN50318}.toml").read_text(encoding="utf-8")
    for wire, stiffness in EA.items():
        text = text.replace(f"[{wire}]\n", f"[{wire}]\naxial_stiffness = {stiffness}\n")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    warm = panto("line", "mine.toml", "--line-condition", "new:temperature=20", cwd=tmp_path)
    assert warm.returncode == 0, warm.stderr
    assert f"{tension:,.5g}" in warm.stdout
    assert "as run" not in panto("line", "mine.toml", cwd=tmp_path).stdout
    drawn = panto("line", EN50318, "--line-condition", "as-built", cwd=tmp_path).stdout
    assert "each tension is drawn within ± 2.9 % of these" in " ".join(drawn.split())
