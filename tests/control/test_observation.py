"""Each entry of an observation is what its name says, judged by name against what did not come from it."""

from functools import partial

import gymnasium
import numpy as np
import pytest

import panto_env
from panto_env import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.envs import BARE
from panto_env.plant.state import Row

from ..pantograph_alone import means, replay, rest

LINE = load_catenary("periodic-stiffness")
FORCE_LIMIT, STRIP = 80.0, 20e3
# An elastic strip: under a rigid one a massless wire is as high as the head.
THREE_MASSES = load_pantograph("three-mass").model_copy(update={"contact_stiffness": STRIP})
FIVE_MASSES = THREE_MASSES.model_copy(
    update={
        "name": "five-mass",
        "masses": (7.5, 2.0, 4.6, 3.0, 4.8),
        "stiffnesses": (6000.0, 9000.0, 5400.0, 8000.0, 1.0),
        "dampings": (10.0, 15.0, 5.0, 20.0, 32.0),
    }
)


class Episode:
    """An episode under random actions: what was observed, and what an entry should have been, by its name.

    Row 0 is the observation at the start, row n that after n control steps.
    """

    def __init__(self, pantograph, driven):
        self.driven = driven
        self.env = gymnasium.make(
            "panto_env:PantographStiffness-v0",
            pantograph=pantograph,
            actuator={"place": "both" if len(driven) == 2 else driven[0], "force_limit": FORCE_LIMIT},
            observation="full",
            speed_kmh=(200, 300),
            distance=150.0,
        ).unwrapped
        random = np.random.default_rng(0)
        first, info = self.env.reset(seed=1)
        self.speed, self.layout = info["speed_kmh"] / 3.6, self.env.context.layout
        self.observations, self.infos = [first], []
        self.actions = np.zeros((1, self.env.context.actions))
        ended = False
        while not ended:
            action = random.uniform(-1, 1, self.env.context.actions)
            observation, _, terminated, ended, info = self.env.step(action)
            assert not terminated
            self.observations.append(observation)
            self.infos.append(info)
            self.actions = np.vstack([self.actions, action])
        self.run = self.env.trajectory
        self.per_control = round(0.01 / self.run.time_step)
        pressed = 1 / (1 / STRIP + 1 / self._stiffness(0.0))
        start = rest(pantograph, self.run.nominal_force, pressed)
        self.states = replay(self.run, pantograph, start)

    def _stiffness(self, position):
        turns = position / LINE.span_length
        return LINE.mean_stiffness * (1 + LINE.stiffness_variation * np.cos(2 * np.pi * turns))

    def column(self, name):
        """Physical values of an entry."""
        return np.array([self.layout.read(observation, name) for observation in self.observations])

    def last_mean(self, values):
        """Mean over the last time step of each control step, of values at the ends of time steps."""
        return np.append(values[0], means(values)[self.per_control - 1 :: self.per_control])

    def last(self, series, start):
        """Value of the last time step of each control step."""
        return np.append(start, series[self.per_control - 1 :: self.per_control])

    def expected(self):
        """What each entry should be, by its name."""
        masses = self.states.shape[1] // 2
        position = self.speed * 0.01 * np.arange(len(self.observations))
        angle = 2 * np.pi * position / LINE.span_length
        half_stride = 0.5 * self.speed * self.run.time_step
        contact = self.last(
            self.run.contact_force, self.states[0, 0] / (1 / STRIP + 1 / self._stiffness(0.0))
        )
        names = {
            "head displacement": self.last_mean(self.states[:, 0]),
            "frame displacement": self.last_mean(self.states[:, masses - 1]),
            "head velocity": self.last_mean(self.states[:, masses]),
            "frame velocity": self.last_mean(self.states[:, -1]),
            "contact force": contact,
            "sine of span position": np.sin(angle),
            "cosine of span position": np.cos(angle),
            "speed": np.full(len(position), self.speed),
            "wire displacement": contact / self._stiffness(np.append(0.0, position[1:] - half_stride)),
        }
        names |= {"frame force": 0.0 * position, "head force": 0.0 * position}
        for place, actions in zip(self.driven, self.actions.T, strict=True):
            names |= {f"last {place} action": actions, f"{place} force": FORCE_LIMIT * actions}
        for k in range(2, masses):  # as they are at the end of the step
            names[f"mass {k} displacement"] = self.states[:: self.per_control, k - 1]
            names[f"mass {k} velocity"] = self.states[:: self.per_control, masses + k - 1]
        return names


EPISODES = {"head": (THREE_MASSES, ("head",)), "frame and head": (FIVE_MASSES, ("frame", "head"))}


@pytest.fixture(scope="module", params=EPISODES)
def episode(request):
    return Episode(*EPISODES[request.param])


def test_every_entry_is_what_its_name_says(episode):
    expected = episode.expected()
    assert {entry.name for entry in episode.layout.entries} == set(expected)
    for name, values in expected.items():
        observed = episode.column(name)
        assert observed == pytest.approx(values, rel=2e-6, abs=2e-6 * np.abs(values).max() + 1e-12), name


def test_no_two_entries_could_be_mistaken_for_each_other(episode):
    """Else the test above would not notice them swapped."""
    expected = {name: values for name, values in episode.expected().items() if values.any()}
    for name, values in expected.items():
        for other, others in expected.items():
            same = np.allclose(values, others, rtol=1e-3, atol=1e-3 * np.abs(values).max())
            assert other == name or not same, (name, other)


def test_info_tells_the_last_time_step(episode):
    run, last = episode.run, episode.per_control - 1
    for name, series in (
        ("contact_force", run.contact_force),
        ("head", run.head),
        ("wire", run.wire),
        ("frame_force", run.frame_force),
        ("head_force", run.head_force),
    ):
        told = [info[name] for info in episode.infos]
        assert told == pytest.approx(series[last :: episode.per_control], rel=1e-12, abs=1e-12), name
    position = [info["position"] for info in episode.infos]
    assert position == pytest.approx(episode.speed * 0.01 * (1 + np.arange(len(position))))


@pytest.mark.parametrize("sign", [1, -1])
def test_entries_are_clipped_to_ten_of_their_scales(sign):
    env = gymnasium.make("panto_env:PantographStiffness-v0", bilateral=True).unwrapped
    env.reset(seed=0)
    env.task.plant.run.table[0, 0, Row.CONTACT_FORCE] = sign * 3000.0
    env.task.observe_start(np.array([0]), env.task.results)
    observation = env.task.results.observation[0]
    force = observation[env.context.layout.index("contact force")]
    assert sign * force == (sign * observation).max() == 10.0
    assert env.observation_space.contains(observation)


def test_lanes_that_begin_leave_what_one_between_them_has_seen():
    envs = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=3, observation="deviations")
    envs.reset(seed=0)
    for action in np.linspace(-1, 1, 20):
        before, *_ = envs.step(np.full((3, 1), action))
    after, _ = envs.reset(options={"reset_mask": np.array([True, False, True])})
    np.testing.assert_array_equal(after[1], before[1])
    assert (after[0] != before[0]).any()


def test_line_values_say_what_the_line_is():
    """The values as the line's data and context have them; the other entries stay as they are."""
    settings = {"observation": "centred", "distance": 50.0}
    plain = gymnasium.make("panto_env:Pantograph-v0", **BARE | settings).unwrapped
    env = gymnasium.make("panto_env:Pantograph-v0", **BARE | settings | {"line_values": True}).unwrapped
    before, _ = plain.reset(seed=0)
    for name in ("en50318-2002", "re330"):
        observation, _ = env.reset(seed=0, options={"catenary": name})
        line, read = env.context.catenary, partial(env.context.layout.read, observation)
        assert read("span length") == pytest.approx(line.span_length)
        speed = (line.contact_wire.tension / line.contact_wire.mass) ** 0.5
        assert read("wave speed") == pytest.approx(speed)
        for wire in ("contact", "messenger"):
            own = getattr(line, f"{wire}_wire")
            assert read(f"{wire} wire tension") == pytest.approx(own.tension)
            assert read(f"{wire} wire mass") == pytest.approx(own.mass)
        assert read("droppers of a span") == pytest.approx(len(line.droppers.positions))
        if name == "en50318-2002":
            same = [env.context.layout.index(entry.name) for entry in plain.context.layout.entries]
            np.testing.assert_array_equal(observation[same], before)
    assert len(observation) == len(before) + 7
    with pytest.raises(InputError, match="line 'periodic-stiffness' is not one; leave out line_values"):
        gymnasium.make("panto_env:PantographStiffness-v0", line_values=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "near"),
    [
        ({"observation": "centred"}, True),
        ({"observation": "centred", "pantograph": "identified-2dof"}, False),
        ({"observation": "measured", "normalise": (200, 350), "pantograph": "identified-2dof"}, True),
    ],
)
def test_readings_are_near_0_and_spread_by_1_where_documents_say_so(settings, near):
    """In a passive run; see "Observation Space" in the description of ``PantographEnv``."""
    env = panto_env.envs.PantographEnv(speed_kmh=275.0, **settings)
    seen, ended = [env.reset(seed=0)[0]], False
    while not ended:
        observation, _, terminated, ended, _ = env.step(np.zeros(1, np.float32))
        assert not terminated
        seen.append(observation)
    rows = [k for k, entry in enumerate(env.context.layout.entries) if "displacement" in entry.name]
    settled = np.array(seen)[len(seen) // 3 :, rows]
    assert len(rows) == 2
    assert (np.abs(settled.mean(axis=0)) < 0.5).all() == near
    assert (np.abs(settled.std(axis=0) - 1) < 0.5).all() or not near
