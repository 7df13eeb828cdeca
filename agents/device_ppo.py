"""Learners in the form of those of Stable-Baselines3: what they share, and PPO on a device of PyTorch.

Its network and environments share the device, which nothing leaves in a rollout. The algorithm and its
hyperparameters are those of Stable-Baselines3's PPO (Schulman et al., "Proximal policy optimization
algorithms", 2017; generalised advantage estimation).
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.logger import Logger
from torch import nn
from torch.distributions import Independent, Normal

if TYPE_CHECKING:
    from panto_env.envs.tensors import PantographTensorEnv

    from .algorithm import PPO
    from .settings import Training


class OwnLearner(ABC):
    """A learner with one network and one optimiser, which learns in rounds."""

    ep_info_buffer = None  # there are no episodes to average
    network: Any
    _optimiser: torch.optim.Optimizer
    logger: Logger

    def __init__(self, settings: Any, lanes: Any, seed: int) -> None:
        """lanes: where it learns. seed: of the network, and of all else that is random."""
        self._settings, self._lanes = settings, lanes
        self.num_timesteps, self._n_updates = 0, 0
        self.set_random_seed(seed)
        torch.manual_seed(seed)

    def get_env(self) -> Any:
        """Where it learns."""
        return self._lanes

    def set_logger(self, logger: Logger) -> None:
        """Where figures of the training go."""
        self.logger = logger

    def set_random_seed(self, seed: int) -> None:
        """Seed of what is random but the network."""
        self._random: Any = np.random.default_rng(seed)

    def get_parameters(self) -> dict[str, Any]:
        """State of network and optimiser."""
        return {"network": self.network.state_dict(), "optimiser": self._optimiser.state_dict()}

    def set_parameters(self, parameters: dict[str, Any]) -> None:
        """Restore what ``get_parameters`` gave."""
        self.network.load_state_dict(parameters["network"])
        self._optimiser.load_state_dict(parameters["optimiser"])

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        return ["network", "optimiser"], []

    def learn(self, total_timesteps: int, callback: Any, **_: Any) -> None:
        """Learn for so many environment steps, in whole rounds."""
        end = self.num_timesteps + total_timesteps
        schedule = self._settings.learning_rate_schedule()
        callback.init_callback(self)
        callback.on_training_start({"infos": []}, {})
        while self.num_timesteps < end:
            callback.on_rollout_start()
            collected = self._collect()
            callback.on_step()
            callback.on_rollout_end()
            rate = schedule(max(0.0, 1 - self.num_timesteps / end)) if callable(schedule) else schedule
            for group in self._optimiser.param_groups:
                group["lr"] = rate
            self.logger.record("train/learning_rate", rate)
            self._update(collected)
            self.logger.dump(self.num_timesteps)
            callback.on_step()
        callback.on_training_end()

    @abstractmethod
    def _collect(self) -> Any:
        """What a round learns from."""

    @abstractmethod
    def _update(self, collected: Any) -> None:
        """Learn from it."""

    def _descend(self, loss: torch.Tensor) -> None:
        """One step of the optimiser."""
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self._settings.max_grad_norm)
        self._optimiser.step()


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
        self._seed, self.seconds, self.unwrapped = 0, 0.0, self  # seconds: of steps of the environments

    def seed(self, seed: int) -> None:
        """Seed of the next reset: that of its first start."""
        self._seed = seed

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


class ActorCritic(nn.Module):  # type: ignore[misc]
    """Distribution of actions, and expected discounted reward."""

    def __init__(self, settings: PPO, entries: int, actions: int) -> None:
        super().__init__()
        shape = settings.policy_kwargs()
        self._widths, self._activation = shape["net_arch"], shape["activation_fn"]
        self.actor, self.critic = self._layers(entries, actions, 0.01), self._layers(entries, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((actions,), settings.log_std_init))

    def _layers(self, entries: int, outputs: int, gain: float) -> nn.Module:
        """Layers with orthogonal weights, which in the last one are multiplied by ``gain``."""
        layers: list[nn.Module] = []
        for number, (wide, narrow) in enumerate(pairwise((entries, *self._widths, outputs))):
            layer = nn.Linear(wide, narrow)
            nn.init.orthogonal_(layer.weight, gain if number == len(self._widths) else 2**0.5)
            nn.init.zeros_(layer.bias)
            layers += [layer, self._activation()]
        return nn.Sequential(*layers[:-1])

    def actions(self, observations: torch.Tensor) -> Independent:
        """Distribution of the actions, not yet clipped."""
        return Independent(Normal(self.actor(observations), self.log_std.exp()), 1)

    def values(self, observations: torch.Tensor) -> torch.Tensor:
        """Expected discounted rewards, (...,)."""
        return self.critic(observations).squeeze(-1)


class DevicePPO(OwnLearner):
    """The learner. It logs no episodes: their figures would have to leave the device."""

    def __init__(self, settings: PPO, lanes: DeviceLanes, seed: int) -> None:
        """lanes: where it learns. seed: of network, exploration and minibatches."""
        self._device = lanes.env.device
        self._random = torch.Generator(self._device)
        super().__init__(settings, lanes, seed)
        self._observation = None
        spaces = lanes.env.single_observation_space, lanes.env.single_action_space
        entries, actions = (space.shape or (1,) for space in spaces)
        self.network = ActorCritic(settings, entries[0], actions[0]).to(self._device)
        self._optimiser = torch.optim.Adam(self.network.parameters(), eps=1e-5)

    def set_random_seed(self, seed: int) -> None:
        """Seed of exploration and minibatches."""
        self._random.manual_seed(seed)

    @torch.no_grad()  # type: ignore[untyped-decorator]
    def _collect(self) -> tuple[torch.Tensor, ...]:
        """A rollout: observations, actions, their log-probabilities, advantages and returns."""
        env, settings, network = self._lanes.env, self._settings, self.network
        observation: Any = self._lanes.reset() if self._observation is None else self._observation
        shape = settings.n_steps, env.num_envs
        observations = torch.empty((*shape, observation.shape[1]), device=self._device)
        actions = torch.empty((*shape, network.log_std.shape[0]), device=self._device)
        probabilities, rewards, values, ended = (torch.empty(shape, device=self._device) for _ in range(4))
        for k in range(settings.n_steps):
            observations[k] = observation
            chosen = network.actions(observation)
            noise = torch.randn(actions[k].shape, generator=self._random, device=self._device)
            actions[k] = chosen.mean + chosen.stddev * noise
            probabilities[k] = chosen.log_prob(actions[k])
            values[k] = network.values(observation)
            observation, rewards[k], terminated, truncated, infos = self._lanes.step(actions[k])
            ended[k] = terminated | truncated
            if "final_obs" in infos and bool(truncated.any()):  # the line goes on beyond an episode's end
                last = infos["final_obs"][truncated]
                rewards[k, truncated] += settings.gamma * network.values(last)
        self._observation = observation
        self.num_timesteps += settings.n_steps * env.num_envs
        self.logger.record("rollout/reward", float(rewards.mean()))
        advantages, coming, after = torch.empty(shape, device=self._device), 0.0, network.values(observation)
        for k in reversed(range(settings.n_steps)):
            goes_on = 1 - ended[k]
            surprise = rewards[k] + settings.gamma * goes_on * after - values[k]
            coming = surprise + settings.gamma * settings.gae_lambda * goes_on * coming
            advantages[k], after = coming, values[k]
        steps = observations, actions, probabilities, advantages, advantages + values
        return tuple(each.flatten(0, 1) for each in steps)

    def _update(self, collected: tuple[torch.Tensor, ...]) -> None:
        self.logger.record("train/value_loss", self._learn_from(collected))
        self.logger.record("train/std", float(self.network.log_std.detach().exp().mean()))

    def _learn_from(self, collected: tuple[torch.Tensor, ...]) -> float:
        """Learn from a rollout; mean loss of the values in its last pass."""
        observations, actions, probabilities, advantages, returns = collected
        settings = self._settings
        losses: list[torch.Tensor] = []
        for _ in range(settings.n_epochs):
            order = torch.randperm(len(actions), generator=self._random, device=self._device)
            losses = []
            for some in order.split(settings.batch_size):
                chosen = self.network.actions(observations[some])
                log_ratio = chosen.log_prob(actions[some]) - probabilities[some]
                ratio, advantage = log_ratio.exp(), advantages[some]
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                clipped = ratio.clamp(1 - settings.clip_range, 1 + settings.clip_range)
                value_loss = (self.network.values(observations[some]) - returns[some]).square().mean()
                gain = torch.minimum(advantage * ratio, advantage * clipped).mean()
                loss = settings.vf_coef * value_loss - gain - settings.ent_coef * chosen.entropy().mean()
                if settings.target_kl is not None:
                    divergence = float(((ratio - 1) - log_ratio).detach().mean())
                    if divergence > 1.5 * settings.target_kl:
                        return float(value_loss.detach())
                self._descend(loss)
                losses.append(value_loss.detach())
            self._n_updates += 1
        return float(torch.stack(losses).mean())
