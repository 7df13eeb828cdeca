"""Pantograph-v0 by default: every episode is another one, entries lie about 0, and the mean force counts."""

import gymnasium
import numpy as np
import pytest

from panto_baselines.benchmark import settings as controls
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_baselines.benchmark.single_pass import drive
from panto_env import InputError, simulate
from panto_env.catalog import load_pantograph
from panto_env.control.reward import MEAN_TIME
from panto_env.envs import BARE, IDS
from panto_env.policies import find_policy

NAME = "panto_env:Pantograph-v0"
STILL = np.zeros(1, np.float32)


def play(env, policy=None, seed=0, tape=None):
    """Observations, infos and actions of an episode under a policy, a tape of actions, or none."""
    observation, info = env.reset(seed=seed)
    if policy is not None:
        policy.reset(env.unwrapped.context)
    seen, infos, done, ended = [observation], [info], [], False
    left = iter(tape or ())
    while not ended:
        action = next(left, STILL) if policy is None else policy.act(observation).astype(np.float32)
        observation, _, *ends, info = env.step(action)
        ended = any(ends)
        seen.append(observation)
        infos.append(info)
        done.append(action)
    return np.array(seen), infos, done


def test_two_seeds_give_two_episodes():
    env, found = gymnasium.make(NAME), []
    for seed in range(4):
        _, info = env.reset(seed=seed)
        table = env.unwrapped.task.plant.pantographs.table.tobytes()
        found.append((info["speed_kmh"], info["position"], table))
    speeds, starts, tables = map(set, zip(*found, strict=True))
    assert len(speeds) == len(starts) == len(tables) == 4
    assert 200 <= min(speeds) <= max(speeds) <= 300
    assert 0 <= min(starts) <= max(starts) <= 60


def test_entries_have_a_mean_near_0_and_a_spread_near_1():
    env = gymnasium.make(NAME)
    seen = np.concatenate([play(env, seed=seed)[0] for seed in range(8)])
    entries = env.unwrapped.context.layout.entries
    for entry, values in zip(entries, seen.T, strict=True):
        # What tension a line has moves all of it up or down, by about a centimetre, a scale of both heights.
        assert abs(values.mean()) < (0.6 if "displacement" in entry.name else 0.3), entry.name
        if entry.name not in ("nominal force", "last frame action"):  # which a passive run never changes
            assert 0.5 < values.std() < 1.5, entry.name
    assert {"force deviation", "nominal force", "speed"} <= {entry.name for entry in entries}


def test_the_force_is_read_relative_to_the_nominal_one():
    env = gymnasium.make(NAME, **BARE | {"observation": "centred", "distance": 120.0})
    seen, infos, _ = play(env)
    layout = env.unwrapped.context.layout
    read = [layout.read(observation, "contact force") for observation in seen]
    assert read == pytest.approx([info["contact_force"] for info in infos], rel=1e-5, abs=1e-3)
    assert layout.read(seen[5], "nominal force") == pytest.approx(120.0)
    assert layout.read(seen[5], "speed") == pytest.approx(300 / 3.6, rel=1e-6)
    heavy = load_pantograph("en50318-2002").model_copy(update={"static_force": 180.0})
    lifted = gymnasium.make(NAME, **BARE | {"observation": "centred", "pantograph": heavy})
    first, info = lifted.reset(seed=0)
    assert first[layout.index("nominal force")] == pytest.approx(2.0)
    expected = (info["contact_force"] / 180.0 - 1) / 0.3
    assert first[layout.index("force deviation")] == pytest.approx(expected, abs=1e-5)
    assert layout.read(first, "contact force") == pytest.approx(info["contact_force"], rel=1e-5)


def test_a_reference_policy_does_the_same_by_either_observation():
    runs = [simulate(policy="pd", observation=kind, distance=240.0) for kind in ("measured", "centred")]
    assert runs[0].contact_force == pytest.approx(runs[1].contact_force, abs=0.02)


def test_the_bare_form_is_what_simulate_runs():
    env = gymnasium.make(NAME, **BARE | {"distance": 240.0}).unwrapped
    play(env)
    run = simulate(distance=240.0, spans=10)
    np.testing.assert_array_equal(env.trajectory.contact_force, run.contact_force)


def test_run_in_is_no_part_of_the_episode_s_figures():
    env = gymnasium.make(NAME, **BARE | {"run_in": 2.0, "distance": 120.0, "actuator": {"force_limit": 50.0}})
    seen, infos, _ = play(env, find_policy("p"), seed=3)
    start, figures = infos[0]["position"], infos[-1]["figures"]
    assert 0 < start <= 120
    assert infos[-1]["position"] == pytest.approx(start + 120.0, abs=1.0)
    assert figures["distance"] == pytest.approx(infos[-1]["position"] - start)
    run = env.unwrapped.trajectory
    inside = run.position > start
    assert figures["contact_loss"] == pytest.approx(100 * (run.contact_force[inside] <= 0).mean())
    assert not run.frame_force[~inside].any()
    assert run.frame_force[inside].any()
    assert len(seen) == len(infos) == len(run.time[inside]) // round(0.01 / run.time_step) + 1
    # And what runs in runs as any passive train does.
    passive = simulate(spans=10, distance=240.0)
    np.testing.assert_array_equal(run.contact_force[~inside], passive.contact_force[: (~inside).sum()])


def test_run_in_leaves_an_episode_on_a_short_line():
    env = gymnasium.make(NAME, **BARE | {"run_in": 5.0, "spans": 3})
    for seed in range(5):
        _, infos, _ = play(env, seed=seed)
        assert len(infos) > 1
        assert infos[-1]["position"] <= 180.0


def test_run_in_that_leaves_the_valid_range_is_an_error():
    loose = load_pantograph("en50318-2002").model_copy(update={"static_force": 700.0})
    env = gymnasium.make(NAME, **BARE | {"run_in": 3.0, "pantograph": loose})
    with pytest.raises(InputError, match="The run ended early at"):
        env.reset(seed=0)


def test_term_of_the_mean_force_is_that_of_a_low_passed_deviation():
    weights = {"cost_function": 0.0, "contact_loss": 0.0, "mean_force": 2.0}
    env = gymnasium.make(NAME, **BARE | {"reward": weights, "distance": 120.0}).unwrapped
    env.reset(seed=0)
    rewards, ended = [], False
    while not ended:
        _, reward, *ends, info = env.step(np.full(1, 0.2))
        rewards.append(reward)
        assert info["reward_terms"]["mean_force"] == pytest.approx(-reward / 2)
        ended = any(ends)
    steps = env.trajectory.contact_force.reshape(len(rewards), -1).mean(axis=1) / 120.0 - 1
    share, mean, expected = 1 - np.exp(-0.01 / MEAN_TIME), 0.0, []
    for step in steps:
        mean += share * (step - mean)
        expected.append(-2 * mean**2)
    assert rewards == pytest.approx(expected, rel=1e-9)


@pytest.mark.longer
def test_controls_of_a_benchmark():
    settings = BenchmarkSettings(line_condition="as-built")
    line = Line(speeds_kmh=[300], distance=240.0, spans=(2, 3))
    _, forces = drive(settings, line, "pd", 300.0, controls.OTHER_SEED)
    played, tape = drive(settings, line, "tape of pd", 300.0, 0)
    np.testing.assert_array_equal(tape, forces)
    run, constant = drive(settings, line, "blind of pd:gain=0.5", 300.0, 0)
    assert np.ptp(constant[1:]) == 0.0  # after the first, of which pd has no derivative
    assert played.policy == "tape of pd"
    assert run.policy == "blind of pd:gain=0.5"


def test_what_the_id_sets_are_settings():
    assert set(BARE) == set(IDS["Pantograph-v0"])
    assert BARE["observation"] == "measured"
    assert BARE["line_condition"] == "new"


@pytest.mark.study
def test_with_the_term_of_the_mean_force_a_trained_agent_presses_less_hard(tmp_path):
    """Without it the same training moves the mean at least twice as far. Neither is within the 1.5 % that the
    benchmark allows: a quarter of a million steps are too few for that.
    """
    pytest.importorskip("stable_baselines3")
    from panto_agents.evaluation import Comparison, verdict
    from panto_agents.settings import load_training, parse_training
    from panto_agents.train import train

    usual = load_training("ppo-quick").model_dump(mode="json")
    usual |= {"total_steps": 245_760, "checkpoint_steps": 100_000}  # a quarter of it leaves it to the seed
    moved, ratios = [], []
    for name, reward in (("with", "agent"), ("without", {"rate": 0.1})):
        environment = usual["environment"] | {"reward": reward, "washout": 0.0, "settle": 0.0}
        training = parse_training(usual | {"environment": environment}, name)
        folder = train(training, tmp_path / name, progress=False)
        pairs = Comparison(training.arguments, (200.0, 250.0, 300.0), range(1000, 1002)).run(
            str(folder.path / "model.safetensors")
        )
        moved.append(np.mean([pair.policy.mean / pair.passive.mean - 1 for pair in pairs]))
        ratios.append(verdict(pairs)[0])
    print(moved, ratios)
    assert max(ratios) < 0.87
    assert abs(moved[0]) < 0.5 * moved[1]


@pytest.mark.longer
def test_a_tape_of_actions_is_worth_little_in_another_episode():
    """It was worth as much as the policy while every episode was the same one."""
    env, pd = gymnasium.make(NAME, distance=400.0), find_policy("pd")
    ratios = []
    for seed in range(4):
        _, _, tape = play(env, pd, seed=seed + 100)
        passive, own, played = (
            play(env, policy, seed, actions)[1][-1]["figures"]["std"]
            for policy, actions in ((None, None), (pd, None), (None, tape))
        )
        ratios.append((own / passive, played / passive))
    own, played = np.mean(ratios, axis=0)
    assert own < 0.95
    assert played > own + 0.04
