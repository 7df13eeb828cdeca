"""Learning libraries on our environments; `make libraries` has them in an environment of their own."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from panto_env.envs import IDS

torch = pytest.importorskip("torch")
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", IDS)
def test_torchrl_s_check_finds_no_fault(name):
    pytest.importorskip("torchrl")
    from torchrl.envs import GymEnv, GymWrapper
    from torchrl.envs.utils import check_env_specs

    single = GymEnv(f"panto_env:{name}", distance=20.0)
    check_env_specs(single)
    assert single.rollout(40)["next", "truncated"].sum() == 1
    # "Disabled" is the mode that TorchRL prefers. With "SameStep" it keeps infos as well, but knows only
    # flat ones: it fails on "reward_terms", as on those of any environment with a dictionary in its infos.
    native = gymnasium.make_vec(name, 3, autoreset_mode="Disabled", distance=20.0, speed_kmh=(200, 300))
    abreast = GymWrapper(native)
    check_env_specs(abreast)
    assert abreast.rollout(80, break_when_any_done=False)["next", "truncated"].sum() >= 6


def test_torchrl_s_example_learns(monkeypatch):
    pytest.importorskip("torchrl")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import with_torchrl

    rewards = with_torchrl.train(60_000)
    assert rewards[-1] > rewards[0] + 0.05
    assert rewards[-1] > -1.0  # what a passive pantograph gets


@pytest.mark.parametrize("kind", ["DummyVectorEnv", "SubprocVectorEnv"])
def test_tianshou_trains(kind):
    pytest.importorskip("tianshou")
    import tianshou.env
    from tianshou.algorithm import PPO
    from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
    from tianshou.algorithm.optim import AdamOptimizerFactory
    from tianshou.data import Collector, VectorReplayBuffer
    from tianshou.trainer import OnPolicyTrainerParams
    from tianshou.utils.net.common import Net
    from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic

    def make():
        return gymnasium.make("panto_env:PantographStiffness-v0", distance=20.0)

    env, envs = make(), getattr(tianshou.env, kind)([make] * 2)

    def net():
        return Net(state_shape=env.observation_space.shape, hidden_sizes=(16,))

    actor = ContinuousActorProbabilistic(preprocess_net=net(), action_shape=env.action_space.shape)
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda parts: torch.distributions.Independent(torch.distributions.Normal(*parts), 1),
        action_space=env.action_space,
        action_scaling=False,
        action_bound_method=None,
    )
    critic = ContinuousCritic(preprocess_net=net())
    ppo = PPO(policy=policy, critic=critic, optim=AdamOptimizerFactory(lr=1e-3))
    collector = Collector(ppo, envs, VectorReplayBuffer(1000, 2))
    collector.reset()
    params = OnPolicyTrainerParams(
        training_collector=collector,
        max_epochs=1,
        epoch_num_steps=200,
        collection_step_num_env_steps=100,
        batch_size=50,
        verbose=False,
        show_progress=False,
    )
    outcome = ppo.run_training(params)
    assert (outcome.train_step, outcome.train_episode) == (200, 8)
    envs.close()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_skrl_trains_on_the_native_vector_environment(tmp_path, mode):
    pytest.importorskip("skrl")
    from skrl.agents.torch.ppo import PPO, PPO_CFG
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.trainers.torch import SequentialTrainer
    from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model

    native = gymnasium.make_vec("panto_env:PantographStiffness-v0", 4, autoreset_mode=mode, distance=20.0)
    env = wrap_env(native)
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space}
    network = [{"name": "net", "input": "OBSERVATIONS", "layers": [16], "activations": "tanh"}]
    models = {
        "policy": gaussian_model(**spaces, device=env.device, network=network, output="ACTIONS"),
        "value": deterministic_model(**spaces, device=env.device, network=network, output="ONE"),
    }
    settings = PPO_CFG(rollouts=16)
    settings.experiment.directory = str(tmp_path)
    memory = RandomMemory(memory_size=16, num_envs=env.num_envs, device=env.device)
    agent = PPO(models=models, memory=memory, cfg=settings, device=env.device, **spaces)
    trainer = {"timesteps": 48, "headless": True, "close_environment_at_exit": False}
    weights = []
    for _ in range(2):
        SequentialTrainer(cfg=trainer, env=env, agents=agent).train()
        weights.append(torch.cat([each.detach().flatten() for each in models["policy"].parameters()]))
    assert torch.isfinite(weights[0]).all()
    assert not torch.equal(*weights)


def test_minari_records_infos_and_makes_the_environment_again(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    minari = pytest.importorskip("minari")
    pytest.importorskip("jax", reason="Minari's extra 'create' is not installed")  # its recorder wants it
    env = gymnasium.make("panto_env:Pantograph-v0", speed_kmh=(250, 300), distance=60.0)

    class WithoutFigures(minari.StepDataCallback):
        """Minari wants the same keys in every info; figures are in the last one only."""

        def __call__(self, env, obs, info, **rest):
            kept = {key: value for key, value in info.items() if key != "figures"}
            return super().__call__(env=env, obs=obs, info=kept, **rest)

    recorder = minari.DataCollector(env, record_infos=True, step_data_callback=WithoutFigures)
    for seed in range(2):
        recorder.reset(seed=seed)
        ended = False
        while not ended:
            _, _, _, ended, info = recorder.step(recorder.action_space.sample())
    recorder.create_dataset("panto/random-v0", eval_env=env, algorithm_name="random")
    dataset = minari.load_dataset("panto/random-v0")
    episode = dataset[1]
    assert episode.infos["position"][-1] == info["position"]
    assert len(episode.infos["reward_terms"]["cost_function"]) == len(episode) + 1
    assert episode.infos["contact_force"][0] > 0
    again = dataset.recover_environment()
    np.testing.assert_array_equal(again.reset(seed=1)[0], episode.observations[0])
