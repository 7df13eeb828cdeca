"""The examples, each run and judged by a number. RLlib's and TorchRL's have tests of their own."""

import importlib.util
import re
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest

from panto_env import simulate
from panto_env.metrics.low_pass import in_band

from ..notebook import FIRST, LEARNING, NOTEBOOKS, UNSEEN_LINE, changes, executed, told

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name, monkeypatch):
    """An example as a module; its processes find it by the same name."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    spec = importlib.util.find_spec(name)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs an example as a command: its module, what it prints, and what it says that it printed."""

    def of(name, *arguments):
        example = load(name, monkeypatch)
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        example.main()
        said = re.sub(r"^ +", "", example.__doc__, flags=re.MULTILINE)  # without indents
        return example, capsys.readouterr().out, said

    return of


@pytest.mark.slow
def test_a_rig_over_udp_feels_the_line_that_another_process_computes(monkeypatch):
    """Its pantograph and cylinder are written once more there: the force is that under the line itself."""
    example = load("rig_over_udp", monkeypatch)
    forces, trips = example.run(6.0)
    assert len(trips) == len(forces) == 6000
    line = simulate("en50318-2002", example.PANTOGRAPH, example.SPEED_KMH, time_step=2.5e-4)
    true = line.contact_force[: 4 * 6000].reshape(-1, 4).mean(axis=1)
    ours, true = (in_band(each[2000:], 1e-3, 0.0, 20.0) for each in (forces, true))
    assert np.corrcoef(ours, true)[0, 1] > 0.98
    assert abs(ours.std() / true.std() - 1) < 0.05


@pytest.mark.longer
def test_first_run_is_the_same_through_gymnasium(run, tmp_path):
    example, told, said = run("first_run", "--plot", tmp_path / "run.png")
    assert told in said
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    once = example.one_pass()
    assert once.summary().std == pytest.approx(35.15, abs=0.005)
    again = example.same_as_environment(once.distance)
    np.testing.assert_array_equal(again.contact_force, once.contact_force)


@pytest.mark.slow
def test_own_controller_is_ranked_and_pd_is_not(run):
    example, told, said = run("own_controller")
    assert told in said
    passive, pd, own = example.judge().cells
    assert (passive.policy, pd.policy) == ("passive", "pd")
    assert own.rank == 1
    assert own.change == pytest.approx(-8.4, abs=0.05)
    assert pd.rank is None


@pytest.mark.longer
def test_line_from_toml_keeps_the_standards(run, tmp_path):
    example, told, said = run("line_from_toml", "--plot", tmp_path / "line.png")
    verdicts, speeds = told.splitlines()[:9], told.splitlines(keepends=True)[9:]
    assert all(verdict.endswith(", kept") for verdict in verdicts)
    assert "".join(speeds) in said
    sigma = [row["std"] for row in example.over_speed()]
    assert sigma == sorted(sigma)
    assert sigma[0] == pytest.approx(18.9, abs=0.05)
    assert example.one_pass().catenary == "my_line"


@pytest.mark.slow
def test_design_sweep_finds_the_lightest_head_and_the_tightest_wire(run, tmp_path):
    example, told, said = run("design_sweep", "--plot", tmp_path / "design.png")
    assert len(told.splitlines()) == 13
    assert told.splitlines()[-1] in said
    best = min(example.designs(), key=lambda row: row["std"])
    assert (best[example.HEAD], best[example.TENSION]) == (4.0, 24e3)
    assert best["std"] == pytest.approx(23.0, abs=0.05)
    assert best["mean"] == pytest.approx(130.0, abs=0.1)


@pytest.mark.slow
def test_identify_from_csv_finds_the_truth(run, tmp_path):
    example, told, said = run("identify_from_csv")
    assert told in said
    example.write_rig_record(tmp_path / "rig.csv")
    fit = example.identify_file(tmp_path / "rig.csv")
    assert fit.undetermined == ("c2",)
    for name in ("c1T", "m3", "c3", "k3"):
        assert fit.parameters[name] == pytest.approx(example.TRUTH[name], rel=0.01)


@pytest.mark.slow
def test_a_unit_controls_as_its_policy_does(run):
    """Not to the digit: its slow averages are of what sensors read, the environment's without their noise."""
    pytest.importorskip("fmpy")
    example, told, said = run("onboard_fmu")
    assert told in said
    in_unit = float(re.search(r"in a unit: sigma ([\d.]+) N", told)[1])
    direct = simulate(**example.PASS, policy="agent-any-line").summary().std
    assert in_unit == pytest.approx(direct, rel=0.02)


@pytest.mark.slow
def test_sac_example_trains_and_acts(monkeypatch, tmp_path):
    """A second of it: the critics have learnt, and what it would do is a policy of the benchmark."""
    torch = pytest.importorskip("torch")
    example = load("train_sac", monkeypatch)
    learner = example.train(2_000)
    assert learner.num_timesteps == 2_000
    critic = torch.cat([each.flatten() for each in learner.critic.parameters()])
    target = torch.cat([each.flatten() for each in learner.critic_target.parameters()])
    assert torch.isfinite(critic).all()
    assert not torch.equal(critic, target)  # the target follows what has been learnt
    example.save_policy(learner, tmp_path / "sac.safetensors")
    policy = str(tmp_path / "sac.safetensors")
    run = simulate(policy=policy, distance=60.0, actuator="realistic", sensors="realistic")
    assert run.frame_force.any()


@pytest.mark.study
def test_sac_example_is_better_than_passive(monkeypatch, tmp_path):
    """It is ranked, and better than passive at every speed."""
    pytest.importorskip("stable_baselines3")
    example = load("train_sac", monkeypatch)
    example.save_policy(example.train(400_000), tmp_path / "sac.safetensors")
    result = example.judge(tmp_path / "sac.safetensors", seeds=3)
    own = [cell for cell in result.cells if cell.policy != "passive"]
    assert [cell.disqualified for cell in own] == [""] * 4
    assert max(cell.change for cell in own) < 0


@pytest.mark.slow
def test_ppo_example_earns_more_than_at_first(monkeypatch):
    pytest.importorskip("torch")
    example = load("ppo_cleanrl", monkeypatch)
    agent, rewards = example.train(8 * example.LANES * example.ROLLOUT, report=False)
    assert len(rewards) == 8
    assert rewards[-1] > rewards[0]
    run = simulate(policy=agent, distance=120.0, **example.TASK)
    assert run.policy == "ppo"
    assert run.frame_force.any()


def test_ppo_example_knows_how_episodes_end(monkeypatch):
    """Behind a termination nothing is worth anything; behind a truncation what the critic says is."""
    torch = pytest.importorskip("torch")
    example = load("ppo_cleanrl", monkeypatch)
    agent = example.Agent(3, 1)
    seen, following = torch.randn(2, 2, 3), torch.randn(2, 2, 3)
    reward, no = torch.tensor([[1.0, 1.0], [2.0, 2.0]]), torch.zeros(2, 2, dtype=torch.bool)
    terminated, truncated = no.clone(), no.clone()
    terminated[0, 0], truncated[0, 1] = True, True  # of the first lane's and of the second lane's first step
    args = (seen, torch.zeros(2, 2, 1), reward, following, terminated, truncated)
    advantage, returns = example.advantages(agent, *args)
    with torch.no_grad():
        worth, behind = agent.values(seen), agent.values(following)
    assert returns[0, 0] == pytest.approx(1.0, abs=1e-6)
    assert returns[0, 1].item() == pytest.approx(1.0 + example.GAMMA * behind[0, 1].item(), abs=1e-5)
    assert returns[1, 0].item() == pytest.approx(2.0 + example.GAMMA * behind[1, 0].item(), abs=1e-5)
    torch.testing.assert_close(returns - advantage, worth)


def test_ppo_example_takes_the_last_observation_of_an_episode(monkeypatch):
    """Not the first one of the next, which is at the line's start again."""
    import gymnasium

    torch = pytest.importorskip("torch")
    example = load("ppo_cleanrl", monkeypatch)
    settings = {"autoreset_mode": "SameStep", "distance": 30.0, **example.TASK}
    envs = gymnasium.make_vec("panto_env:Pantograph-v0", 2, **settings)
    agent = example.Agent(envs.single_observation_space.shape[0], 1)
    (seen, _, _, following, terminated, truncated), _ = example.collect(
        envs, agent, torch.as_tensor(envs.reset(seed=0)[0])
    )
    ended = (terminated | truncated)[:-1]
    assert ended.any()
    torch.testing.assert_close(following[:-1][~ended], seen[1:][~ended])
    assert not torch.isclose(following[:-1][ended], seen[1:][ended]).all(dim=1).any()


@pytest.mark.slow
def test_ppo_example_is_better_than_passive(monkeypatch):
    pytest.importorskip("torch")
    example = load("ppo_cleanrl", monkeypatch)
    agent, _ = example.train(400_000, report=False)
    sigma, mean = example.judge(agent)
    assert sigma < -18.0
    assert abs(mean) < 1.5


@pytest.mark.slow
def test_notebook_shows_what_it_prints_now():
    """Without the part that learns, which a slow test runs."""
    stored = nbformat.read(LEARNING, as_version=4)
    again = told(executed(LEARNING, before="## Learning"))
    assert told(stored).startswith(again)
    assert again == "mean force 115.6 N, sigma 35.15 N\nsigma 35.15 N\nDamper: sigma -8.9 %\n"
    assert [cell for cell in stored.cells if cell.cell_type == "code" and not cell.execution_count] == []
    assert LEARNING.stat().st_size < 300_000
    assert changes(stored)["SAC"] < changes(stored)["Damper"]


def test_notebooks_start_alike_wherever_they_are_opened():
    """By the same cell, whose address a release fills in: from the copy they lie in, or what is published."""
    firsts = {
        next(cell.source for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code")
        for path in NOTEBOOKS
    }
    (first,) = firsts
    assert 'find_spec("panto_env") is None' in first
    assert "[agents,parquet,render] @ {at}" in first


@pytest.mark.slow
@pytest.mark.parametrize("name", ["own_line", "own_record"])
def test_notebooks_for_engineers_show_what_they_print_now(name, tmp_path):
    (path,) = (each for each in NOTEBOOKS if each.stem == name)
    stored = told(nbformat.read(path, as_version=4))
    assert told(executed(path, folder=tmp_path)) == stored
    assert path.stat().st_size < 300_000


@pytest.mark.slow
def test_the_first_notebook_learns_in_a_minute_as_it_shows(tmp_path):
    stored = nbformat.read(FIRST, as_version=4)
    again = changes(executed(FIRST, before="## The film", folder=tmp_path))
    assert again["mine"] == pytest.approx(changes(stored)["mine"], abs=5.0)
    assert changes(stored)["mine"] < -10
    assert FIRST.stat().st_size < 600_000


@pytest.mark.slow
def test_notebook_learns_as_it_shows():
    assert changes(executed(LEARNING))["SAC"] == pytest.approx(
        changes(nbformat.read(LEARNING, as_version=4))["SAC"], abs=5.0
    )


@pytest.mark.slow
def test_notebook_films_an_agent_on_a_line_that_nobody_has_seen(tmp_path):
    stored = nbformat.read(UNSEEN_LINE, as_version=4)
    again = executed(UNSEEN_LINE, before="## The film", folder=tmp_path)
    assert changes(again) == changes(stored)
    assert changes(stored)["agent-any-line"] < changes(stored)["repetitive"] < -30
    film = stored.cells[-1].outputs[0]["data"]["text/html"]
    assert "data:video/mp4;base64," in film
    assert UNSEEN_LINE.stat().st_size < 600_000
