"""The learner of the analytic policy gradient, in the form of a learner of Stable-Baselines3."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import nn

from panto_baselines.benchmark.statistics import MOVED
from panto_env.backend import WIDTH

from .linear_rollout import Group, Network
from .own_learner import OwnLearner

if TYPE_CHECKING:
    from .algorithm import APG
    from .pass_lanes import PassLanes

MOST = 4.0
"""Maximum ratio of variances that has a gradient."""
SHIFT_FREE = MOVED / 3
"""Relative shift of the mean force that costs nothing: a third of what a benchmark allows."""


class APGLearner(OwnLearner["PassLanes"]):
    """Measures passes in rounds, and descends the variance of the contact force through the latest ones."""

    def __init__(self, settings: APG, lanes: PassLanes, seed: int) -> None:
        """lanes: where passes are measured. seed: of network and minibatches."""
        super().__init__(lanes, seed)
        self._settings = settings
        kwargs = settings.policy_kwargs()
        shape = tuple(kwargs["net_arch"]), kwargs["activation_fn"]
        self.network = Network(lanes.entries, *shape, settings.recurrent_units)
        self._optimiser = torch.optim.Adam(self.network.parameters())
        self._rounds: deque[list[Group]] = deque(maxlen=settings.rounds_kept)

    def set_random_seed(self, seed: int) -> None:
        """Seed of the minibatches."""
        self._random = np.random.default_rng(seed)

    def learn(self, total_timesteps: int, callback: Any, **_: Any) -> None:
        """Learn for so many environment steps in whole rounds."""
        end = self.num_timesteps + total_timesteps
        schedule = self._settings.learning_rate_schedule()
        callback.init_callback(self)
        callback.on_training_start({"infos": []}, {})
        while self.num_timesteps < end:
            callback.on_rollout_start()
            groups, steps = self._lanes.measure(self._settings.actor(self))
            self._rounds.append(groups)
            own = [judged.ratio for group in groups for judged in group.judged]
            self.logger.record("rollout/std_ratio", float(np.mean(own)))  # of passes not learnt from yet
            self.num_timesteps += steps
            callback.update_locals({"infos": []})
            callback.on_step()
            callback.on_rollout_end()
            left = max(0.0, 1 - self.num_timesteps / end)
            rate = schedule(left) if callable(schedule) else schedule
            ratios = [self._update(rate) for _ in range(self._settings.updates)]
            self.logger.record("train/std_ratio", float(np.mean(ratios)))
            self.logger.record("train/learning_rate", rate)
            self.logger.dump(self.num_timesteps)
            callback.on_step()
        callback.on_training_end()

    def _update(self, rate: float) -> float:
        """One step of the optimiser; mean ratio of sigma to passive in its minibatch."""
        settings = self._settings
        known = [group for own in self._rounds for group in own]
        count = max(1, settings.batch_size // WIDTH)
        chosen = self._random.permutation(len(known))[:count].tolist()
        ratios, shifts, actions = self._lanes.rollout([known[each] for each in chosen])(self.network)
        beyond = [
            torch.relu(self._lanes.share * own.diff().abs() - settings.rate_free).square().mean()
            for own in actions
        ]
        # A pass worse than without control is learnt from, but does not outweigh all others.
        loss = ratios.clamp(max=MOST).mean() + settings.rate_weight * torch.stack(beyond).mean()
        shifted = torch.relu(shifts.abs() - SHIFT_FREE) / SHIFT_FREE
        loss = loss + settings.mean_weight * shifted.square().clamp(max=MOST).mean()
        for group in self._optimiser.param_groups:
            group["lr"] = rate
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), settings.max_grad_norm)
        self._optimiser.step()
        self._n_updates += 1
        return float(ratios.detach().sqrt().mean())
