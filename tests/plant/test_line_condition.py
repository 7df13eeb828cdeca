from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.schema import Rayleigh
from panto_env.plant.catenary.flexible.wires import rise_by_defects
from panto_env.plant.line_condition import LINE_CONDITIONS, DrawnLine, LineCondition, draw
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train
from panto_env.studies.en50318 import conditions

from ..finite_element.system import build
from .test_flexible import WHOLE, travel, under_a_train

of_defects = python_function(rise_by_defects)
EN50318, BENCHMARK = "en50318-2002", "benchmark-2015"


def static_by_finite_elements(system, line, condition, load=None, scatter=0.0):
    """Static state by finite elements and NNLS on the tensions: all unknowns (m), tensions (N)."""
    each = len(line.droppers.positions)
    stiffness, k, static = system.stiffness, system.dropper_stiffness, system.dropper_tension
    extension, error = system.extension, np.zeros(len(k)) + scatter
    springs = extension.T @ diags_array(k) @ extension
    wires = splu((stiffness - springs + diags_array(1 - system.free)).tocsc())
    forces = np.zeros(stiffness.shape[0]) if load is None else load.copy()
    for support, height in condition.raised_supports:
        forces[system.supports[support - 1] - 2] += line.support.stiffness * height
    for span, number, wrong in condition.miscut_droppers:
        error[(span - 1) * each + number - 1] += wrong
    kept = np.ones(len(k), bool)
    kept[[(span - 1) * each + number - 1 for span, number in condition.broken_droppers]] = False
    yields = extension @ wires.solve(extension.T.toarray())
    opened = static / k + yields @ static + extension @ wires.solve(forces) - error
    root = cholesky((yields + np.diag(1 / k))[np.ix_(kept, kept)], lower=True)
    tension = np.zeros(len(k))
    tension[kept] = nnls(root.T, solve_triangular(root, opened[kept], lower=True))[0]
    return wires.solve(forces - extension.T @ (tension - static)), tension


def rise(line, state, x):
    """Change of the contact wire's height (m) at positions x (m)."""
    return np.array([of_defects(state.rise, line.breaks, line.decay, at) for at in x])


CONDITIONS = [
    {"broken_droppers": [(3, 5)]},
    {"broken_droppers": [(3, 9), (4, 1)]},
    {"miscut_droppers": [(3, 4, 0.02)]},
    {"miscut_droppers": [(1, 1, -0.01), (3, 4, -0.02), (6, 9, 0.05)]},
    {"raised_supports": [(3, 0.05)]},
    {"broken_droppers": [(2, 4)], "miscut_droppers": [(2, 5, 0.03)], "raised_supports": [(2, -0.04)]},
]


@pytest.mark.longer
@pytest.mark.parametrize("name", [EN50318, BENCHMARK])
def test_static_state_agrees_with_finite_elements(name):
    data = load_catenary(name)
    system = build(data, 6, 0.1)
    for keywords in CONDITIONS:
        condition = LineCondition(**keywords)
        line = DefectiveLine(data.layout(6), condition)
        state = line.solve()
        change, tension = static_by_finite_elements(system, data, condition)
        contact = change.reshape(-1, 4)[:, 2]
        np.testing.assert_allclose(state.tension, tension, atol=0.05)
        np.testing.assert_allclose(rise(line, state, system.nodes), contact, atol=1e-5)
        assert np.abs(contact).max() > 4e-3


@pytest.mark.parametrize("name", [EN50318, BENCHMARK])
def test_many_slack_droppers_agree_with_finite_elements(name):
    data, condition = load_catenary(name), LineCondition(dropper_scatter=0.02)
    system, line = build(data, 6, 0.1), DefectiveLine(data.layout(6), condition)
    for seed in range(2):
        scatter = draw([condition], np.random.default_rng(seed), 54).scatter
        state = line.solve(scatter)
        change, tension = static_by_finite_elements(system, data, condition, scatter=scatter)
        np.testing.assert_allclose(state.tension, tension, atol=0.5)
        np.testing.assert_allclose(rise(line, state, system.nodes), change.reshape(-1, 4)[:, 2], atol=1e-4)
        assert 1 < (tension == 0).sum() == (state.tension == 0).sum() == (state.gap > 0).sum()


@pytest.mark.slow
def test_dropper_that_is_slack_at_rest_pulls_once_its_gap_is_taken_up():
    """Load the wire below it: the kernel comes to rest where finite elements put it."""
    data = load_catenary(BENCHMARK)
    data = data.model_copy(update={"damping": Rayleigh(alpha=2.0, beta=1e-4)})
    condition = LineCondition(miscut_droppers=[(3, 4, 0.02)])
    plant = Plant(
        data,
        Train.of(load_pantograph(BENCHMARK)),
        spans=5,
        numerics=Numerics(**WHOLE, spacing=0.2),
        runs=Runs(conditions=[condition]),
    )
    at, system = 2 * 55 + 21.75, build(data, 5, 0.25)
    node = int(np.argmin(np.abs(system.nodes - at)))
    heights, slack = np.zeros(12000), []
    for force in (0.0, -10.0, -200.0):
        load = np.zeros(system.free.size)
        load[4 * node + 2] = force
        change, tension = static_by_finite_elements(system, data, condition, load)
        plant.model.settle(0, DrawnLine(condition), 0.0)
        travel(plant.model.line, plant.model.wire, at, 0.0, force, heights, np.zeros(3))
        static = float(system.static[node, 0] + change[4 * node + 2])
        assert heights[-1] == pytest.approx(static, abs=2e-4)
        line = plant.model.line
        ours = line.link_static[0] + plant.model.wire.change[0][line.link_set, line.link_segment]
        np.testing.assert_allclose(ours, tension, atol=1.5)
        slack.append(ours[2 * 9 + 3] == 0)
    assert slack == [True, True, False]


def test_dropper_far_too_long_is_as_good_as_broken():
    window = {"distance": 5 * 60.0, "spans": 10}
    broken = simulate(line_condition={"broken_droppers": [(4, 5)]}, **window)
    loose = simulate(line_condition={"miscut_droppers": [(4, 5, 0.2)]}, **window)
    np.testing.assert_array_equal(broken.contact_force, loose.contact_force)
    assert (broken.dropper_force[:, 3 * 9 + 4] == 0).all()


@pytest.mark.slow
def test_contact_force_over_a_broken_dropper_agrees_with_finite_elements(monkeypatch):
    """Its finite elements, less the dropper, about their own static state without it."""
    data, condition = load_catenary(EN50318), LineCondition(broken_droppers=[(4, 5)])

    def broken(*arguments):
        system = build(*arguments)
        change, tension = static_by_finite_elements(system, data, condition)
        gone = 3 * 9 + 4
        cut, kept = system.extension[[gone]], np.delete(np.arange(len(tension)), gone)
        spring = system.dropper_stiffness[gone] * (cut.T @ cut)
        return replace(
            system,
            static=system.static + change.reshape(-1, 4)[:, 2:],
            stiffness=(system.stiffness - spring).tocsr(),
            damping=(system.damping - data.damping.beta * spring).tocsr(),
            extension=system.extension[kept],
            dropper_stiffness=system.dropper_stiffness[kept],
            dropper_damping=system.dropper_damping[kept],
            dropper_tension=tension[kept],
        )

    ours, theirs, intact, *_ = under_a_train(monkeypatch, broken, condition, 300.0, 3.2 * 60, 301.0)
    assert (ours - theirs).std() < 3.0
    assert (intact - theirs).std() > 10.0


@pytest.fixture(scope="module")
def over_a_defect():
    """20 spans with a broken dropper in span 12, and intact, by window."""
    defects = {"new": "new", "broken": {"broken_droppers": [(12, 5)]}}
    return {
        (name, window): simulate(line_condition=defect, spans=20, window=window, distance=13 * 60.0)
        for window in (7, 0)
        for name, defect in defects.items()
    }


def test_window_sees_a_defect_as_the_whole_line_does(over_a_defect):
    whole = over_a_defect["broken", 0]
    near = (whole.position > 11 * 60) & (whole.position < 13 * 60)
    force = {key: run.contact_force[near] for key, run in over_a_defect.items()}
    effect = {window: force["broken", window] - force["new", window] for window in (0, 7)}
    assert (effect[7] - effect[0]).std() < 1.5 < 15.0 < effect[0].std()
    # The window itself, on the intact line too, is 4.6 N off.
    assert (force["broken", 7] - force["broken", 0]).std() < 5.5


def test_droppers_out_of_the_window_s_sight_rest_in_the_defective_state(over_a_defect):
    window, whole = over_a_defect["broken", 7], over_a_defect["broken", 0]
    np.testing.assert_allclose(window.dropper_force[0], whole.dropper_force[0], rtol=1e-5)
    np.testing.assert_allclose(window.dropper_force[0], window.dropper_force[1], rtol=1e-3)
    assert window.dropper_force[0, 11 * 9 + 3 : 11 * 9 + 6] == pytest.approx([128.9, 0.0, 128.9], abs=0.5)
    for run in (window, whole):
        assert (run.dropper_force[:, 11 * 9 + 4] == 0).all()
        assert run.dropper_force[:, 11 * 9 + 3].max() > 150


@pytest.mark.parametrize("window", [0, 7])
def test_defect_is_felt_where_it_is(over_a_defect, window):
    broken, intact = over_a_defect["broken", window], over_a_defect["new", window]
    change = np.abs(broken.contact_force - intact.contact_force)
    x = broken.position
    assert change[(x > 11.4 * 60) & (x < 12 * 60)].max() > 50.0
    assert change[x < 7.5 * 60].max() < 0.5


@pytest.mark.parametrize("window", [7, 0])
def test_untouched_line_runs_exactly_as_an_intact_one(window):
    untouched = {"raised_supports": [(5, 0.0)], "miscut_droppers": [(4, 2, 0.0)]}
    intact, same = (simulate(line_condition=c, window=window, distance=400.0) for c in ("new", untouched))
    np.testing.assert_array_equal(intact.contact_force, same.contact_force)
    np.testing.assert_array_equal(intact.wire, same.wire)
    np.testing.assert_array_equal(intact.dropper_force[-1], same.dropper_force[-1])


def test_one_of_several_conditions_is_drawn():
    conditions = [LineCondition(irregularity=k) for k in (1.0, 2.0, 3.0)]
    drawn = (draw(conditions, np.random.default_rng(seed)).condition for seed in range(30))
    assert {each.irregularity for each in drawn} == {1.0, 2.0, 3.0}


def test_scatter_is_drawn_after_the_phases():
    fair, scattered = LineCondition(irregularity=1.0), LineCondition(irregularity=1.0, dropper_scatter=0.01)
    plain, drawn = (draw([c], np.random.default_rng(3), 90) for c in (fair, scattered))
    np.testing.assert_array_equal(plain.waves, drawn.waves)
    assert plain.scatter is None
    assert drawn.scatter.std() == pytest.approx(0.01, rel=0.2)
    np.testing.assert_array_equal(drawn.scatter, draw([scattered], np.random.default_rng(3), 90).scatter)


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ({"broken_droppers": [(11, 1)]}, "no dropper 1 in span 11: it has 10 spans of 9 droppers"),
        ({"miscut_droppers": [(2, 10, 0.01)]}, "no dropper 10 in span 2"),
        ({"raised_supports": [(10, 0.01)]}, "no support 10: its 10 spans have 9 supports"),
        ({"broken_droppers": [(0, 1)]}, "broken_droppers.1.1"),
        ({"miscut_droppers": [(2, 1, 0.3)]}, "miscut_droppers.1.3"),
        ({"raised_supports": [(2, 0.01), (2, 0.02)]}, "names .2,. twice"),
        ({"dropper_scatter": -1e-3}, "dropper_scatter"),
    ],
)
def test_defects_that_the_line_cannot_have_are_refused(condition, message):
    with pytest.raises(InputError, match=message):
        Task(run_settings({"line_condition": condition}))


@pytest.mark.parametrize("line", ["ohl-three-span", "periodic-stiffness"])
def test_only_a_flexible_catenary_has_defects(line):
    scatters = dict.fromkeys(("dropper_scatter", "support_scatter", "tension_scatter"), 1e-3)
    lists = {"broken_droppers": [(1, 1)], "hard_spots": [(3, 27.0, 8.0, 3e3)]}
    lists |= {"worn_stretches": [(3, 10.5, 19.5, 0.2)]}
    for own in (scatters | lists | {"lost_contact_tension": 0.1, "ice": 1.0, "temperature": 10.0}).items():
        with pytest.raises(InputError, match=r"Only a flexible catenary has droppers .* wires that bear ice"):
            Task(run_settings({"catenary": line, "line_condition": dict([own])}))


TOLERANCE = 10e-3  # by which heights at neighbouring droppers may differ (m): EN 50119, recalled


def heights(level, seed, x):
    """Height of the running surface (m) at x (m), (n,)."""
    waves = draw([LINE_CONDITIONS[level]], np.random.default_rng(seed)).waves
    return (waves[:, :1] * np.cos(2 * np.pi * (np.outer(waves[:, 1], x) + waves[:, 2:]))).sum(axis=0)


@pytest.mark.parametrize(("level", "twice_rms"), [("smooth", 0.44e-3), ("fair", 2.2e-3), ("worn", 4.4e-3)])
def test_heights_at_droppers_differ_by_as_much_as_is_said(level, twice_rms):
    x = np.arange(0, 600, 0.05)
    differences = [heights(level, seed, x + 6) - heights(level, seed, x) for seed in range(20)]
    assert 2 * np.sqrt(np.mean(np.square(differences))) == pytest.approx(twice_rms, rel=0.1)
    assert np.abs(differences).max() < TOLERANCE


def test_waves_shorter_than_the_train_covers_at_20_hz_reach_losses_and_peaks_but_not_sigma():
    """At 300 km/h these are waves below 4.2 m; waves of the same depth and 5 m do reach sigma."""

    def figures(**waves):
        run = simulate(line_condition=waves, record_droppers=False)
        return run.summary(), run.contact_force[run.inside()].max()

    new, peak = figures()
    short, short_peak = figures(wear_depth=2e-3, wear_wavelength=0.8)
    long, _ = figures(wear_depth=2e-3, wear_wavelength=5.0)
    assert short.std == pytest.approx(new.std, rel=0.01)
    assert short.max == pytest.approx(new.max, rel=0.01)
    assert short.contact_loss > new.contact_loss + 0.5
    assert short_peak > peak + 25.0
    assert abs(long.std / new.std - 1) > 0.03
    assert long.contact_loss < 0.1


def test_the_table_of_conditions_has_every_preset_and_is_of_simulated_passes(monkeypatch):
    monkeypatch.setattr(conditions, "LEVEL_SEEDS", 2)
    checks = conditions.check_conditions("en50318-2002", "en50318-2002", 250.0)
    assert [check.condition for check in checks] == list(LINE_CONDITIONS)
    assert [check.seeds for check in checks] == [1, 2, 2, 2, 2]
    worn = checks[-1]
    given = {"speed_kmh": 250.0, "line_condition": "worn", "record_droppers": False}
    sigmas = [simulate(**given, seed=seed).summary().std for seed in range(2)]
    assert worn.std == pytest.approx((np.mean(sigmas), np.std(sigmas)))
    assert worn.change == pytest.approx(100 * (worn.std[0] / checks[0].std[0] - 1))


LEVELS = ("smooth", "fair", "worn")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "pantograph", "speed"),
    [("en50318-2002", "en50318-2002", 250.0), ("sweden-st15", "dsa250", 160.0), ("re330", "dsa380", 330.0)],
)
def test_a_fair_line_is_worse_than_a_smooth_one_and_a_worn_one_than_both(line, pantograph, speed):
    """By percents of sigma, not by tenths of one."""

    def sigma(level, seed=0):
        run = simulate(line, pantograph, speed, seed=seed, line_condition=level, record_droppers=False)
        return run.summary().std

    new = sigma("new")
    smooth, fair, worn = (np.mean([sigma(level, seed) for seed in range(4)]) / new - 1 for level in LEVELS)
    assert abs(smooth) < 0.01
    assert 0.015 < fair < 0.12
    assert 0.08 < worn < 0.4
    assert worn > 2 * fair
