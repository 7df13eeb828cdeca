"""What environments give to be drawn, and when: a stand-in for the drawing keeps it."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from panto_env.envs import PantographEnv

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

SHORT = {"distance": 12.0, "settle": 0.0, "reward": {"effort": 1.0}}
NAMES = "en50318-2002", "en50318-2002"


class Drawer:
    """Keeps what it is given, in the place of ``Viewer``."""

    def __init__(self, size):
        self.size, self.drawn, self.shown, self.closed = size, [], [], 0

    def frame(self, task, lane, title, reward):
        assert task.keep_samples
        self.drawn.append((lane, title, reward))
        return np.full((2, 3, 3), len(self.drawn), np.uint8)

    def show(self, frame, title, rate):
        self.shown.append((int(frame[0, 0, 0]), title, rate))

    def close(self):
        self.closed += 1


@pytest.fixture
def made(monkeypatch):
    """Those that were made."""
    made = []
    monkeypatch.setattr("panto_env.render.viewer.Viewer", lambda size: made.append(Drawer(size)) or made[-1])
    return made


def actions(count, *lanes):
    return np.random.default_rng(0).uniform(-1, 1, (count, *lanes, 1)).astype(np.float32)


def test_a_frame_shows_the_reward_of_its_own_episode_so_far(made):
    env = PantographEnv(render_mode="rgb_array", **SHORT)
    assert env.render()[0, 0, 0] == 1  # before the first episode, too
    for episode in range(2):
        env.reset(seed=episode)
        env.render()
        total, ended = 0.0, False
        for action in actions(100):
            if not ended:
                _, reward, *ends, _ = env.step(action)
                total, ended = total + reward, any(ends)
                assert env.render().shape == (2, 3, 3)
                assert made[0].drawn[-1][2] == total < 0.0
        assert ended
    (drawer,) = made
    assert drawer.size == (1280, 720)
    assert {(lane, title) for lane, title, _ in drawer.drawn} == {
        (0, "pantograph {}, line {}".format(*NAMES))
    }
    assert [reward for *_, reward in drawer.drawn].count(0.0) == 3  # before the first one, and at two starts
    assert drawer.shown == []
    env.close()
    assert drawer.closed == 1


def test_a_window_shows_the_start_and_every_step_by_itself(made):
    env = PantographEnv(render_mode="human", render_size=(320, 200), slow_motion=4.0, **SHORT)
    env.close()  # nothing to close yet
    env.reset(seed=0)
    rewards = [0.0, *(env.step(action)[1] for action in actions(5))]
    (drawer,) = made
    assert drawer.size == (320, 200)
    assert [number for number, *_ in drawer.shown] == [1, 2, 3, 4, 5, 6]
    assert {(title, rate) for _, title, rate in drawer.shown} == {(drawer.drawn[0][1], 25)}
    assert [reward for *_, reward in drawer.drawn] == pytest.approx(np.cumsum(rewards))
    assert env.render() is None
    assert len(drawer.drawn) == 6


def test_nothing_is_drawn_unless_requested(made):
    env, envs = PantographEnv(**SHORT), gymnasium.make_vec("PantographStiffness-v0", 2, **SHORT)
    for each, shape in ((env, (1,)), (envs, (2, 1))):
        each.reset(seed=0)
        each.step(np.zeros(shape, np.float32))
        assert each.render() is None
        each.close()
    assert not made
    assert not envs.unwrapped.task.keep_samples  # they are only for pictures, and large


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_frame_of_a_lane_shows_the_reward_of_that_lane_s_episode_so_far(made, mode):
    """Over the ends of episodes, each of which comes at another step."""
    settings = SHORT | {"speed_kmh": (200, 320), "autoreset_mode": mode, "render_mode": "rgb_array"}
    settings |= {"render_lanes": (2, 0, 1), "slow_motion": 2.0}
    envs = gymnasium.make_vec("PantographStiffness-v0", 3, **settings)
    assert envs.metadata["render_fps"] == 50
    envs.reset(seed=5)
    totals, ended, ends = np.zeros(3), np.zeros(3, bool), 0
    for k, action in enumerate(actions(60, 3)):
        waiting = ended
        _, rewards, terminated, truncated, _ = envs.step(action)
        ended = terminated | truncated
        totals += rewards
        if mode == AutoresetMode.NEXT_STEP:
            totals[waiting] = 0.0
        elif mode == AutoresetMode.SAME_STEP:
            totals[ended] = 0.0
        elif ended.any():
            envs.reset(options={"reset_mask": ended})
            totals[ended] = 0.0
        ends += ended.any()
        frames = envs.render()
        (drawer,) = made
        assert [int(frame[0, 0, 0]) for frame in frames] == [3 * k + 1, 3 * k + 2, 3 * k + 3]
        last = drawer.drawn[-3:]
        assert [lane for lane, *_ in last] == [2, 0, 1]
        assert [reward for *_, reward in last] == totals[[2, 0, 1]].tolist()
    assert ends > 5
    assert any(totals)
    envs.reset()
    envs.render()
    assert [reward for *_, reward in drawer.drawn[-3:]] == [0.0, 0.0, 0.0]
    assert drawer.size == (640, 360)
    assert drawer.drawn[2][1] == "lane 1: three-mass on periodic-stiffness"
