"""Environments of trains: one pantograph of several is controlled, or each is an agent."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import panto_env
from panto_env import InputError
from panto_env.analysis.simulation import OFF_LINE
from panto_env.envs import DrivenByPolicies
from panto_env.envs.settings import IDS
from panto_env.plant.state import Row
from panto_env.policies import find_policy

pettingzoo = pytest.importorskip("pettingzoo")
TRAIN = {"pantographs": ["dsa380", "dsa380"], "distances": [100.0], "speed_kmh": (280.0, 320.0)}
BOTH = {**TRAIN, "controlled": [1, 2]}
SHORT = {"distance": 250.0, "settle": 0.0}


def make(**settings):
    return gymnasium.make("Pantograph-v0", **settings)


def actions(step, rows):
    return 0.3 * np.sin(0.2 * step + np.arange(rows)[:, None]).astype(np.float32)


def test_the_second_pantograph_s_episode_begins_where_it_comes_onto_the_line():
    env = make(**TRAIN, controlled=2, run_in=0.0, **SHORT)
    _, info = env.reset(seed=1)
    stride = info["speed_kmh"] / 3.6 * 0.01
    assert 0 <= info["position"] < stride
    ended = False
    while not ended:
        *_, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        ended = terminated or truncated
    first, second = env.unwrapped.trajectory.train
    assert second.distance == pytest.approx(first.distance - 100.0)
    assert 250 <= second.distance < 250 + 2 * stride
    assert info["figures"]["distance"] == pytest.approx(second.distance, abs=2 * stride)
    assert info["figures"]["std"] == pytest.approx(second.summary("all").std, rel=0.02)


def test_the_controlled_one_alone_has_an_actuator():
    for controlled, driven in ((1, [True, False]), (2, [False, True]), ([1, 2], [True, True])):
        env = make(**TRAIN, controlled=controlled, **SHORT, washout=None)
        env.reset(seed=1)
        for _ in range(200):
            env.step(np.full(env.action_space.shape, 0.5, dtype=np.float32))
        forces = [np.abs(own.frame_force).max() > 1 for own in env.unwrapped.trajectory.train]
        assert forces == driven


def test_lanes_of_a_vector_environment_are_the_single_environment_bit_for_bit():
    vector = gymnasium.make_vec("Pantograph-v0", num_envs=4, **BOTH, **SHORT)
    alone = make(**BOTH, **SHORT)
    seen, _ = vector.reset(seed=[3, None, 8, None])
    own, _ = alone.reset(seed=8)
    for step in range(700):
        np.testing.assert_array_equal(seen[2:].ravel(), own)
        force = actions(step, 4)
        seen, rewards, *_, infos = vector.step(force)
        own, reward, terminated, truncated, info = alone.step(force[2:].ravel())
        assert reward == rewards[2:].mean()
        assert [each["reward"] for each in info["pantographs"]] == rewards[2:].tolist()
        if terminated or truncated:
            break
    assert step > 200
    figures = [each["figures"]["std"] for each in info["pantographs"]]
    assert infos["figures"]["std"][2:].tolist() == figures
    assert info["figures"]["std"] == figures[0]
    assert figures[0] != figures[1]


def parallel(**settings):
    return panto_env.parallel_env(**IDS["Pantograph-v0"] | BOTH | SHORT | settings)


@pytest.mark.longer
def test_pettingzoo_accepts_it():
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(parallel(), num_cycles=400)
    parallel_seed_test(parallel, num_cycles=20)


def test_agents_see_and_earn_what_the_environment_of_the_train_does():
    view, env = parallel(), make(**BOTH, **SHORT)
    seen, _ = view.reset(seed=2)
    own, _ = env.reset(seed=2)
    assert view.agents == ["pantograph_1", "pantograph_2"]
    for step in range(900):
        np.testing.assert_array_equal(np.concatenate(list(seen.values())), own)
        force = actions(step, 2)
        seen, rewards, terminations, truncations, infos = view.step(
            {"pantograph_2": force[1], "pantograph_1": force[0]}
        )
        own, reward, terminated, truncated, info = env.step(force.ravel())
        assert np.mean(list(rewards.values())) == reward
        assert list(infos.values()) == info["pantographs"]
        assert set(terminations.values()) == {terminated}
        if terminated or truncated:
            break
    assert set(truncations.values()) == {True}
    assert not view.agents
    with pytest.raises(InputError, match="has not begun or has ended"):
        view.step({})


@pytest.mark.parametrize(
    ("controlled", "speed"),
    [
        (2, {"speed_kmh": 300.0}),
        ([1, 2], {"speed_kmh": 300.0}),
        (2, {"speed_profile": [(0, 220), (60, 220), (260, 190)]}),
    ],
)
def test_the_second_sees_what_the_first_measured_at_places_ahead(controlled, speed):
    """Between control steps on the straight line between readings; at rest before the first was there."""
    places, behind = (0.0, 12.5, 100.0), 100.0
    settings = {**TRAIN, "controlled": controlled, "front": places, "sensors": "ideal", **SHORT}
    env = make(**settings | {"observation": "measured", "run_in": 0.0} | speed)
    seen, _ = env.reset(seed=1)
    rows = [seen]
    ended = False
    while not ended:
        seen, _, terminated, truncated, _ = env.step(0.1 * np.ones(env.action_space.shape, dtype=np.float32))
        rows.append(seen)
        ended = terminated or truncated
    task, first = env.unwrapped.task, env.unwrapped.trajectory
    names = [entry.name for entry in task.layout.entries]
    columns = [names.index(f"front force, {place:g} m ahead") for place in places]
    observed = 100 * np.array(rows)[:, -len(names) :][:, columns]
    every = task.length.control_steps
    at_rest = task.samples.rows[0, 0, 0, Row.CONTACT_FORCE]
    read = np.append(at_rest, first.contact_force[every - 1 :: every])
    last = len(first.contact_force) // every
    times = np.arange(last + 1)
    way = task.plant.position(0, times * every)
    then = np.interp(way[-len(rows) :, None] + np.array(places) - behind, way, times)
    expected = np.interp(then.ravel(), times, read).reshape(len(rows), -1)
    assert expected.std() > 20
    np.testing.assert_allclose(observed, expected, atol=2e-2)


def test_noise_of_the_one_in_front_is_in_what_it_tells():
    def told(noise):
        env = make(**TRAIN, controlled=2, front=(100.0,), sensors={"force_noise": noise}, **SHORT)
        env.reset(seed=3)
        rows = [env.step(np.zeros(1, dtype=np.float32))[0] for _ in range(200)]
        place = env.unwrapped.task.layout.index("front force, 100 m ahead")
        return 30 * np.array(rows)[:, place]

    assert np.std(told(10.0) - told(0.0)) == pytest.approx(10.0, rel=0.2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"controlled": 2, "front": (0.0, 101.0)}, "at most the 100 m to the pantograph in front"),
        ({"controlled": 1, "front": (0.0,)}, "no controlled one has any in front of it"),
        ({"controlled": 2, "front": (5.0, 2.0)}, "front must be increasing distances"),
        ({"distances": [200.0, 100.0], "pantographs": ["dsa380"] * 3}, "must increase"),
        ({"distances": [-5.0]}, "must be positive numbers"),
        ({"distances": [50.0, 100.0]}, "must give 1 numbers, one for each of the pantographs behind"),
        ({"pantographs": ["dsa380"] * 5, "distances": [1, 2, 3, 4]}, "has up to 4 pantographs, not 5"),
        ({"controlled": [1, 2, 3]}, "controlled names pantograph 3, but the train has only 2"),
        ({"controlled": [2, 2]}, "must name different pantographs"),
        ({"pantograph": "dsa250"}, "pantograph is the first of pantographs, 'dsa380', not 'dsa250'"),
        ({"catenary": "periodic-stiffness"}, "Several pantographs need a flexible catenary"),
        ({"distances": [5000.0], "spans": 20}, "5000 m behind the first.*has 1140 m for it"),
        (
            {"distances": [300.0], "catenary": "sweden-st15-bridge", "distance": 5e3},
            "distance must be at most",
        ),
    ],
)
def test_trains_that_cannot_be_are_refused_in_a_sentence(given, message):
    with pytest.raises(InputError, match=message):
        make(**TRAIN | given)


def test_lanes_that_are_no_whole_trains_and_actions_of_agents_are_refused():
    with pytest.raises(InputError, match="must be a multiple of that, not 3"):
        gymnasium.make_vec("Pantograph-v0", num_envs=3, **BOTH)
    view = parallel()
    view.reset(seed=1)
    one = np.zeros(1, dtype=np.float32)
    with pytest.raises(InputError, match="action for each of pantograph_1, pantograph_2"):
        view.step({"pantograph_1": one})
    with pytest.raises(InputError, match="must have the shape"):
        view.step({"pantograph_1": one, "pantograph_2": np.zeros(2)})


@pytest.mark.parametrize(("driven", "own"), [(1, 1), (2, 0)])
def test_a_policy_by_name_drives_the_others(driven, own):
    """The records are those of a run in which each has its policy, which a constant action is here."""
    given = BOTH | SHORT | {"washout": 0.0, "run_in": 0.0, "speed_kmh": 300.0, "line_condition": "smooth"}
    given |= {"pantograph_scatter": 0.0, "window": None, "sensors": "ideal"}
    env = DrivenByPolicies(make(**given), {driven: "pd"})
    assert env.action_space.shape == (1,)
    observation, info = env.reset(seed=3)
    assert observation in env.observation_space
    rewards, ended = [], False
    while not ended:
        on_line = info["pantographs"][own]["position"] >= -OFF_LINE  # a policy waits until then
        action = np.array([0.2 * on_line], dtype=np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        assert reward == info["pantographs"][own]["reward"]
        rewards.append(reward)
        ended = terminated or truncated
    assert observation.shape == env.observation_space.shape
    assert sum(rewards) < 0
    policies = [Rounded(), Constant()] if driven == 1 else [Constant(), Rounded()]
    settings = IDS["Pantograph-v0"] | given
    alike = {name: settings[name] for name in ("actuator", "sensors", "line_condition", "window")}
    alike |= {"pantographs": BOTH["pantographs"], "distances": BOTH["distances"], "controlled": [1, 2]}
    alike["observation"] = "centred"
    run = panto_env.simulate(**alike, speed_kmh=300.0, policy=policies, seed=3, distance=250.0)
    for one, other in zip(env.unwrapped.trajectory.train, run.train, strict=True):
        count = min(len(one.contact_force), len(other.contact_force))
        assert count > 700
        np.testing.assert_array_equal(one.frame_force[:count], other.frame_force[:count])
        np.testing.assert_array_equal(one.contact_force[:count], other.contact_force[:count])


class Rounded:
    """The policy pd, with actions as an environment takes them."""

    def reset(self, context):
        self.law = find_policy("pd")
        self.law.reset(context)

    def act(self, observation):
        return self.law.act(observation).astype(np.float32)


class Constant:
    def reset(self, context):
        pass

    def act(self, observation):
        return np.array([0.2], dtype=np.float32)


@pytest.mark.longer
@pytest.mark.parametrize("driven", [False, True])
def test_trains_pass_gymnasium_s_check_and_go_on_as_their_copies(driven):
    env = make(**BOTH, **SHORT, washout=0.0)
    env = DrivenByPolicies(env, {1: "repetitive"}) if driven else env.unwrapped
    check_env(env, skip_render_check=True)
    env.reset(seed=1)
    action = np.full(env.action_space.shape, 0.1, dtype=np.float32)
    for _ in range(120):
        env.step(action)
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(20):
        one, other = (each.step(-action) for each in (env, twin))
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1] == other[1]


@pytest.mark.parametrize(
    ("settings", "policies", "says"),
    [
        (BOTH, {1: "pd"}, r"The policy 'pd' needs washout = 0.0, but the environment has 1.0; set it"),
        (BOTH | {"washout": 0.0}, {1: "pf"}, "Unknown policy 'pf'"),
        (BOTH | {"washout": 0.0}, {}, "drive some, and not all, of the controlled .* 1 and 2, not none"),
        (BOTH | {"washout": 0.0}, {1: "pd", 2: "pd"}, "some, and not all, .* 1 and 2, not 1 and 2"),
        (BOTH | {"washout": 0.0}, {3: "pd"}, "controlled pantographs 1 and 2, not 3"),
        (TRAIN | {"controlled": 2, "washout": 0.0}, {1: "pd"}, "controlled pantographs 2, not 1"),
    ],
)
def test_what_policies_cannot_drive_is_refused_in_a_sentence(settings, policies, says):
    with pytest.raises(InputError, match=says):
        DrivenByPolicies(make(**settings), policies)
