"""Small parts of trainings, each value worked out by hand."""

import math
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import gymnasium
import stable_baselines3

from panto_agents.ablation import _variant
from panto_agents.actor import Actor, RecurrentActor
from panto_agents.algorithm import MOST_KEPT, PPO, SAC
from panto_agents.command import _outcome_table
from panto_agents.evaluation import Pair, in_words, pair, verdict
from panto_agents.model_file import actor_of, read_model
from panto_agents.run_folder import RunFolder
from panto_agents.stable_baselines import save_policy
from panto_agents.trainings import Outcome
from panto_env import InputError, simulate
from panto_env.metrics.figures import Figures

FIGURES = Figures(*(float(k) for k in range(1, 1 + len(fields(Figures)))))
PAIR = Pair(250.0, 0, "10-19", replace(FIGURES, mean=1.01, std=1.0), FIGURES, (), (), 120.0, "", "")


def test_a_learning_rate_goes_from_its_first_value_to_its_last_by_the_last_step():
    schedule = PPO(learning_rate=(1e-3, 2e-4)).learning_rate_schedule()
    for left, rate in ((1.0, 1e-3), (0.75, 8e-4), (0.5, 6e-4), (0.25, 4e-4), (0.0, 2e-4)):
        assert schedule(left) == pytest.approx(rate)
    assert SAC(learning_rate=5e-4).learning_rate_schedule() == 5e-4


@pytest.mark.parametrize(
    ("lanes", "n_steps", "batch_size", "message"),
    [
        (2, 128, 64, None),
        (2, 128, 256, None),
        (1, 2, 2, None),
        (1, 1, 1, "must be a multiple of batch_size = 1, and more than 1"),
        (2, 128, 512, "lanes x n_steps = 256 must be a multiple of batch_size = 512"),
        (3, 100, 64, "lanes x n_steps = 300 must be a multiple of batch_size = 64"),
        (MOST_KEPT // 512, 512, 64, "multiple" if MOST_KEPT // 512 * 512 % 64 else None),
        (MOST_KEPT // 512 + 1, 512, 64, "must be at most 50,000,000"),
    ],
)
def test_minibatches_divide_the_steps_of_an_update(lanes, n_steps, batch_size, message):
    settings = PPO(n_steps=n_steps, batch_size=batch_size)
    if message is None:
        settings.check(SimpleNamespace(lanes=lanes))
        return
    with pytest.raises(InputError, match=message):
        settings.check(SimpleNamespace(lanes=lanes))


def test_learning_starts_before_the_last_step():
    SAC(learning_starts=99).check(SimpleNamespace(total_steps=100))
    for start in (100, 101):
        with pytest.raises(
            InputError, match=f"learning_starts = {start} must be less than total_steps = 100"
        ):
            SAC(learning_starts=start).check(SimpleNamespace(total_steps=100))


def test_the_table_of_trainings_cell_by_cell():
    one = Outcome("runs/a", "ppo", 3, 2000, "runs/a/best", 1500, 0.8, True)
    others = (replace(one, best="b", best_steps=64, ratio=1.05, qualified=False), replace(one, ratio=None))
    made = _outcome_table([one, *others])
    assert made.title == "best models"
    assert made.headings == ("model file", "step", "σ to passive", "disqualified")
    assert made.rows == (
        ("runs/a/best", "1500", "-20.0 %", ""),
        ("b", "64", "+5.0 %", "F_m out of range"),
        ("runs/a/best", "1500", "ended early", ""),
    )


@pytest.mark.parametrize(("seed", "stored"), [(None, 0), (0, 0), (7, 7)])
def test_a_model_without_a_seed_is_stored_with_seed_0(seed, stored, tmp_path):
    env = gymnasium.make("panto_env:Pantograph-v0", distance=120.0, accuracy="fast", settle=0.0)
    model = stable_baselines3.PPO("MlpPolicy", env, seed=seed, device="cpu", n_steps=64)
    save_policy(model, tmp_path / "m.safetensors")
    facts, _ = read_model(tmp_path / "m.safetensors")
    assert (facts.seed, facts.steps, facts.updates) == (stored, 0, 0)
    assert facts.algorithm == "ppo"


def test_evaluations_up_to_the_step_that_a_run_resumes_at_stay(tmp_path):
    folder = RunFolder(tmp_path)
    folder.drop_evaluations_after(-1)  # there is none yet
    assert not folder.evaluations.exists()
    for steps in (0, 100, 200):
        folder.add_evaluation(steps, [PAIR, replace(PAIR, seed=1)])
    folder.drop_evaluations_after(100)
    assert [row["steps"] for row in folder._rows()] == ["0", "0", "100", "100"]
    row = folder._rows()[1]
    assert (row["seed"], row["speed_kmh"], row["qualified"]) == ("1", "250.0", str(PAIR.qualified))
    assert (row["policy_std"], row["passive_std"]) == ("1.0", "2.0")
    folder.drop_evaluations_after(99)
    assert [row["steps"] for row in folder._rows()] == ["0", "0"]
    folder.drop_evaluations_after(-1)
    assert folder._rows() == []


@pytest.mark.parametrize(
    "text", ["", "speed,seed\n1,2\n", "steps,seed\nten,2\n", "steps,seed\n1\n", "steps\n1,2\n"]
)
def test_a_damaged_table_of_evaluations_is_refused(tmp_path, text):
    folder = RunFolder(tmp_path)
    folder.evaluations.write_text(text)
    with pytest.raises(InputError, match=r"is damaged after 0 whole rows; correct or remove it"):
        folder._rows()


def test_a_verdict_is_the_mean_ratio_and_that_every_pass_qualified():
    far = replace(PAIR, policy=replace(FIGURES, mean=2.0, std=3.0))
    assert verdict([PAIR]) == (0.5, True)
    assert verdict([PAIR, far]) == (1.0, False)
    early = replace(PAIR, policy=Figures.none(), ending="It ended.")
    nothing = replace(early, passive=Figures.none(), passive_ending="It ended.")
    assert early.ratio == math.inf
    assert math.isnan(replace(nothing, ending="").ratio)
    assert in_words([PAIR]) == "σ -50.0 % of passive"
    assert in_words([PAIR, far]) == "σ +0.0 % of passive, F_m out of range"
    assert in_words([PAIR, early]) == "a run ended early"
    assert in_words([early, nothing]).startswith("the passive pantograph's run ended early")


def test_a_pair_of_passes_has_the_figures_of_those_that_did_not_end_early():
    settings = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 280.0}
    active, passive = simulate(**settings, policy="pd", seed=3), simulate(**settings, seed=3)
    made = pair(active, passive)
    assert (made.speed_kmh, made.seed, made.spans) == (280.0, 3, "10-19")
    for ours, run in ((made.policy, active), (made.passive, passive)):
        assert ours.as_dict() == pytest.approx(run.summary().as_dict(), rel=1e-12, nan_ok=True)
    assert len(made.policy_compliance) == len(made.passive_compliance) > 3
    ended = replace(active, terminated=True, ending="It ended.")
    made = pair(ended, passive)
    assert (made.spans, made.policy_compliance, made.ending) == ("10-19", (), "It ended.")
    assert math.isnan(made.policy.std)
    assert pair(ended, replace(passive, terminated=True)).spans == ""


def test_a_variant_s_share_of_worse_pairs_and_of_runs_that_qualify():
    changes, base = np.array([-10.0, -20.0, -30.0]), np.array([-20.0, -25.0])
    made = _variant("less", changes, base, [True, False, False])
    assert made.worse == pytest.approx(3 / 6)  # a draw is not worse
    assert made.qualified == pytest.approx(2 / 3)
    assert made.changes == (-10.0, -20.0, -30.0)
    assert made.lost[0] < np.mean(changes) - np.mean(base) < made.lost[1]


LAYERS = {"actor/weight_0": np.ones((3, 2)), "actor/bias_0": np.ones(3)}
LAYERS |= {"actor/weight_1": np.ones((1, 3)), "actor/bias_1": np.ones(1)}
FACTS = SimpleNamespace(needs=SimpleNamespace(channels=(0,)), inputs=2, activation="tanh", squashed=False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"actor/weight_1": None, "actor/bias_1": None}, "differs in shape from its facts"),
        ({"actor/bias_1": None}, "no layers, or not a weight and a bias in each"),
        ({"actor/bias_2": np.ones(1), "actor/more": np.ones(1)}, "no layers, or not a weight and a bias"),
        (dict.fromkeys(LAYERS), "no layers"),
        ({"actor/weight_0": np.ones((3, 3))}, "layer 1 of its network does not fit"),
        ({"actor/weight_1": np.ones((1, 2))}, "layer 2 of its network does not fit"),
        ({"actor/bias_0": np.ones(2)}, "layer 1 of its network does not fit"),
        ({"actor/weight_0": np.ones(3)}, "layer 1 of its network does not fit"),
        ({"actor/weight_0": np.ones((3, 2, 1))}, "layer 1 of its network does not fit"),
        ({"actor/weight_0": np.ones((3, 2), int)}, "layer 1 of its network holds values that are not finite"),
        ({"actor/bias_1": np.array([np.nan])}, "layer 2 of its network holds values that are not finite"),
    ],
)
def test_layers_that_do_not_fit_are_refused(change, message):
    arrays = {name: array for name, array in (LAYERS | change).items() if array is not None}
    with pytest.raises(ValueError, match=message):
        actor_of(arrays | {"critic/weight_0": np.ones(1)}, FACTS)


CELLS = {"weight_input": (6, 3), "weight_state": (6, 2), "bias_input": (6,), "bias_state": (6,)}
RECURRENT = LAYERS | {f"actor/cell_{name}": np.ones(shape) for name, shape in CELLS.items()}
RECURRENT |= {"actor/weight_1": np.ones((1, 5))}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"actor/cell_bias_state": None}, "only a part of a cell"),
        ({"actor/cell_other": np.ones(1)}, "only a part of a cell"),
        ({"actor/cell_weight_input": np.ones((6, 2))}, "the cell of its network does not fit"),
        ({"actor/cell_weight_state": np.ones(6)}, "the cell of its network does not fit"),
        ({"actor/cell_bias_input": np.full(6, np.inf)}, "the cell of its network holds values that are not"),
        ({"actor/weight_1": np.ones((1, 3))}, "layer 2 of its network does not fit"),
    ],
)
def test_a_cell_that_does_not_fit_is_refused(change, message):
    assert isinstance(actor_of(RECURRENT, FACTS), RecurrentActor)
    arrays = {name: array for name, array in (RECURRENT | change).items() if array is not None}
    with pytest.raises(ValueError, match=message):
        actor_of(arrays, FACTS)


def test_a_recurrent_actor_acts_as_its_network_in_torch_and_forgets_at_a_reset():
    torch = pytest.importorskip("torch")
    from panto_agents.linear_rollout import Network

    from .rollout_in_torch import stepped

    torch.manual_seed(0)
    network = Network(4, (6, 5), torch.nn.Tanh, 3)
    with torch.no_grad():
        network.rest[-1].weight *= 100
    linear = [network.first, *network.rest]
    arrays = [[getattr(each, kind).detach().numpy() for each in linear] for kind in ("weight", "bias")]
    actor = RecurrentActor(*map(tuple, arrays), "tanh", True, cell=network.arrays())
    seen = np.random.default_rng(1).normal(size=(20, 4)).astype(np.float32)
    expected, state = [], None
    with torch.no_grad():
        for each in seen:
            action, state = stepped(network, torch.tensor(each), state)
            expected.append(action.item())
    for _ in range(2):
        actor.reset(None)
        assert [actor.act(each)[0] for each in seen] == pytest.approx(expected, abs=1e-5)
    assert np.std(expected) > 0.03
    actor.reset(None)
    assert actor.act(seen[5])[0] != pytest.approx(expected[5], abs=1e-3)  # it remembers what came before


def test_layers_act_as_their_formula():
    weights = (np.array([[1.0, -2.0], [0.5, 0.5]]), np.array([[2.0, -1.0]]))
    biases = (np.array([0.1, -0.2]), np.array([0.3]))
    seen = np.array([0.4, 0.9])
    first = weights[0] @ seen + biases[0]
    for activation, hidden in (("tanh", np.tanh(first)), ("relu", np.maximum(first, 0.0))):
        out = weights[1] @ hidden + biases[1]
        for squashed, expected in ((False, np.clip(out, -1, 1)), (True, np.tanh(out))):
            actor = Actor(weights, biases, activation, squashed)
            assert actor.act(seen) == pytest.approx(expected)
