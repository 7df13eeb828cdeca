"""What every class of environment promises of copies, seeds, threads and refusals."""

import copy
import pickle

import cloudpickle
import gymnasium
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")
pytest.importorskip("pettingzoo")
from panto_agents.lanes import PantographVecEnv  # noqa: E402
from panto_env import InputError, parallel_env  # noqa: E402
from panto_env.envs import IDS  # noqa: E402

NAME = "panto_env:PantographStiffness-v0"
LIVELY = {"sensors": "realistic", "speed_kmh": (200.0, 300.0), "line_condition": "fair", "distance": 20.0}


def flat(values):
    """All numbers of an answer, in order."""
    if isinstance(values, dict):
        values = [values[key] for key in sorted(values) if not key.startswith("_")]
    if isinstance(values, list | tuple):
        return np.concatenate([flat(each) for each in values]) if len(values) else np.zeros(0)
    if isinstance(values, torch.Tensor):
        values = values.cpu().numpy()
    return np.asarray(values, dtype=float).ravel()


class Single:
    """One environment; the others differ in how they are made, and in the form of their answers."""

    @staticmethod
    def make():
        return gymnasium.make(NAME, disable_env_checker=True, **LIVELY).unwrapped

    @staticmethod
    def reset(env, seed=None):
        return flat(env.reset(seed=seed)[0])

    @staticmethod
    def action(env, number):
        return np.full(env.action_space.shape, number, dtype=np.float32)

    @classmethod
    def step(cls, env, number):
        """Observation, reward and ends; a new episode begins where one has ended."""
        answer = env.step(cls.action(env, number))
        return flat(answer[:4]), bool(np.any(answer[2:4]))

    @staticmethod
    def lock(env):
        return env._in_use


class Vector(Single):
    @staticmethod
    def make():
        return gymnasium.make_vec(NAME, num_envs=3, **LIVELY)


class Tensors(Vector):
    @staticmethod
    def make():
        return gymnasium.make_vec(NAME, num_envs=3, device="cpu", starts=2, **LIVELY)

    @staticmethod
    def action(env, number):
        return torch.full(env.action_space.shape, number)

    @classmethod
    def step(cls, env, number):
        answer = env.step(cls.action(env, number))
        return flat(answer[:4]), bool((answer[2] | answer[3]).any())


class Parallel(Single):
    @staticmethod
    def lock(env):
        return env.train._in_use

    @staticmethod
    def make():
        return parallel_env(**IDS["PantographStiffness-v0"] | LIVELY)

    @staticmethod
    def action(env, number):
        return {name: np.full(1, number, dtype=np.float32) for name in env.possible_agents}

    @classmethod
    def step(cls, env, number):
        answer = env.step(cls.action(env, number))
        return flat(answer[:4]), not env.agents


class OfStableBaselines(Single):
    @staticmethod
    def make():
        return PantographVecEnv(gymnasium.make_vec(NAME, num_envs=3, **LIVELY))

    @staticmethod
    def reset(env, seed=None):
        if seed is not None:
            env.seed(seed)
        return flat(env.reset())

    @staticmethod
    def action(env, number):
        return np.full((3, 1), number, dtype=np.float32)

    @classmethod
    def step(cls, env, number):
        answer = env.step(cls.action(env, number))
        return flat(answer[:3]), bool(answer[2].any())

    @staticmethod
    def lock(env):
        return env.env._in_use


CLASSES = {each.__name__: each for each in (Single, Vector, Tensors, Parallel, OfStableBaselines)}
COPIES = {
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
    "cloudpickle": lambda env: pickle.loads(cloudpickle.dumps(env)),
    "deepcopy": copy.deepcopy,
    "copy": copy.copy,
}
every = pytest.mark.parametrize("kind", CLASSES.values(), ids=CLASSES)


def run(kind, env, steps, seed=0):
    """All answers to actions drawn with a seed, over the ends of episodes."""
    random, answers = np.random.default_rng(seed), []
    for number in random.uniform(-1, 1, steps).tolist():
        seen, ended = kind.step(env, number)
        answers.append(seen)
        if ended and kind in (Single, Parallel):
            answers.append(kind.reset(env))
    return np.concatenate(answers)


@pytest.mark.longer
@every
def test_copies_go_on_as_the_original_and_none_moves_another(kind):
    env = kind.make()
    kind.reset(env, 4)
    run(kind, env, 12)
    twins = {way: make(env) for way, make in COPIES.items()}
    third = copy.copy(env)
    run(kind, third, 40, seed=2)  # on another way
    kind.reset(third, 9)
    answers = run(kind, env, 45, seed=1)
    begun = kind.reset(env)
    assert np.ptp(answers) > 0
    for way, twin in twins.items():
        np.testing.assert_array_equal(run(kind, twin, 45, seed=1), answers, way)
        np.testing.assert_array_equal(kind.reset(twin), begun, way)


@pytest.mark.longer
@every
def test_a_seed_begins_the_same_whatever_came_before(kind):
    env = kind.make()
    first = kind.reset(env, 3)
    answers = run(kind, env, 40)
    kind.reset(env)
    run(kind, env, 7, seed=5)  # broken off
    np.testing.assert_array_equal(kind.reset(env, 3), first)
    np.testing.assert_array_equal(run(kind, env, 40), answers)
    assert not np.array_equal(kind.reset(env, 4), first)


def test_an_episode_broken_off_changes_the_next_one_without_a_seed():
    """As docs/environments/rules.md says: noise has been drawn from the same generator."""
    speeds = []
    for steps in (3, 3, 100):
        env = gymnasium.make(NAME, **LIVELY | {"distance": 60.0})
        env.reset(seed=3)
        ended = False
        while steps and not ended:
            _, _, _, ended, _ = env.step(np.zeros(1, np.float32))
            steps -= 1
        speeds.append(env.reset()[1]["speed_kmh"])
    assert speeds[0] == speeds[1] != speeds[2]


@pytest.mark.longer
@every
def test_a_bad_seed_changes_nothing(kind):
    env = kind.make()
    kind.reset(env, 3)
    twin = copy.deepcopy(env)
    if kind is OfStableBaselines:
        env._seeds = [-1] * 3
    with pytest.raises(InputError, match="seed must be a whole number from 0 up"):
        kind.reset(env, None if kind is OfStableBaselines else -1)
    np.testing.assert_array_equal(run(kind, env, 5), run(kind, twin, 5))


@pytest.mark.longer
@every
def test_an_environment_in_use_is_neither_used_nor_copied(kind):
    env = kind.make()
    kind.reset(env, 3)
    assert kind.lock(env).begin(False)
    for use in (lambda env: kind.step(env, 0.0), kind.reset, *COPIES.values()):
        with pytest.raises(InputError, match="Another thread is using this environment"):
            use(env)
    kind.lock(env).end()
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(run(kind, twin, 5), run(kind, env, 5))


def bad_actions(kind, env):
    good = kind.action(env, 0.5)
    if kind is Parallel:
        name = env.possible_agents[0]
        inner = [np.array([np.nan]), np.zeros(2), "up", None, torch.zeros(1, requires_grad=True)]
        return [None, {}, good | {"other": np.zeros(1)}, 0.5, *({name: each} for each in inner)]
    as_tensor = torch.as_tensor(good)
    bad = ["up", None, {}, {0.5}, [[0.5], [0.5, 0.5]], np.ma.masked_array(as_tensor.numpy(), mask=True)]
    bad += [as_tensor.clone().requires_grad_(), as_tensor.to_sparse(), as_tensor.to(torch.complex64)]
    wrong = [good[..., None], good * np.nan, good * np.inf, good[:-1]]
    if kind is Tensors:
        bad += [as_tensor.numpy(), as_tensor.to("meta"), torch.nested.nested_tensor(list(as_tensor))]
    return [*bad, *wrong]


@pytest.mark.longer
@every
def test_what_is_no_action_is_refused_and_changes_nothing(kind):
    env = kind.make()
    kind.reset(env, 3)
    twin = copy.deepcopy(env)
    for action in bad_actions(kind, env):
        with pytest.raises(InputError, match=r"[Aa]ction"):
            env.step(action)
    np.testing.assert_array_equal(run(kind, env, 20), run(kind, twin, 20))


@pytest.mark.longer
@every
def test_options_that_are_none_are_refused_and_change_nothing(kind):
    env = kind.make()
    kind.reset(env, 3)
    twin = copy.deepcopy(env)
    for options in ({"sped_kmh": 200}, {"device": "cpu"}, {"observation": "full"}, [("speed_kmh", 200)]):
        given = {"options": options}
        if kind is OfStableBaselines:
            env.set_options(given.pop("options") if isinstance(options, dict) else [{"speed_kmh": 2}, {}, {}])
            given = {}
        with pytest.raises(InputError, match="option"):
            env.reset(**given)
    np.testing.assert_array_equal(run(kind, env, 5), run(kind, twin, 5))


@pytest.mark.longer
@every
def test_an_argument_is_not_set_as_an_attribute(kind):
    """It had been set without a word and without any effect."""
    env = kind.make()
    with pytest.raises(InputError, match="speed_kmh can't be set later; give it to make, or to reset"):
        env.speed_kmh = 200
    assert not hasattr(env, "speed_kmh")


@pytest.mark.longer
def test_an_environment_of_tensors_is_used_within_inference_mode_and_after():
    env = Tensors.make()
    Tensors.reset(env, 3)
    twin = copy.deepcopy(env)
    with torch.inference_mode():
        first = run(Tensors, env, 60)
    np.testing.assert_array_equal(run(Tensors, twin, 60), first)
    np.testing.assert_array_equal(run(Tensors, twin, 60), run(Tensors, env, 60))


TRAIN = {"pantographs": ["dsa380", "dsa380"], "distances": [100.0], "controlled": [1, 2], "distance": 20.0}
TRAIN |= {"settle": 0.0, "accuracy": "fast", "line_condition": "smooth", "run_in": 0.0}


@pytest.mark.parametrize("device", [None, pytest.param("cpu", marks=pytest.mark.slow)])
@pytest.mark.parametrize("mask", [[False, True, False, False], [True, True, True, False]])
def test_a_reset_mask_names_whole_trains(device, mask):
    """Parts of trains ended in IndexErrors, or moved one pantograph of two."""
    more = {} if device is None else {"device": device}
    envs = gymnasium.make_vec("panto_env:Pantograph-v0", 4, autoreset_mode="Disabled", **TRAIN, **more)
    convert = np.array if device is None else torch.tensor
    envs.reset(seed=3)
    twin = copy.deepcopy(envs)
    lanes = "0 to 1" if mask[1] and not mask[0] else "2 to 3"
    with pytest.raises(InputError, match=f"a part of a train: mark all of lanes {lanes}, or none"):
        envs.reset(options={"reset_mask": convert(mask)})
    still = Tensors.action(envs, 0.1) if device else Single.action(envs, 0.1)
    for env in (envs, twin):
        env.step(still)
        env.reset(options={"reset_mask": convert([False, False, True, True])})
    np.testing.assert_array_equal(flat(envs.step(still)[:4]), flat(twin.step(still)[:4]))


@pytest.mark.longer
def test_lanes_have_the_attributes_and_calls_of_gymnasium_s():
    for kind in (Vector, Tensors):
        envs = kind.make()
        envs.reset(seed=3)
        speeds = [context.speed for context in envs.call("context")]
        assert len(speeds) == 3
        assert len(set(speeds)) > 1
        assert envs.get_attr("action_space") == (envs.single_action_space,) * 3
        assert envs.get_attr("render_mode") == (None,) * 3
        with pytest.raises(InputError, match="The lanes step together"):
            envs.call("step", 0)
        with pytest.raises(InputError, match="share one environment, whose speed_kmh stays"):
            envs.set_attr("speed_kmh", 200)
        with pytest.raises(AttributeError, match="nothing"):
            envs.get_attr("nothing")
    envs = Vector.make()
    envs.reset(seed=3)
    assert envs.get_attr("np_random_seed") == (3, 4, 5)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("device", "has no argument 'device', which only gymnasium.make_vec takes"),
        ("speed_kmhh", "unexpected keyword argument 'speed_kmhh'; did you mean 'speed_kmh'"),
    ],
)
def test_an_argument_of_another_class_is_said_to_be_that(name, hint):
    with pytest.raises(TypeError, match=hint):
        gymnasium.make(NAME, **{name: "cuda"})


def test_a_word_of_an_argument_s_name_suggests_all_that_have_it():
    with pytest.raises(InputError, match="'limit' is not known: did you mean 'force_limit' or 'rate_limit'"):
        gymnasium.make(NAME, actuator={"limit": 50})
