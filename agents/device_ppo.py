"""PPO in one file, whose network and environments share a device of PyTorch: nothing leaves it in a rollout.

The algorithm and its hyperparameters are those of Stable-Baselines3's PPO (Schulman et al., "Proximal policy
optimization algorithms", 2017; generalised advantage estimation), and so is the form of the learner here.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import torch
from torch import nn
from torch.distributions import Independent, Normal

from .own_learner import OwnLearner

if TYPE_CHECKING:
    from panto_env.envs.tensors import PantographTensorEnv

    from .algorithm import PPO
    from .settings import Training


class DeviceLanes:
    """Environments of a training on a device."""

    def __init__(self, training: Training) -> None:
        """Raises InputError where the environment's arguments are not valid, or the device cannot be used."""
        arguments = {name: value for name, value in training.environment.items() if name != "id"}
        env: Any = gymnasium.make_vec(
            training.environment["id"],
            num_envs=training.lanes,
            device=training.device,
            autoreset_mode="SameStep",
            figures=False,  # which the processor works out
            **arguments,
        )
        self.env: PantographTensorEnv = env.unwrapped
        self._seed = 0
        self.seconds = 0.0
        """Time that steps of the environments have taken so far."""

    @property
    def unwrapped(self) -> DeviceLanes:
        """Itself."""
        return self

    def seed(self, seed: int) -> Sequence[None]:
        """Seed of the next reset: that of its first start."""
        self._seed = seed
        return ()

    def reset(self) -> torch.Tensor:
        """Begin an episode in every lane; observations, (lanes, entries)."""
        return self.env.reset(seed=self._seed)[0]

    def step(self, actions: torch.Tensor) -> tuple[Any, ...]:
        """As the environment's ``step``."""
        begun = time.perf_counter()
        results = self.env.step(actions)  # waits for the device: it asks whether an episode has ended
        self.seconds += time.perf_counter() - begun
        return results

    def close(self) -> None:
        """Free the device's memory."""
        self.env.close()


def network(
    entries: int, widths: Sequence[int], activation: type[nn.Module], outputs: int, gain: float
) -> nn.Module:
    """Hidden layers and an output, with orthogonal weights, which in the last layer are multiplied by
    ``gain``.
    """
    layers: list[nn.Module] = []
    for width in widths:
        layers += [_linear(entries, width, 2**0.5), activation()]
        entries = width
    return nn.Sequential(*layers, _linear(entries, outputs, gain))


def _linear(entries: int, outputs: int, gain: float) -> nn.Linear:
    layer = nn.Linear(entries, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class ActorCritic(nn.Module):  # type: ignore[misc]
    """Distribution of actions, and expected discounted reward."""

    def __init__(self, settings: PPO, entries: int, actions: int) -> None:
        super().__init__()
        shape = settings.policy_kwargs()
        own = shape["net_arch"], shape["activation_fn"]
        self.actor, self.critic = network(entries, *own, actions, 0.01), network(entries, *own, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((actions,), settings.log_std_init))

    def actions(self, observations: torch.Tensor) -> Independent:
        """Distribution of the actions, not yet clipped."""
        return Independent(Normal(self.actor(observations), self.log_std.exp()), 1)

    def values(self, observations: torch.Tensor) -> torch.Tensor:
        """Expected discounted rewards, (...,)."""
        values: torch.Tensor = self.critic(observations).squeeze(-1)
        return values


class DevicePPO(OwnLearner[DeviceLanes]):
    """The learner. It logs no episodes: their figures would have to leave the device."""

    def __init__(self, settings: PPO, lanes: DeviceLanes, seed: int) -> None:
        """lanes: where it learns. seed: of network, exploration and minibatches."""
        self._device = lanes.env.device
        self._random = torch.Generator(self._device)
        super().__init__(lanes, seed)
        self._settings = settings
        spaces = lanes.env.single_observation_space, lanes.env.single_action_space
        entries, actions = (space.shape or (1,) for space in spaces)
        self.network = ActorCritic(settings, entries[0], actions[0]).to(self._device)
        self._optimiser = torch.optim.Adam(self.network.parameters(), eps=1e-5)

    def set_random_seed(self, seed: int) -> None:
        """Seed of exploration and minibatches."""
        self._random.manual_seed(seed)

    def learn(self, total_timesteps: int, callback: Any, **_: Any) -> None:
        """Learn for so many environment steps, in whole rollouts."""
        end = self.num_timesteps + total_timesteps
        schedule = self._settings.learning_rate_schedule()
        callback.init_callback(self)
        callback.on_training_start({"infos": []}, {})
        callback.update_locals({"infos": []})
        observation = self._lanes.reset()
        while self.num_timesteps < end:
            callback.on_rollout_start()
            rollout, observation = self._collect(observation)
            callback.on_step()
            callback.on_rollout_end()
            left = max(0.0, 1 - self.num_timesteps / end)
            rate = schedule(left) if callable(schedule) else schedule
            for group in self._optimiser.param_groups:
                group["lr"] = rate
            loss = self._update(*rollout)
            self.logger.record("train/value_loss", loss)
            self.logger.record("train/std", float(self.network.log_std.detach().exp().mean()))
            self.logger.record("train/learning_rate", rate)
            self.logger.dump(self.num_timesteps)
        callback.on_training_end()

    @torch.no_grad()  # type: ignore[untyped-decorator]
    def _collect(self, observation: torch.Tensor) -> tuple[tuple[torch.Tensor, ...], torch.Tensor]:
        """A rollout: observations, actions, their log-probabilities, advantages and returns, and the next
        observation.
        """
        env, settings, own = self._lanes.env, self._settings, self.network
        shape = settings.n_steps, env.num_envs
        observations = torch.empty((*shape, observation.shape[1]), device=self._device)
        actions = torch.empty((*shape, own.log_std.shape[0]), device=self._device)
        probabilities, rewards, values, ended = (torch.empty(shape, device=self._device) for _ in range(4))
        for k in range(settings.n_steps):
            observations[k] = observation
            chosen = own.actions(observation)
            noise = torch.randn(actions[k].shape, generator=self._random, device=self._device)
            actions[k] = chosen.mean + chosen.stddev * noise
            probabilities[k] = chosen.log_prob(actions[k])
            values[k] = own.values(observation)
            observation, rewards[k], terminated, truncated, infos = self._lanes.step(actions[k])
            ended[k] = terminated | truncated
            if "final_obs" in infos and bool(truncated.any()):  # the line goes on beyond an episode's end
                last = infos["final_obs"][truncated]
                rewards[k, truncated] += settings.gamma * own.values(last)
        self.num_timesteps += settings.n_steps * env.num_envs
        self.logger.record("rollout/reward", float(rewards.mean()))
        advantages, coming, after = torch.empty(shape, device=self._device), 0.0, own.values(observation)
        for k in reversed(range(settings.n_steps)):
            goes_on = 1 - ended[k]
            surprise = rewards[k] + settings.gamma * goes_on * after - values[k]
            coming = surprise + settings.gamma * settings.gae_lambda * goes_on * coming
            advantages[k], after = coming, values[k]
        steps = observations, actions, probabilities, advantages, advantages + values
        return tuple(each.flatten(0, 1) for each in steps), observation

    def _update(
        self,
        observations: torch.Tensor,
        actions: torch.Tensor,
        probabilities: torch.Tensor,
        advantages: torch.Tensor,
        returns: torch.Tensor,
    ) -> float:
        """Learn from a rollout; mean loss of the values in its last pass."""
        settings = self._settings
        losses: list[torch.Tensor] = []
        for _ in range(settings.n_epochs):
            order = torch.randperm(len(actions), generator=self._random, device=self._device)
            losses = []
            for some in order.split(settings.batch_size):
                chosen = self.network.actions(observations[some])
                log_ratio = chosen.log_prob(actions[some]) - probabilities[some]
                ratio, own = log_ratio.exp(), advantages[some]
                own = (own - own.mean()) / (own.std() + 1e-8)
                clipped = ratio.clamp(1 - settings.clip_range, 1 + settings.clip_range)
                value_loss = (self.network.values(observations[some]) - returns[some]).square().mean()
                loss = settings.vf_coef * value_loss - torch.minimum(own * ratio, own * clipped).mean()
                loss = loss - settings.ent_coef * chosen.entropy().mean()
                if settings.target_kl is not None:
                    divergence = float(((ratio - 1) - log_ratio).detach().mean())
                    if divergence > 1.5 * settings.target_kl:
                        return float(value_loss.detach())
                self._optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.network.parameters(), settings.max_grad_norm)
                self._optimiser.step()
                losses.append(value_loss.detach())
            self._n_updates += 1
        return float(torch.stack(losses).mean())
