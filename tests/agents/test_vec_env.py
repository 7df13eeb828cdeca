import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from gymnasium.wrappers.vector import NormalizeObservation
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecMonitor, VecVideoRecorder

from panto_agents.lanes import PantographVecEnv
from panto_env import InputError

NAME = "panto_env:PantographStiffness-v0"


def make(lanes=3, mode="SameStep", **settings):
    return PantographVecEnv(gymnasium.make_vec(NAME, num_envs=lanes, autoreset_mode=mode, **settings))


@pytest.mark.parametrize("make_model", [PPO, SAC])
def test_stable_baselines_given_a_vector_environment_itself_names_its_wrapper(make_model):
    native = gymnasium.make_vec(NAME, num_envs=3)
    with pytest.raises(InputError, match=r"from panto_agents.lanes import PantographVecEnv"):
        make_model("MlpPolicy", native)
    assert repr(type(native)) == "<class 'panto_env.envs.vector.PantographVectorEnv'>"


def test_what_is_no_vector_environment_is_refused():
    for other in (gymnasium.make(NAME), gymnasium.make_vec("CartPole-v1"), "env"):
        with pytest.raises(
            InputError, match=r"needs an environment of gymnasium.make_vec for Pantograph-v0, .* not"
        ):
            PantographVecEnv(other)


@pytest.mark.parametrize("mode", ["NextStep", "Disabled"])
def test_every_mode_of_autoreset_gives_the_same(mode):
    settings = {"distance": 20.0, "sensors": "realistic", "speed_kmh": (200, 300)}
    envs = [make(**settings), make(mode=mode, **settings)]
    for env in envs:
        env.seed(4)
    np.testing.assert_array_equal(*[env.reset() for env in envs])
    ends = 0
    for action in np.random.default_rng(0).uniform(-1, 1, (90, 3, 1)):
        mine, other = (env.step(action) for env in envs)
        for info in (*mine[3], *other[3]):
            info.get("episode", {"t": 0}).pop("t")  # on the clock
        np.testing.assert_equal(mine, other)
        ends += mine[2].sum()
    assert ends > 6


def test_wrappers_of_gymnasium_may_stand_between():
    native = gymnasium.make_vec(NAME, num_envs=3, distance=10.0)
    env = PantographVecEnv(NormalizeObservation(native))
    assert np.abs(env.reset()).max() < 10
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=32, device="cpu")
    model.learn(96)
    assert native.unwrapped.np_random_seed == env.get_attr("np_random_seed")[0]


def test_ends_as_stable_baselines_expects():
    env = make(distance=10.0)
    env.seed(4)
    first = env.reset()
    assert first.dtype == np.float32
    for _ in range(20):
        observation, reward, done, infos = env.step(np.zeros((3, 1), np.float32))
        if done.all():
            break
    assert done.all()
    assert reward.dtype == np.float32
    np.testing.assert_array_equal(observation, first)
    assert infos[2]["TimeLimit.truncated"]
    assert infos[2]["terminal_observation"].shape == (9,)
    assert infos[2]["figures"]["mean"] > 0


def test_seed_of_lane_i_is_seed_plus_i():
    env = make(sensors="realistic")
    env.seed(4)
    observation = env.reset()
    for lane in range(3):
        single = gymnasium.make("panto_env:PantographStiffness-v0", sensors="realistic")
        np.testing.assert_array_equal(observation[lane], single.reset(seed=4 + lane)[0])


def test_rest_of_the_interface():
    env = make()
    assert env.env_is_wrapped(VecMonitor) == [False] * 3
    assert env.get_attr("num_envs", indices=[0, 1]) == [3, 3]
    with pytest.raises(NotImplementedError, match="share one environment"):
        env.set_attr("num_envs", 1)


def test_ppo_learns_on_it_and_sees_whole_episodes():
    env = VecMonitor(make(distance=30.0))
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, seed=0, device="cpu")
    model.learn(400)
    assert {episode["l"] for episode in model.ep_info_buffer} == {36}


def test_the_end_of_an_episode_has_its_return_as_a_monitor_s():
    """Without it a training showed no reward."""
    for mode in ("SameStep", "NextStep", "Disabled"):
        plain, watched = make(mode=mode, distance=10.0), VecMonitor(make(mode=mode, distance=10.0))
        for env in (plain, watched):
            env.seed(4)
            env.reset()
        ends = 0
        for action in np.random.default_rng(0).uniform(-1, 1, (60, 3, 1)):
            *_, done, infos = plain.step(action)
            *_, others = watched.step(action)
            for lane in np.flatnonzero(done):
                ours, theirs = infos[lane]["episode"], others[lane]["episode"]
                assert set(ours) == {"r", "l", "t"}
                assert ours["l"] == theirs["l"]
                assert ours["r"] == pytest.approx(theirs["r"], rel=1e-5)
                ends += 1
        assert ends > 6
    model = PPO("MlpPolicy", make(distance=10.0), n_steps=64, batch_size=64, seed=0, device="cpu").learn(192)
    assert np.mean([episode["r"] for episode in model.ep_info_buffer]) < 0


def test_options_go_to_the_lanes():
    env = make()
    env.set_options({"speed_kmh": 200})
    env.reset()
    assert [info["speed_kmh"] for info in env.reset_infos] == pytest.approx([200] * 3)
    env.set_options([{"speed_kmh": 200}, {}, {}])
    with pytest.raises(InputError, match="the same options for all"):
        env.reset()


def test_pictures_are_those_of_the_lanes(tmp_path):
    pytest.importorskip("PIL")
    env = make(render_mode="rgb_array", render_size=(128, 96), distance=30.0)
    env.reset()
    frames = env.get_images()
    assert [frame.shape for frame in frames] == [(96, 128, 3)] * 3
    assert env.render().shape[2] == 3
    pytest.importorskip("moviepy")
    recorder = VecVideoRecorder(env, str(tmp_path), lambda step: step == 0, video_length=5)
    assert recorder.frames_per_sec == env.env.metadata["render_fps"]
    recorder.reset()
    for _ in range(7):
        recorder.step(np.zeros((3, 1), np.float32))
    recorder.close()
    assert len(list(tmp_path.glob("*.mp4"))) == 1


def test_without_pictures_a_sentence_says_what_to_do():
    with pytest.raises(InputError, match="There are no pictures; add render_mode='rgb_array'"):
        make().get_images()
