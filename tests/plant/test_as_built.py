"""Lines that differ from seed to seed: what is drawn, what it does at rest and to a run, lane by lane."""

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.backend import python_function
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.grid import stable
from panto_env.plant.catenary.flexible.wires import rise_by_defects, static_height
from panto_env.plant.line_condition import LINE_CONDITIONS, DrawnLine, LineCondition, draw
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train

from ..lanes import check_lanes_are_singles

AS_BUILT = LINE_CONDITIONS["as-built"]
EN50318 = "en50318-2002"
PANTOGRAPH = load_pantograph(EN50318)
height_of, rise_of = python_function(static_height), python_function(rise_by_defects)
SHORT = {"distance": 300.0, "spans": 8}


def test_what_is_drawn_is_of_the_size_asked_for():
    drawn = [draw([AS_BUILT], np.random.default_rng(seed), 9, 10) for seed in range(2000)]
    scatter, heights, tensions, phases = (
        np.array([line.scatter for line in drawn]),
        np.array([line.heights for line in drawn]),
        np.array([line.tensions for line in drawn]),
        np.array([line.waves[-1, 2] for line in drawn]),
    )
    assert scatter.std() == pytest.approx(5e-3, rel=0.02)
    assert heights.std() == pytest.approx(5e-3, rel=0.02)
    assert (tensions - 1).std(axis=0) == pytest.approx([0.017, 0.017], rel=0.05)
    assert np.abs(tensions - 1).max() <= np.sqrt(3) * 0.017 == AS_BUILT.largest_tension_error
    for errors in (heights, tensions - 1):
        assert abs(errors.mean()) < 4 * errors.std() / errors.size**0.5
        assert abs(np.corrcoef(errors[:, 0], errors[:, 1])[0, 1]) < 0.1
    # Even over a turn: a histogram of ten classes, chi squared below its 0.1 % limit for nine freedoms.
    counts, _ = np.histogram(phases, np.linspace(0, 1, 11))
    assert ((counts - 200) ** 2 / 200).sum() < 27.9


def test_what_is_not_asked_for_draws_nothing_and_leaves_the_rest_as_it_was():
    fair, worn = LINE_CONDITIONS["fair"], LineCondition(wear_depth=1e-3)
    assert not worn.random
    assert worn.model_copy(update={"wear_drawn": True}).random
    plain, more = (
        draw([c], np.random.default_rng(1), 9, 3)
        for c in (fair, fair.model_copy(update={"tension_scatter": 0.01}))
    )
    np.testing.assert_array_equal(plain.waves, more.waves)
    assert (plain.scatter, plain.heights, plain.tensions) == (None, None, (1.0, 1.0))


def test_a_drawn_support_height_is_that_of_a_raised_support():
    data, heights = load_catenary(EN50318), [0.01, -0.004, 0.0, 0.02]
    raised = LineCondition(raised_supports=[(k + 1, h) for k, h in enumerate(heights)])
    named = DefectiveLine(data.layout(5), raised).solve()
    drawn = DefectiveLine(data.layout(5), LineCondition()).solve(heights=np.array(heights))
    np.testing.assert_array_equal(named.tension, drawn.tension)
    np.testing.assert_array_equal(named.rise, drawn.rise)


def test_a_drawn_tension_is_that_of_a_line_built_with_what_is_left():
    """Of a line whose tension is lost; that one is held against finite elements."""
    data = load_catenary(EN50318)
    condition = LineCondition(tension_scatter=0.02)
    lost = LineCondition(lost_contact_tension=0.03, lost_messenger_tension=0.02)
    # The line built for a scatter is computed on a grid that is stable under the largest tension.
    numerics = Numerics(spacing=0.25, time_step=1e-3)
    forces = []
    for built, drawn in (
        (condition, DrawnLine(condition, tensions=(0.97, 0.98))),
        (lost, DrawnLine(lost)),
        (LineCondition(), DrawnLine(LineCondition())),
    ):
        plant = Plant(data, Train.of(PANTOGRAPH), spans=8, numerics=numerics, runs=Runs(conditions=(built,)))
        plant.start(0, 250 / 3.6, [drawn])
        samples = plant.samples(3001)
        plant.advance_passively(3000, samples)
        forces.append(samples.rows[0, 1:, 0, 0])
    own, other, designed = forces
    assert np.abs(own - other).max() < 0.03 * np.abs(own - designed).max()
    assert np.abs(own - designed).max() > 5.0


def test_more_tension_raises_the_wire_in_the_middle_of_a_span():
    """Of two strings that bear the whole weight: by less where the contact wire is held at the supports and
    resists, T = T1 + T2, by more where it does not, T = T2. No steady arm of this line holds it.
    """
    data = load_catenary(EN50318)
    condition = LineCondition(tension_scatter=0.02)
    plant = Plant(data, Train.of(PANTOGRAPH), spans=6, lanes=2, runs=Runs(conditions=(condition,)))
    heights, more = [], 0.03
    for lane, messenger in enumerate((1.0, 1 + more)):
        plant.model.settle(lane, DrawnLine(condition, tensions=(1.0, messenger)), 0.0)
        line, at = plant.model.line, 2.5 * data.span_length
        rise = rise_of(line.rise[lane], line.rise_breaks, line.rise_decay[lane], at)
        heights.append(height_of(line.shape[lane], data.span_length, at) + rise)
    contact, messenger = data.contact_wire, data.messenger_wire
    sag = 9.81 * (contact.mass + messenger.mass) * data.span_length**2 / 8 / messenger.tension
    tensions = (contact.tension + (1 + more) * messenger.tension, (1 + more) * messenger.tension)
    least, most = (sag * more * messenger.tension / tension for tension in tensions)
    assert least < heights[1] - heights[0] < most


@pytest.mark.longer
def test_each_lane_has_its_own_line_as_a_single_environment_has():
    """Over the ends of episodes, bit for bit, and each its own tension."""
    name = "panto_env:Pantograph-v0"
    settings = {"distance": 20.0, "spans": 6, "run_in": 0.5, "settle": 0.0}
    ran = check_lanes_are_singles(name, settings, steps=70)
    assert ran.ends >= 5
    stencil = ran.vector.unwrapped.task.plant.model.line.stencil
    assert len({tuple(row.ravel()) for row in stencil}) == 3


def test_the_same_seed_gives_the_same_line_and_another_one_another():
    runs = [simulate(line_condition="as-built", seed=seed, **SHORT) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0].contact_force, runs[1].contact_force)
    assert np.abs(runs[0].contact_force - runs[2].contact_force).max() > 5.0


@pytest.mark.slow
def test_sigma_spreads_over_seeds():
    """Under "smooth" lines it hardly does; by its coefficient of variation."""
    spread = []
    for condition in ("smooth", "as-built"):
        runs = [simulate(line_condition=condition, seed=seed, accuracy="fast") for seed in range(20)]
        sigma = [run.summary().std for run in runs]
        spread.append(np.std(sigma, ddof=1) / np.mean(sigma))
    assert 4 * spread[0] < spread[1]
    assert spread[0] < 0.006


def test_a_grid_is_stable_under_the_largest_tension_that_may_be_drawn():
    """The finest grid that is stable with a step under the design's tension is refused."""
    data, step = load_catenary(EN50318), 2e-3
    count = next(n for n in range(400, 16, -8) if stable(data, data.span_length / n, step))
    given = {"spacing": data.span_length / count, "time_step": step} | SHORT
    assert Task(run_settings(given)).plant.time_step == step
    with pytest.raises(InputError, match="unstable on a grid"):
        Task(run_settings(given | {"line_condition": {"tension_scatter": 0.1}}))
