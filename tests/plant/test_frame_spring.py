"""The frame's spring under a wire that rises and falls, and a static force that depends on its height."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.estimation.estimate import estimate
from panto_env.estimation.motion import measure
from panto_env.metrics.trajectory import Trajectory
from panto_env.plant.catenary.rig import RigData
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.pantograph.step import Part
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

from ..finite_element.sections import line_of

UP = (0.0,) * 8 + (0.1, 0.2, 0.3, 0.4) + (0.5,) * 10
BRIDGE = (0.0,) * 8 + (-0.05, -0.1, -0.15) + (-0.2,) * 11
LEVEL, ON_RAMP, BEYOND = (4, 7), (9, 11), (14, 16)
DSA250 = load_pantograph("dsa250")
NOMINAL = DSA250.model_copy(update={"frame_spring": "nominal"})
TABLE = ((-0.3, 82.0), (0.0, 70.0), (0.25, 66.0), (0.6, 80.0))


def line_over(heights, name="en50318-2002"):
    """A line with these heights at its supports (m)."""
    spans, end = [{"contact_height": height} for height in heights[:-1]], {"contact_height": heights[-1]}
    return line_of(name, {"sequence": spans, "end_support": end})


def with_table(pantograph=DSA250, **changes):
    return PantographData.model_validate(pantograph.model_dump() | {"force_over_height": TABLE} | changes)


def slowly(pantograph, heights, speed_kmh=60.0, **settings):
    return simulate(
        line_over(heights), pantograph, speed_kmh, accuracy="fast", record_droppers=False, **settings
    )


def means(run, *stretches):
    return [run.summary(stretch).mean for stretch in stretches]


@pytest.mark.parametrize(("heights", "speed_kmh"), [(UP, 150.0), (BRIDGE, 110.0)])
def test_the_mean_force_is_that_of_the_level_line_wherever_the_wire_hangs(heights, speed_kmh):
    level, ramp, beyond = means(slowly(DSA250, heights, speed_kmh), LEVEL, ON_RAMP, BEYOND)
    assert beyond == pytest.approx(level, abs=0.3)  # 38 N less, and 15 more, before
    climb = DSA250.dampings[-1] * speed_kmh / 3.6 * (heights[10] - heights[9]) / 60
    assert ramp == pytest.approx(level - climb, abs=0.7)


def test_a_line_that_begins_high_up_is_a_level_one():
    high, level = (slowly(DSA250, (height,) * 12, distance=240.0) for height in (0.5, 0.0))
    np.testing.assert_allclose(high.contact_force, level.contact_force, atol=1.0)
    np.testing.assert_allclose(high.frame - 0.5, level.frame, atol=1e-3)
    assert high.contact_force[0] == pytest.approx(level.contact_force[0], abs=0.01)  # at rest


def test_about_the_nominal_height_the_spring_takes_k_h():
    """In the form of before: at the top 31.9 N for 69.9, by springs one after another."""
    run = slowly(NOMINAL, UP)
    level, beyond = means(run, LEVEL, BEYOND)
    climbed = run.head[run.inside(BEYOND)].mean() - run.head[run.inside(LEVEL)].mean()
    assert level - beyond == pytest.approx(80.0 * climbed / (1 + 80.0 * (1 / 8380.0 + 1 / 6200.0)), abs=0.1)
    assert [level, beyond] == pytest.approx([69.89, 31.92], abs=0.02)


def test_on_a_level_line_both_forms_are_the_same_to_the_last_bit():
    settings = {"line_condition": "as-built", "pantograph_scatter": 0.05, "num_envs": 2, "accuracy": "fast"}
    envs = [
        gymnasium.make_vec("panto_env:Pantograph-v0", pantograph=own, **settings)
        for own in (DSA250, NOMINAL, with_table())
    ]
    still = np.zeros(envs[0].action_space.shape, dtype=np.float32)
    first, *others = ([env.reset(seed=1)[0], *(env.step(still)[0] for _ in range(50))] for env in envs)
    for other in others:
        np.testing.assert_array_equal(first, other)


def closed_form(x, pantograph, heights=UP):
    height = np.interp(x, 60.0 * np.arange(len(heights)), heights)
    table = np.interp(height, *zip(*pantograph.force_over_height, strict=True)) - pantograph.static_force
    return pantograph.stiffnesses[-1] * height * (pantograph.frame_spring == "local") + table


def test_each_pantograph_of_a_train_feels_the_height_at_its_own_place():
    """With tables of another number of heights; one of them has the spring's old form."""
    short = with_table(NOMINAL, force_over_height=((-0.5, 60.0), (0.0, 70.0), (1.0, 100.0)))
    both, behind = (with_table(), short), 130.0
    given = {"catenary": line_over(UP), "pantographs": both, "distances": [behind], "speed_kmh": 200.0}
    task = Task(run_settings(given | {"accuracy": "fast"}), keep_samples=False)
    task.reset(0, np.random.default_rng(0))
    assert task.plant.of(0, Row.BY_HEIGHT) == 0.0
    found = []
    for _ in range(task.length.most_control_steps):
        task.step(np.zeros((task.agents, 1)))
        x = float(task.plant.position(0, task.plant.of(0, Row.STEP) - 0.5)[0])
        found.append((x, task.plant.of(0, Row.BY_HEIGHT), task.plant.of(0, Row.BY_HEIGHT, 1)))
    x, first, second = np.array(found).T
    assert x[-1] > 60.0 * 14 + behind
    np.testing.assert_allclose(first, closed_form(x, both[0]), atol=1e-9)
    np.testing.assert_allclose(second, closed_form(np.maximum(x - behind, 0.0), short), atol=1e-9)


def test_the_mean_force_follows_the_table():
    level, beyond = means(slowly(with_table(), UP), LEVEL, BEYOND)
    more = np.interp(0.5, *zip(*TABLE, strict=True)) - 70.0
    assert beyond - level == pytest.approx(more * DSA250.share_at_head, abs=0.3)


def test_lanes_whose_springs_differ_have_their_own():
    given = {"catenary": line_over((0.5,) * 12), "pantograph": DSA250, "pantograph_scatter": 0.1}
    task = Task(run_settings(given), lanes=3)
    task.reset(np.arange(3), np.random.default_rng(2))
    forces = task.plant.run.table[0, :, Row.CONTACT_FORCE].copy()
    task.step(np.zeros((3, 1)))
    springs = task.plant.run.table[0, :, Row.BY_HEIGHT] / 0.5
    assert np.ptp(springs) > 2.0
    np.testing.assert_array_equal(springs, task.plant.pantographs.table[0, :, Part.LOCAL_SPRING])
    assert np.ptp(forces) < 0.5  # at rest each presses as on a level line


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (((0.0, 70.0),), "force_over_height needs two heights or more"),
        (((0.0, 70.0), (0.0, 71.0)), "two heights or more, rising from"),
        (((0.1, 70.0), (0.2, 71.0)), "rising from <= 0 to >= 0 m"),
        (((-0.1, 80.0), (0.2, 80.0)), "must be static_force, 70 N, at height 0"),
        (((-4.0, 70.0), (0.2, 70.0)), "from -3 to 3 m"),
        (((-0.5, 70.0), (0.5, -70.0)), "from 0 to 1,000 N"),
    ],
)
def test_a_bad_table_is_refused(table, said):
    with pytest.raises((InputError, ValueError), match=said):
        with_table(force_over_height=table)


def test_a_table_that_does_not_hold_the_line_s_heights_is_refused():
    short = with_table(force_over_height=((-0.1, 70.0), (0.0, 70.0), (0.4, 75.0)))
    simulate(pantograph=short, accuracy="fast", distance=120.0)  # a level line
    with pytest.raises(InputError, match=r"hangs at 0 to 0.5 m; give force_over_height of 'dsa250' at all"):
        slowly(short, UP)


@pytest.mark.longer
def test_estimators_know_what_the_height_adds(tmp_path):
    """Else the force would be 40 N wrong beyond the ramp."""
    run = slowly(with_table(), UP)
    run.save(tmp_path / "run.parquet")
    again = Trajectory.load(tmp_path / "run.parquet")
    np.testing.assert_array_equal(again.lift_by_height, run.lift_by_height)
    np.testing.assert_allclose(run.lift_by_height, closed_form(run.position, with_table()), atol=1e-9)
    motion = measure(run)
    found = estimate(motion, DSA250)
    late = motion.time > 0.7 * motion.time[-1]
    assert (found.force - motion.contact_force)[late].mean() == pytest.approx(0.0, abs=1.0)
    assert run.lift_by_height[-1] > 40.0


@pytest.mark.slow
def test_the_estimator_among_the_sensors_knows_it_too():
    settings = {"catenary": line_over((0.5,) * 12), "pantograph": DSA250, "speed_kmh": 100.0}
    task = Task(run_settings(settings | {"observation": "estimated", "sensors": "ideal", "accuracy": "fast"}))
    task.reset(0, np.random.default_rng(0))
    error = []
    for _ in range(1000):
        task.step(np.zeros((1, 1)))
        seen = task.layout.read(task.results.observation[0], "contact force")
        error.append(seen - task.plant.of(0, Row.CONTACT_FORCE))
    assert np.mean(error[400:]) == pytest.approx(0.0, abs=2.0)


def test_a_rig_has_the_heights_of_its_line():
    line = line_over((0.2,) * 15).model_dump(exclude={"sources", "spans"}, exclude_none=True)
    high = RigData.model_validate({"name": "rig", "description": "on a high line", "line": line, "spans": 14})
    assert high.contact_heights == (0.2,) * 15
    plant = Plant(high, Train.of(DSA250))
    assert plant.run.levels.tolist() == [0.2] * 15
