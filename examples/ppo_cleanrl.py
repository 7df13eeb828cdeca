"""PPO in one file, in the style of CleanRL: the whole algorithm stands here, to be read and changed.

It learns in 64 lanes of the native vector environment, at 300 km/h on lines that differ from one another,
with a realistic actuator and realistic sensors. The result is judged on seeds that it has not seen, against a
passive pantograph at the same mean force.

    python examples/ppo_cleanrl.py --steps 400000

printed at last, after 40 seconds of one core,

    mean reward per step: -1.096 at first, -0.612 at last
    sigma -19.4 % of the passive pantograph of the same mean, mean force +1.4 %

The algorithm is that of Schulman et al., "Proximal policy optimization algorithms" (2017), with generalised
advantage estimation.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn
from torch.distributions import Independent, Normal

from panto_env import simulate

TASK: dict[str, Any] = {
    "speed_kmh": 300.0,
    "line_condition": "fair",
    "pantograph_scatter": 0.0,
    # Forces as commanded, counted from the start: the reward "agent" holds the mean by itself.
    "washout": None,
    "settle": 0.0,
    "actuator": "realistic",
    "sensors": "realistic",
    "observation": "measured",
    "history": 3,  # what delay and lag of actuator and sensors hide
    "normalise": (290.0, 310.0),  # km/h: readings are counted from those of a passive run
}
LANES, ROLLOUT, EPOCHS, MINIBATCHES = 64, 128, 8, 4
GAMMA, LAMBDA, CLIP, LEARNING_RATE = 0.97, 0.95, 0.2, 1e-3
TRAINING_SEED, TEST_SEEDS = 2000, (0, 1)


def network(entries: int, outputs: int, last_gain: float) -> nn.Sequential:
    """Two hidden layers with orthogonal weights."""
    layers = [nn.Linear(entries, 128), nn.Linear(128, 128), nn.Linear(128, outputs)]
    for layer, gain in zip(layers, (2**0.5, 2**0.5, last_gain), strict=True):
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(layers[0], nn.Tanh(), layers[1], nn.Tanh(), layers[2])


class Agent(nn.Module):
    """Actor and critic; as a policy of `panto_env` it takes the most likely action."""

    name = "ppo"

    def __init__(self, entries: int, actions: int) -> None:
        super().__init__()
        self.actor, self.critic = network(entries, actions, 0.01), network(entries, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((actions,), -1.5))

    def actions(self, observations: torch.Tensor) -> Independent:
        """Distribution of the actions."""
        return Independent(Normal(self.actor(observations), self.log_std.exp()), 1)

    def values(self, observations: torch.Tensor) -> torch.Tensor:
        """Expected discounted reward."""
        return self.critic(observations).squeeze(-1)

    def reset(self, context: Any) -> None:
        """Nothing is kept between steps."""

    @torch.no_grad()
    def act(self, observation: np.ndarray) -> np.ndarray:
        """Action, (1,), in -1..1, for an observation, (entries,)."""
        return self.actor(torch.as_tensor(observation)).clamp(-1.0, 1.0).numpy()


def train(steps: int, report: bool = True) -> tuple[Agent, list[float]]:
    """Train an agent for about this number of steps, summed over lanes; also the mean reward per rollout."""
    torch.manual_seed(0)
    torch.set_num_threads(1)
    # "SameStep": the step that ends an episode returns the first observation of the next one; the last one
    # of the old episode is in info["final_obs"]. With "NextStep", the default of Gymnasium, the step after an
    # end only begins the next episode, and must be excluded from learning.
    envs = gymnasium.make_vec(
        "panto_env:Pantograph-v0",
        LANES,
        autoreset_mode=AutoresetMode.SAME_STEP,
        accuracy="fast",  # coarser than in the evaluation; an agent learns equally well
        run_in=10,  # episodes begin up to ten spans after the line's start
        distance=900.0,
        reward="agent",  # what the benchmark measures
        **TASK,
    )
    agent = Agent(envs.single_observation_space.shape[0], envs.single_action_space.shape[0])
    optimiser = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)
    updates, rewards_of_rollouts = max(1, steps // (LANES * ROLLOUT)), []
    observation = torch.as_tensor(envs.reset(seed=TRAINING_SEED)[0])
    for update in range(updates):
        optimiser.param_groups[0]["lr"] = LEARNING_RATE * (1 - update / updates)
        rollout, observation = collect(envs, agent, observation)
        learn(agent, optimiser, *rollout[:2], *advantages(agent, *rollout))
        rewards_of_rollouts.append(float(rollout[2].mean()))
        if report and update % 10 == 0:
            print(f"{(update + 1) * LANES * ROLLOUT} steps: mean reward {rewards_of_rollouts[-1]:.3f}")
    envs.close()
    return agent, rewards_of_rollouts


@torch.no_grad()
def collect(envs: Any, agent: Agent, observation: torch.Tensor) -> tuple[list[torch.Tensor], torch.Tensor]:
    """Rollout of all lanes, in the order of the arguments of ``advantages``, and the next observation."""
    rows = []
    for _ in range(ROLLOUT):
        action = agent.actions(observation).sample()
        then, reward, terminated, truncated, info = envs.step(action.clamp(-1.0, 1.0).numpy())
        following = then.copy()
        for lane in np.flatnonzero(terminated | truncated):
            following[lane] = info["final_obs"][lane]  # not the first observation of the next episode
        rest = (reward.astype(np.float32), following, terminated, truncated)
        rows.append([observation, action, *map(torch.as_tensor, rest)])
        observation = torch.as_tensor(then)
    return [torch.stack(column) for column in zip(*rows, strict=True)], observation


@torch.no_grad()
def advantages(
    agent: Agent,
    seen: torch.Tensor,
    taken: torch.Tensor,
    reward: torch.Tensor,
    following: torch.Tensor,
    terminated: torch.Tensor,
    truncated: torch.Tensor,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Advantages and returns, (steps, lanes), of a rollout in tensors of (steps, lanes, ...).

    Nothing follows a termination. After a truncation the line continues: the critic estimates its value.
    """
    values = agent.values(seen)
    surprise = reward + GAMMA * agent.values(following) * ~terminated - values
    result, later = torch.zeros_like(reward), torch.zeros(reward.shape[1])
    for step in reversed(range(len(reward))):
        later = surprise[step] + GAMMA * LAMBDA * later * ~(terminated | truncated)[step]
        result[step] = later
    return result, result + values


def learn(
    agent: Agent,
    optimiser: torch.optim.Optimizer,
    seen: torch.Tensor,
    taken: torch.Tensor,
    advantage: torch.Tensor,
    returns: torch.Tensor,
) -> None:
    """Some epochs of minibatches over one rollout."""
    seen, taken, advantage, returns = (each.flatten(0, 1) for each in (seen, taken, advantage, returns))
    with torch.no_grad():
        before = agent.actions(seen).log_prob(taken)
    for _ in range(EPOCHS):
        for part in torch.randperm(len(seen)).chunk(MINIBATCHES):
            ratio = (agent.actions(seen[part]).log_prob(taken[part]) - before[part]).exp()
            better = (advantage[part] - advantage[part].mean()) / (advantage[part].std() + 1e-8)
            gain = torch.min(ratio * better, ratio.clamp(1 - CLIP, 1 + CLIP) * better).mean()
            error = (agent.values(seen[part]) - returns[part]).square().mean()
            optimiser.zero_grad()
            (0.5 * error - gain).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimiser.step()


def judge(policy: Any) -> tuple[float, float]:
    """Changes (%) of sigma from the passive pantograph at the same mean, and of the mean from passive."""
    changes = []
    for seed in TEST_SEEDS:
        task = TASK | {"seed": seed, "record_droppers": False}
        own, passive = simulate(policy=policy, **task).summary(), simulate(**task).summary()
        same_mean = simulate(mean_force=own.mean, **task).summary()
        changes.append((100 * (own.std / same_mean.std - 1), 100 * (own.mean / passive.mean - 1)))
    sigma, mean = np.mean(changes, axis=0)
    return float(sigma), float(mean)


def main() -> None:
    """Train, then print the agent's change of sigma."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=400_000)
    agent, rewards = train(parser.parse_args().steps)
    print(f"mean reward per step: {rewards[0]:.3f} at first, {rewards[-1]:.3f} at last")
    print(
        "sigma {:+.1f} % of the passive pantograph of the same mean, mean force {:+.1f} %".format(
            *judge(agent)
        )
    )


if __name__ == "__main__":
    main()
