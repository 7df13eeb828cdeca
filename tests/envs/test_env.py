"""The single environment: rewards, ends of episodes, options, refusals."""

import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env import InputError
from panto_env.envs import BARE, IDS
from panto_env.envs.settings import render_metadata


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def run_episode(env, seed=0):
    env.reset(seed=seed)
    env.action_space.seed(seed)
    rewards, infos = [], []
    while True:
        _, reward, terminated, truncated, info = env.step(env.action_space.sample())
        rewards.append(reward)
        infos.append(info)
        if terminated or truncated:
            return rewards, infos, terminated


@pytest.mark.parametrize("name", IDS)
def test_reward_terms_sum_to_the_trajectory_s_cf_and_cl(name):
    env = gymnasium.make(name, speed_kmh=320, run_in=0.0, settle=0.0, reward="paper1")
    _, infos, terminated = run_episode(env)
    assert not terminated
    run = env.unwrapped.trajectory
    figures = run.summary("all")
    sums = {key: sum(info["reward_terms"][key] for info in infos) for key in infos[0]["reward_terms"]}
    assert sums["cost_function"] == pytest.approx(figures.cost_function, rel=1e-9)
    assert sums["contact_loss"] == pytest.approx(figures.contact_loss, rel=1e-9, abs=1e-9)
    # Eq. 14 once more, by NumPy on the raw force
    stride = run.speed_kmh / 3.6 * run.time_step
    assert figures.cost_function == pytest.approx(
        np.trapezoid(np.abs(run.contact_force - run.nominal_force), dx=stride), rel=1e-9
    )
    # Kept sample by sample instead of computed from all of them: the same but for rounding.
    assert infos[-1]["figures"] == pytest.approx(
        {k: v for k, v in figures.as_dict().items() if not np.isnan(v)}, rel=1e-9
    )
    assert not any("figures" in info for info in infos[:-1])


@pytest.mark.longer
def test_import_compiles_nothing_leaves_heavy_packages_alone_and_makes_ids_known():
    code = (
        "import sys, panto_env; from panto_env.plant import step;"
        "heavy = {'torch', 'stable_baselines3', 'matplotlib', 'pyarrow', 'scipy.linalg', 'scipy.signal'};"
        "heavy |= {'cv2', 'PIL', 'panto_env.render.viewer', 'panto_env.render.picture'};"
        "print(len(step.advance.signatures), sorted(heavy & set(sys.modules)));"
        "import gymnasium; print(gymnasium.make('panto_env:Pantograph-v0').reset(seed=0)[0].shape)"
    )
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert result.stdout.split("\n")[:2] == ["0 []", "(10,)"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"speed_kmh": 0}, "The speed must lie above 0 and below the wave speed"),
        ({"speed_kmh": float("nan")}, "not at nan km/h"),
        ({"speed_kmh": (300, 200)}, "must not fall"),
        ({"speed_kmh": "fast"}, "must be a number or a range of two"),
        ({"catenary": "en50318"}, "did you mean 'en50318-2002'"),
        ({"pantograph": "missing.toml"}, "missing.toml does not exist"),
        ({"sensors": {"noise": 1}}, "sensors is not valid: key 'noise'"),
        ({"reward": {"cost_function": -1}}, "reward is not valid: key 'cost_function'"),
        ({"observation": "everything"}, "observation must be one of measured, full"),
        ({"control_interval": 0.0015, "time_step": 1e-3}, "whole number of time steps"),
        ({"window": 2}, "must be a number of spans from 3 up"),
        ({"precision": "half"}, "precision must be 'single' or 'double', not 'half'"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(settings, message):
    with pytest.raises(InputError, match=message) as caught:
        panto_env.envs.PantographEnv(**settings)
    assert "\n" not in str(caught.value)


def test_unknown_argument_is_a_type_error_as_in_python():
    with pytest.raises(TypeError, match="unexpected keyword argument 'pantogaph'; did you mean 'pantograph'"):
        panto_env.envs.PantographVectorEnv(pantogaph="dsa250")
    with pytest.raises(TypeError, match="unexpected keyword argument 'velocity'"):
        panto_env.simulate(velocity=300)


def test_options_hold_for_one_episode():
    env = gymnasium.make("Pantograph-v0", **BARE).unwrapped
    _, info = env.reset(seed=0, options={"speed_kmh": 250})
    assert info["speed_kmh"] == pytest.approx(250)
    _, info = env.reset()
    assert info["speed_kmh"] == pytest.approx(300)


def test_step_outside_an_episode_is_refused():
    env = panto_env.envs.PantographEnv(distance=20)
    with pytest.raises(InputError, match="call reset before step"):
        env.step(np.zeros(1))
    _, _, terminated = run_episode(env)
    assert not terminated
    with pytest.raises(InputError, match="call reset before step"):
        env.step(np.zeros(1))


def test_contact_lost_for_half_a_second_or_a_head_too_high_ends_the_episode():
    drop, lift = -np.ones(1), np.ones(1)
    env = gymnasium.make("PantographStiffness-v0", actuator={"force_limit": 165.0}).unwrapped
    env.reset(seed=0)  # under 157 N: without contact the pantograph sinks slowly
    terminated, lost = False, 0
    while not terminated:
        _, _, terminated, _, info = env.step(drop)
        lost = lost + 1 if info["reward_terms"]["contact_loss"] > 0 else 0
    assert lost * 0.01 == pytest.approx(0.5, abs=0.011)
    env.reset(seed=0, options={"actuator": {"force_limit": 4000.0}})
    terminated = False
    while not terminated:
        assert abs(info["head"]) < 0.3 or info["contact_force"] == 0
        _, _, terminated, truncated, info = env.step(lift)
        assert not truncated
    assert info["head"] > 0.25
    assert env.trajectory.contact_force[-1] > 0


def test_episode_covers_its_distance_in_whole_control_steps():
    """A step is 10 ms at 300 km/h unless told otherwise."""
    env = gymnasium.make("PantographStiffness-v0", distance=20.5)
    _, infos, terminated = run_episode(env)
    assert not terminated
    assert env.unwrapped.context.control_interval == 0.01
    assert infos[0]["speed_kmh"] == pytest.approx(300)
    assert len(infos) == 25  # of 0.83 m
    assert infos[-1]["position"] == pytest.approx(25 * 0.01 * 300 / 3.6)


def test_frames_per_second_are_whole_where_they_nearly_are():
    def found(control_interval, slow_motion=1.0):
        given = SimpleNamespace(control_interval=control_interval, slow_motion=slow_motion)
        return render_metadata({}, given)["render_fps"]

    assert 1 / (1 / 49) != 49
    assert [found(1 / n) for n in range(1, 200)] == list(range(1, 200))
    assert found(0.03, 2.0) == pytest.approx(1 / 0.06)


def test_the_page_of_the_default_id_names_its_speeds():
    low, high = IDS["Pantograph-v0"]["speed_kmh"]
    page = Path(panto_env.__file__).parents[1] / "docs" / "environments" / "pantograph.md"
    assert f"at {low:g} to {high:g} km/h" in page.read_text(encoding="utf-8")
