"""PPO of TorchRL on the native vector environment.

TorchRL and other libraries have their own environment, made by `make libraries`, where this is
run and tested.

    .venv-libraries/bin/python examples/with_torchrl.py --steps 200000

printed after half a minute of one core

    mean reward per step: -1.078 at first, -0.669 at last

A passive pantograph gets -1.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

TASK: dict[str, Any] = {
    "speed_kmh": 300.0,
    "line_condition": "fair",
    "pantograph_scatter": 0.0,
    # Forces as commanded, counted from the start: the reward "agent" holds the mean by itself.
    "washout": None,
    "settle": 0.0,
    "observation": "measured",
    "history": 3,
    "normalise": (290.0, 310.0),
    "reward": "agent",  # what the benchmark measures
    "accuracy": "fast",
    "run_in": 10,  # episodes begin up to ten spans after the line's start
    "distance": 900.0,
}
LANES, ROLLOUT, EPOCHS, MINIBATCHES = 64, 128, 8, 4


def network(entries: int, outputs: int) -> nn.Sequential:
    """Two hidden layers; the initial output is small, so that an actor starts near the passive pantograph."""
    last = nn.Linear(128, outputs)
    nn.init.orthogonal_(last.weight, 0.01)
    nn.init.zeros_(last.bias)
    return nn.Sequential(nn.Linear(entries, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh(), last)


def train(steps: int) -> list[float]:
    """Train for about this number of steps, summed over lanes: mean reward per control step and rollout."""
    torch.manual_seed(0)
    torch.set_num_threads(1)
    # "Disabled": TorchRL resets the lanes whose episodes have ended.
    env = GymWrapper(gymnasium.make_vec("panto_env:Pantograph-v0", LANES, autoreset_mode="Disabled", **TASK))
    env.set_seed(2000)
    entries = env.observation_spec["observation"].shape[-1]
    body = nn.Sequential(network(entries, 2), NormalParamExtractor("biased_softplus_0.2"))
    actor = ProbabilisticActor(
        TensorDictModule(body, ["observation"], ["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=TanhNormal,
        return_log_prob=True,
    )
    critic = ValueOperator(network(entries, 1))
    advantage = GAE(gamma=0.97, lmbda=0.95, value_network=critic, average_gae=True)
    loss = ClipPPOLoss(actor, critic, entropy_bonus=False)
    optimiser = torch.optim.Adam(loss.parameters(), lr=1e-3)
    frames = LANES * ROLLOUT
    collector = Collector(env, actor, frames_per_batch=frames, total_frames=max(1, steps // frames) * frames)
    rewards = []
    for batch in collector:
        with torch.no_grad():
            advantage(batch)
        rewards.append(float(batch["next", "reward"].mean()))
        samples = batch.reshape(-1)
        for _ in range(EPOCHS):
            for part in torch.randperm(len(samples)).chunk(MINIBATCHES):
                parts = loss(samples[part])
                optimiser.zero_grad()
                (parts["loss_objective"] + parts["loss_critic"]).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimiser.step()
    collector.shutdown()
    return rewards


def main() -> None:
    """Print the reward at first and at last."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=200_000)
    rewards = train(parser.parse_args().steps)
    print(f"mean reward per step: {rewards[0]:.3f} at first, {rewards[-1]:.3f} at last")


if __name__ == "__main__":
    main()
