"""Passes to learn from, in place of lanes of a vector environment: each on a line of its own."""

from __future__ import annotations

import time
from copy import deepcopy
from functools import partial

import numpy as np

from panto_baselines.benchmark.settings import TRAINING
from panto_baselines.policies.lanes_law import LanesLaw
from panto_env.analysis.pool import in_threads
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.lines import on_example
from panto_env.control.settings import run_settings
from panto_env.policies import Policy, find_policy

from .actor import Actor
from .linear_pass import Base, LinearPass, Pulsing, columns_of, measure
from .linear_rollout import Group, Rollout, Terms, grouped
from .policy import WashedOut
from .settings import Training

MOST_FAILURES = 20
"""Passes in a row that may end early, under the policy or a pulse, before the training does."""


class PassLanes:
    """Measures passes of a policy in a training's environments, by turns."""

    def __init__(self, training: Training, pulsing: Pulsing) -> None:
        """pulsing: see ``measure``. Raises InputError for an observation that cannot be learnt from."""
        self._settings = [run_settings(own) for own in training.environments]
        context = Task(on_example(self._settings[0])).context(0)
        self.entries, self.count = len(context.layout.entries), training.lanes
        self.terms = Terms(
            columns_of(context.layout), context.control_interval, context.force_limit, training.washout
        )
        self._pulsing = pulsing
        self._base = (
            None if training.residual_of is None else _base(training.residual_of, training.residual_share)
        )
        self.share = training.residual_share if self._base else 1.0  # of the force limit, of an action of 1
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
            jobs = [partial(self._pass, number, deepcopy(policy), self._seed()) for number in missing]
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

    def _seed(self) -> int:
        """The next pass's seed."""
        return int(TRAINING[int(self._random.integers(len(TRAINING)))])

    def rollout(self, groups: list[Group]) -> Rollout:
        """These groups side by side, for a network."""
        return Rollout(groups, self.terms)

    def close(self) -> None:
        """Do nothing: nothing is open."""


def _base(name: str, share: float) -> Base:
    """The policy that a network adds to. Raises InputError unless it acts in many lanes at once."""
    law = find_policy(name)
    if not isinstance(law, LanesLaw):
        raise InputError(
            f"apg adds to policies that act in many lanes at once, such as repetitive, not to '{name}'."
        )
    return Base(law, share)
