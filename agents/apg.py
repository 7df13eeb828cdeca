"""The analytic policy gradient: passes, each on a line of its own, and a learner that descends in them."""

from __future__ import annotations

import time
from collections import deque
from copy import deepcopy
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import torch

from panto_baselines.benchmark.settings import TRAINING
from panto_baselines.benchmark.statistics import MOVED
from panto_baselines.policies.lanes_law import LanesLaw
from panto_env.analysis.pool import in_threads
from panto_env.backend import WIDTH
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.lines import on_example
from panto_env.control.settings import run_settings
from panto_env.policies import Policy, find_policy

from .device_ppo import OwnLearner
from .linear_pass import Base, LinearPass, Pulsing, columns_of, measure
from .linear_rollout import Group, Network, Rollout, Terms, grouped
from .model_file import Actor
from .policy import WashedOut
from .settings import Training

if TYPE_CHECKING:
    from .algorithm import APG

MOST_FAILURES = 20
"""Passes in a row that may end early, under the policy or a pulse, before the training does."""
MOST = 4.0
"""Maximum ratio of variances that has a gradient."""
SHIFT_FREE = MOVED / 3
"""Relative shift of the mean force that costs nothing: a third of what a benchmark allows."""


class PassLanes:
    """Measures passes of a policy in a training's environments, by turns."""

    def __init__(self, training: Training, pulsing: Pulsing) -> None:
        """pulsing: see ``measure``. Raises InputError for an observation that cannot be learnt from."""
        self._settings = [run_settings(given) for given in training.environments]
        context = Task(on_example(self._settings[0])).context(0)
        self.entries, self.count = len(context.layout.entries), training.lanes
        columns, interval, limit = columns_of(context.layout), context.control_interval, context.force_limit
        self.terms = Terms(columns, interval, limit, training.washout)
        self._pulsing, self._base, self.share = pulsing, None, 1.0
        if training.residual_of is not None:
            law = find_policy(training.residual_of)
            if not isinstance(law, LanesLaw):
                raise InputError(
                    "apg adds to policies that act in many lanes at once, such as repetitive, not to "
                    f"'{training.residual_of}'."
                )
            self.share = training.residual_share  # of the force limit, of an action of 1
            self._base = Base(law, self.share)
        self.seconds, self.unwrapped = 0.0, self  # spent in the plant so far

    def seed(self, seed: int) -> None:
        """Draw the passes' seeds, which are for training, from this one on."""
        self._random = np.random.default_rng(seed)

    def measure(self, actor: Actor) -> tuple[list[Group], int]:
        """One round of passes under a network, and the environment steps that they took.

        Passes run side by side: what each does in Python takes no time of the others' kernels. Raises
        InputError where pass after pass ends early.
        """
        washout = self.terms.washout
        policy: Policy = actor if washout is None else WashedOut(actor, washout)
        start, passes, failures = time.perf_counter(), dict[int, LinearPass](), 0
        while missing := [number for number in range(self.count) if number not in passes]:
            drawn = [int(TRAINING[int(self._random.integers(len(TRAINING)))]) for _ in missing]
            jobs = [
                partial(self._pass, number, deepcopy(policy), seed)
                for number, seed in zip(missing, drawn, strict=True)
            ]
            for number, found in zip(missing, in_threads(jobs), strict=True):
                if isinstance(found, LinearPass):
                    passes[number], failures = found, 0
                    continue
                failures += 1
                if failures == MOST_FAILURES:
                    raise found
        self.seconds += time.perf_counter() - start
        ordered = [passes[number] for number in range(self.count)]
        return grouped(ordered), (self._pulsing.lanes + 2) * sum(len(each.actions) for each in ordered)

    def _pass(self, number: int, policy: Policy, seed: int) -> LinearPass | InputError:
        """Pass of a number, in the environment whose turn it is; the error where it ends early."""
        settings = self._settings[number % len(self._settings)]
        try:
            return measure(settings, policy, seed, self._pulsing, deepcopy(self._base))
        except InputError as error:
            return error

    def close(self) -> None:
        """Do nothing: nothing is open."""


class APGLearner(OwnLearner[PassLanes]):
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

    def _collect(self) -> list[Group]:
        groups, steps = self._lanes.measure(self._settings.actor(self))
        ratios = [judged.ratio for group in groups for judged in group.judged]
        self.logger.record("rollout/std_ratio", float(np.mean(ratios)))  # of passes not learnt from yet
        self.num_timesteps += steps
        self._rounds.append(groups)
        return [group for each in self._rounds for group in each]

    def _update(self, collected: list[Group]) -> None:
        ratios = [self._step(collected) for _ in range(self._settings.updates)]
        self.logger.record("train/std_ratio", float(np.mean(ratios)))

    def _step(self, known: list[Group]) -> float:
        """One step of the optimiser; mean ratio of sigma to passive in its minibatch."""
        settings = self._settings
        count = max(1, settings.batch_size // WIDTH)
        chosen = self._random.permutation(len(known))[:count].tolist()
        rollout = Rollout([known[each] for each in chosen], self._lanes.terms)
        ratios, shifts, actions = rollout(self.network)
        beyond = [
            torch.relu(self._lanes.share * each.diff().abs() - settings.rate_free).square().mean()
            for each in actions
        ]
        # A pass worse than without control is learnt from, but does not outweigh all others.
        loss = ratios.clamp(max=MOST).mean() + settings.rate_weight * torch.stack(beyond).mean()
        shifted = torch.relu(shifts.abs() - SHIFT_FREE) / SHIFT_FREE
        self._descend(loss + settings.mean_weight * shifted.square().clamp(max=MOST).mean())
        self._n_updates += 1
        return float(ratios.detach().sqrt().mean())
