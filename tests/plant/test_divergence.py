"""Where a computation is no longer finite, the episode ends with a reason; what must be so is refused."""

import warnings

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_pantograph
from panto_env.control import Task, record
from panto_env.control.settings import run_settings
from panto_env.control.state import TaskRow
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.state import Ending, Row


@pytest.mark.parametrize(
    ("name", "row", "value"),
    [
        ("Pantograph-v0", 0, np.nan),
        ("PantographStiffness-v0", 1, np.inf),
        ("PantographThreeSpan-v0", 2, -np.inf),
        ("Pantograph-v0", 3, 1e300),
    ],
)
def test_an_episode_that_is_no_longer_finite_ends(name, row, value):
    env = gymnasium.make(f"panto_env:{name}")
    env.reset(seed=0)
    env.step(np.zeros(1, dtype=np.float32))
    task = env.unwrapped.task
    task.plant.run.table[0, 0, Row.STATE + row] = value
    with pytest.warns(AccuracyWarning, match="diverged, so it has no result"):
        seen, reward, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated) == (True, False)
    assert env.observation_space.contains(seen)
    assert np.isfinite(reward)
    assert reward < -1.0  # it does not pay
    assert all(np.isfinite(each) for each in info["reward_terms"].values())
    assert info["figures"] == {}  # it has none
    assert "the computation diverged: the collector head came to a height of" in task.ending(0)
    assert "m, which is not within ±3 m" in task.divergence(0)
    with pytest.raises(InputError, match="diverged"):
        task.figures(0)
    with warnings.catch_warnings(action="error"):
        assert np.isfinite(env.reset(seed=0)[0]).all()  # nothing of it stays
        assert np.isfinite(env.step(np.zeros(1, dtype=np.float32))[1])


def test_the_other_lanes_go_on():
    envs = [gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=5) for _ in range(2)]
    for each in envs:
        each.reset(seed=0)
    envs[0].unwrapped.task.plant.run.table[0, 2, Row.STATE] = np.nan
    actions = np.zeros(envs[0].action_space.shape, dtype=np.float32)
    with pytest.warns(AccuracyWarning, match="diverged"):
        told = envs[0].step(actions)
    others = np.arange(5) != 2
    for ours, usual in zip(told[:4], envs[1].step(actions)[:4], strict=True):
        assert np.isfinite(ours).all()
        np.testing.assert_array_equal(ours[others], usual[others])
    assert told[2].tolist() == [False, False, True, False, False]
    assert "std" not in told[4].get("figures", {})


def changed(**values):
    return PantographData.model_validate(load_pantograph("en50318-2002").model_dump() | values)


def test_a_pantograph_that_nothing_lifts_is_refused_or_trimmed():
    limp = changed(static_force=0.0, aerodynamic_coefficient=0.0)
    for made in (simulate, lambda **own: gymnasium.make("panto_env:Pantograph-v0", **own).reset(seed=0)):
        with pytest.raises(
            InputError, match="nothing presses 'en50318-2002' against the wire: its lift is 0 N"
        ):
            made(pantograph=limp)
    assert simulate(pantograph=limp, mean_force=110.0).summary().mean == pytest.approx(110.0, abs=0.5)


def test_a_mass_that_nothing_holds_up_is_named():
    for spring in (0.0, 0.5):
        with pytest.raises(ValueError, match=r"nothing holds mass 1 up with \S+ N/m below it"):
            changed(stiffnesses=(spring, 50.0))
    run = simulate(pantograph=changed(stiffnesses=(4200.0, 0.0)), distance=120.0)
    assert np.isfinite(run.contact_force).all()


def stiff_frame(**values):
    """TSG18F as published in a simulation of a rigid line: its frame hangs on a spring of 41 N/mm."""
    published = {
        "masses": (10.31, 6.15, 15.30),
        "stiffnesses": (53415.8, 6754.2, 40687.0),
        "dampings": (29.60, 0.20, 1.14),
        "static_force": 110.0,
        "contact_stiffness": 82300.0,
        "aerodynamic_coefficient": 0.0,
    }
    return changed(name="TSG18F", **published | values)


def test_a_lift_that_a_stiff_spring_takes_is_no_divergence():
    """Of the 2,515 N applied 110 N reach the wire; it was called diverged at any time step."""
    given = {"pantograph": stiff_frame(), "speed_kmh": 120, "mean_force": 110.0, "accuracy": "fast"}
    task = Task(run_settings(given | {"distance": 300.0}))
    with warnings.catch_warnings(action="error", category=AccuracyWarning):
        run = simulate(**given)
        task.reset(0, np.random.default_rng(0))
        while not task.results.truncated[0]:
            task.step(np.zeros((1, 1)))
        assert np.isfinite(task.figures(0).std)
    assert run.nominal_force > 2300.0
    assert run.summary().mean == pytest.approx(110.0, abs=0.06)


def test_what_a_spring_takes_of_the_lift_is_said():
    """Springs one after another, with the head at height 0: F = F_0 / (1 + k_3 (1 / k_1 + 1 / k_2))."""
    left = 110.0 / (1 + 40687.0 * (1 / 53415.8 + 1 / 6754.2))
    words = f"takes {110 - left:.0f} of the 110 N .* see mean_force"
    with pytest.warns(AccuracyWarning, match=words) as told:
        simulate(pantograph=stiff_frame(), speed_kmh=120, accuracy="fast", distance=600.0)
    assert [each.category for each in told].count(AccuracyWarning) == 1


def test_the_bound_that_was_passed_is_named(monkeypatch):
    monkeypatch.setattr(record, "LARGEST_DEVIATION", 5.0)
    with pytest.raises(InputError, match="the contact force was over 5 N from its static value in the mean"):
        simulate(accuracy="fast", distance=600.0)
    task = Task(run_settings({"accuracy": "fast", "distance": 600.0}))
    task.reset(0, np.random.default_rng(0))
    task.plant.run.table[0, 0, Row.WIRE_HEIGHT] = -7.25
    assert "the contact wire came to a height of -7.25 m, which is not within ±3 m" in task.divergence(0)
    task.plant.run.table[0, 0, Row.WIRE_HEIGHT] = 0.0
    task.episode.table[0, TaskRow.ENDING] = Ending.DIVERGED
    assert "diverged: a wire moved faster than 20 m/s." in task.ending(0)
