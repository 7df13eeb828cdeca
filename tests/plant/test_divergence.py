"""Where a computation is no longer finite, the episode ends with a reason; what must be so is refused."""

import warnings

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_pantograph
from panto_env.envs import IDS
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.state import Row


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("row", [Row.STATE, Row.STATE + 1, Row.STATE + 2, Row.STATE + 3])
@pytest.mark.parametrize("name", IDS)
def test_an_episode_that_is_no_longer_finite_ends(name, row, value):
    env = gymnasium.make(f"panto_env:{name}")
    env.reset(seed=0)
    env.step(np.zeros(1, dtype=np.float32))
    task = env.unwrapped.task
    task.plant.run.table[0, 0, row] = value
    with pytest.warns(AccuracyWarning, match="diverged, so it has no result"):
        seen, reward, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated) == (True, False)
    assert env.observation_space.contains(seen)
    assert np.isfinite(reward)
    assert reward < -1.0  # it does not pay
    assert all(np.isfinite(each) for each in info["reward_terms"].values())
    assert info["figures"] == {}  # it has none
    assert "the computation diverged" in task.ending(0)
    with pytest.raises(InputError, match="diverged"):
        task.figures(0)
    with warnings.catch_warnings(action="error"):
        assert np.isfinite(env.reset(seed=0)[0]).all()  # nothing of it stays
        assert np.isfinite(env.step(np.zeros(1, dtype=np.float32))[1])


@pytest.mark.parametrize("name", IDS)
def test_the_other_lanes_go_on(name):
    envs = [gymnasium.make_vec(f"panto_env:{name}", num_envs=5) for _ in range(2)]
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
    for made in (
        lambda: simulate(pantograph=limp),
        lambda: gymnasium.make("panto_env:Pantograph-v0", pantograph=limp).reset(seed=0),
    ):
        with pytest.raises(
            InputError, match=r"nothing presses 'en50318-2002' against the wire: its lift is 0 N"
        ):
            made()
    assert simulate(pantograph=limp, mean_force=110.0).summary().mean == pytest.approx(110.0, abs=0.5)


@pytest.mark.parametrize("spring", [0.0, 1e-300, 0.5])
def test_a_mass_that_nothing_holds_up_is_named(spring):
    with pytest.raises(ValueError, match=r"nothing holds mass 1 up with \S+ N/m below it"):
        changed(stiffnesses=(spring, 50.0))
    assert np.isfinite(simulate(pantograph=changed(stiffnesses=(4200.0, 0.0))).contact_force).all()
