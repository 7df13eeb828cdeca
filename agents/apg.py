"""The analytic policy gradient: its network, which kernels drive through passes, and its learner.

Passes, each on a line of its own, are measured as linear models (``linear_pass``); it descends in them.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import torch
from torch import nn

from panto_baselines.benchmark.settings import TRAINING
from panto_baselines.benchmark.statistics import MOVED
from panto_baselines.policies.lanes_law import LanesLaw
from panto_baselines.policies.repetitive import WashoutSettings
from panto_env.analysis.pool import in_threads
from panto_env.backend import WIDTH
from panto_env.base.errors import InputError
from panto_env.base.machine import cores
from panto_env.control import Context
from panto_env.control.settings import RunSettings, run_settings
from panto_env.policies import find_policy

from .device_ppo import OwnLearner
from .linear_pass import Judged, LinearPass, Numbers, Pulsing, entries_of, measure
from .model_file import Actor, Cell
from .policy import NetworkPolicy
from .rollout import Entries, Given, Slopes, Trace, Washout, Weights, backward, forward
from .settings import Training, context_of

if TYPE_CHECKING:
    from .algorithm import APG, InRounds

T = TypeVar("T")
FIRST = 0.01
"""Factor on the last layer's initial weights: the first passes are nearly passive."""


class Network(nn.Module):  # type: ignore[misc]
    """Layers, with a gated recurrent unit after the first one if it has any units: as ``RecurrentActor``."""

    def __init__(self, entries: int, widths: tuple[int, ...], activation: Any, units: int) -> None:
        """entries: of an observation; widths: of the hidden layers; units: of the cell, 0 for none."""
        super().__init__()
        self.activation = activation()
        self.first = nn.Linear(entries, widths[0])
        self.cell = nn.GRUCell(widths[0], units) if units else None
        sizes = (widths[0] + units, *widths[1:], 1)
        self.rest = nn.ModuleList(nn.Linear(wide, narrow) for wide, narrow in pairwise(sizes))
        with torch.no_grad():
            self.rest[-1].weight *= FIRST
            self.rest[-1].bias.zero_()

    def weights(self) -> Weights:
        """Its parameters, in their order, for the kernels of a rollout."""
        first, first_bias, *others = (each.detach().numpy() for each in self.parameters())
        cell = [np.zeros((0, len(first)), np.float32), np.zeros((0, 0), np.float32)]
        biases = [np.zeros(0, np.float32)] * 2
        if self.cell is not None:
            *cell, biases[0], biases[1] = others[:4]
            others = others[4:]
        relu = isinstance(self.activation, nn.ReLU)
        rest = tuple(others[::2]), tuple(others[1::2])
        return Weights(first, first_bias, cell[0], biases[0], cell[1], biases[1], *rest, relu)

    def take(self, arrays: Sequence[Numbers]) -> None:
        """Set all parameters, in their order."""
        with torch.no_grad():
            for own, given in zip(self.parameters(), arrays, strict=True):
                own.copy_(torch.from_numpy(given))

    def arrays(self) -> Cell | None:
        """The cell's arrays, if it has one."""
        if self.cell is None:
            return None
        own = self.cell.weight_ih, self.cell.weight_hh, self.cell.bias_ih, self.cell.bias_hh
        return Cell(*(each.detach().numpy().copy() for each in own))


class Group(NamedTuple):
    """Passes that are driven abreast, at most ``WIDTH``."""

    given: Given
    judged: list[Judged]


def grouped(passes: Sequence[LinearPass]) -> list[Group]:
    """Passes in groups of similar lengths; one with fewer than ``WIDTH`` is filled with its first pass."""
    ordered, groups = sorted(passes, key=lambda each: len(each.actions)), []
    for first in range(0, len(ordered), WIDTH):
        some = ordered[first : first + WIDTH]
        given = _given([*some, *[some[0]] * (WIDTH - len(some))])
        groups.append(Group(given, [each.judged for each in some]))
    return groups


def rollout(
    groups: Sequence[Group], entries: Entries, washout: Washout, network: Network
) -> tuple[torch.Tensor, torch.Tensor, list[torch.Tensor]]:
    """What a network, in place of their own policy, makes of passes, with derivatives by its parameters.

    Variance of the force, where it counts, over the passive one, (passes,); shift of the mean force,
    relative to the passive one, (passes,); actions of each pass, (times,).
    """
    given = [each.given for each in groups]
    driven = _Driving.apply(given, entries, washout, network, *network.parameters())
    ratios, shifts, taken = [], [], []
    for group, moved, actions in zip(groups, driven[::2], driven[1::2], strict=True):
        for p, own in enumerate(group.judged):
            counted = slice(own.counted_from + 1, own.end)
            force = torch.from_numpy(own.force[counted]) + moved[counted, p]
            ratios.append(force.var(correction=0) / own.passive_variance)
            shifts.append(force.mean() / own.passive_mean - 1.0)
            taken.append(actions[: own.end, p])
    return torch.stack(ratios), torch.stack(shifts), taken


class _Driving(torch.autograd.Function):  # type: ignore[misc]
    """Changes of the force, and actions, of each group by turns, (times, WIDTH), by the parameters."""

    @staticmethod
    def forward(
        ctx: Any, groups: list[Given], entries: Entries, washout: Washout, network: Network, *_: torch.Tensor
    ) -> Any:
        weights = network.weights()
        units, values = weights.state.shape[1], len(entries.average)

        def drive(given: Given) -> Trace:
            times, seen, _ = given.observations.shape
            widths = (values + 1,), (values,), (seen,), (units + len(weights.first),), (4 * units,)
            rest = _zeros(*((times, len(each)) for each in weights.rest))
            scalars = _zeros((times,), (times,), (times,))
            trace = Trace(*[*_zeros(*((times, *each) for each in widths)), rest, *scalars])
            forward(given, entries, weights, washout, trace, *_zeros((2, 3 * units), (values,), (2,)))
            return trace

        traces = _side_by_side(drive, groups)
        ctx.known = groups, entries, washout, weights, traces
        pairs = [(np.ascontiguousarray(each.moved[:, -1]), each.taken) for each in traces]
        return tuple(torch.from_numpy(each) for pair in pairs for each in pair)

    @staticmethod
    def backward(ctx: Any, *slopes: torch.Tensor) -> Any:
        groups, entries, washout, weights, traces = ctx.known
        units, values = weights.state.shape[1], len(entries.average)

        def differentiate(given: Given, trace: Trace, force: Numbers, action: Numbers) -> list[Numbers]:
            shapes = ((len(action), len(each)) for each in (weights.first, weights.cell, weights.state))
            layers = Slopes(*[*_zeros(*shapes), tuple(np.zeros_like(each) for each in trace.rest)])
            work = _zeros((weights.first.shape[1],), (trace.joined.shape[1],), (units,), (values,), (2,))
            rest = entries, weights, washout, trace, force, action, layers
            backward(given, *rest, np.zeros_like(trace.now), work)
            return _by_weights(trace, layers, units)

        by = [np.ascontiguousarray(each.numpy()) for each in slopes]
        every = _side_by_side(differentiate, groups, traces, by[::2], by[1::2])
        found = [np.sum(own, axis=0, dtype=np.float32) for own in zip(*every, strict=True)]
        return None, None, None, None, *map(torch.from_numpy, found)


def _side_by_side(work: Any, *groups: Any) -> list[Any]:
    """The work for each group, on all cores."""
    with ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(work, *groups))


def _zeros(*shapes: tuple[int, ...]) -> Any:
    return tuple(np.zeros((*shape, WIDTH), dtype=np.float32) for shape in shapes)


def _given(group: list[LinearPass]) -> Given:
    """Passes as the kernels take them; those that are shorter than the longest one end in zeros."""
    steps = max(len(each.actions) for each in group)

    def padded(values: list[Any], axis: int = -1) -> Any:
        every = np.zeros((len(values), steps, *values[0].shape[1:]), dtype=values[0].dtype)
        for own, value in zip(every, values, strict=True):
            count = min(steps, len(value))
            own[:count] = value[:count]
        return np.ascontiguousarray(np.moveaxis(every, 0, axis))

    recalled = padded([each.recalled.reshape(len(each.recalled), -1) for each in group])
    before = np.floor(recalled).astype(np.int32)
    return Given(
        padded([each.observations for each in group]),
        padded([each.actions for each in group]),
        padded([each.response for each in group], axis=0),
        np.array([each.unit for each in group], dtype=np.float32),
        before,
        (recalled - before).astype(np.float32),
    )


def _by_weights(trace: Trace, slopes: Slopes, units: int) -> list[Numbers]:
    """Derivatives by weights and biases, in the order of a network's parameters."""
    state = np.concatenate([np.zeros_like(trace.joined[:1, :units]), trace.joined[:-1, :units]])
    layers = [[(slopes.first, trace.entries)]]
    if units:
        layers.append([(slopes.cell, trace.joined[:, units:]), (slopes.state, state)])
    layers += [[pair] for pair in zip(slopes.rest, [trace.joined, *trace.rest[:-1]], strict=True)]
    found: list[Numbers] = []
    for pairs in layers:
        found += [np.tensordot(slope, values, axes=((0, 2), (0, 2))) for slope, values in pairs]
        found += [slope.sum(axis=(0, 2)) for slope, _ in pairs]
    return found


MOST_FAILURES = 20
"""Passes in a row that may end early, under the policy or a pulse, before the training does."""
MOST = 4.0
"""Maximum ratio of variances that has a gradient."""
SHIFT_FREE = MOVED / 3
"""Relative shift of the mean force that costs nothing: a third of what a benchmark allows."""


class Passes:
    """Passes in a training's environments, by turns, in the place of a ``VecEnv``."""

    entries: int  # of an observation of whoever learns

    def __init__(self, environments: Sequence[Mapping[str, Any]], count: int) -> None:
        """environments: arguments of each. count: passes of a round."""
        self._settings = [run_settings(given) for given in environments]
        self.count, self.seconds, self.unwrapped = count, 0.0, self  # seconds: spent in passes so far

    def seed(self, seed: int) -> None:
        """Draw the passes' seeds, which are for training, from this one on."""
        self._random = np.random.default_rng(seed)

    def _run(self, run: Callable[[RunSettings, int], T], numbers: Sequence[int]) -> list[T]:
        """What a function makes of the passes of these numbers, each with its environment and a seed.

        They run side by side: what each does in Python takes no time of the others' kernels.
        """
        start, jobs = time.perf_counter(), []
        for number in numbers:
            seed = int(TRAINING[int(self._random.integers(len(TRAINING)))])
            jobs.append(partial(run, self._settings[number % len(self._settings)], seed))
        found = in_threads(jobs)
        self.seconds += time.perf_counter() - start
        return list(found)

    def close(self) -> None:
        """Do nothing: nothing is open."""


def washout_of(settings: WashoutSettings | None, context: Context) -> Washout:
    """A washout as the kernels take it."""
    interval = context.control_interval
    if settings is None:
        return Washout(0.0, 1.0, 0.0, interval)
    share = 1.0 - math.exp(-interval / settings.time_constant)
    return Washout(share, settings.rate / context.force_limit, float(settings.lag), interval)


class PassLanes(Passes):
    """Measures passes of a policy as linear models."""

    def __init__(self, training: Training, pulsing: Pulsing) -> None:
        """pulsing: see ``measure``. Raises InputError for an observation that cannot be learnt from."""
        super().__init__(training.environments, training.lanes)
        context = context_of(training.environments[0])
        self.entries, self.high_pass = len(context.layout.entries), training.washout
        self.terms = entries_of(context), washout_of(training.washout, context)
        self._pulsing, self._law, self.share = pulsing, None, 1.0
        if training.residual_of is not None:
            self._law, self.share = find_policy(training.residual_of), training.residual_share
            if not isinstance(self._law, LanesLaw):
                raise InputError(
                    "apg adds to policies that act in many lanes at once, such as repetitive, not to "
                    f"'{training.residual_of}'."
                )

    def measure(self, actor: Actor) -> tuple[list[Group], int]:
        """One round of passes under a network, and the environment steps that they took.

        Raises InputError where pass after pass ends early.
        """

        def one(settings: RunSettings, seed: int) -> LinearPass | InputError:
            policy = NetworkPolicy(deepcopy(actor), self.high_pass)
            try:
                return measure(settings, policy, seed, self._pulsing, deepcopy(self._law), self.share)
            except InputError as error:
                return error

        passes, failures = dict[int, LinearPass](), 0
        while missing := [number for number in range(self.count) if number not in passes]:
            for number, found in zip(missing, self._run(one, missing), strict=True):
                if isinstance(found, LinearPass):
                    passes[number], failures = found, 0
                    continue
                failures += 1
                if failures == MOST_FAILURES:
                    raise found
        ordered = [passes[number] for number in range(self.count)]
        return grouped(ordered), (self._pulsing.lanes + 2) * sum(len(each.actions) for each in ordered)


class NetworkLearner(OwnLearner):
    """Learns a ``Network`` from whole passes."""

    def __init__(self, settings: InRounds, lanes: Passes, seed: int) -> None:
        """lanes: where passes are run. seed: of network and minibatches."""
        super().__init__(settings, lanes, seed)
        activation = settings.policy_kwargs()["activation_fn"]
        self.network = Network(lanes.entries, settings.net_arch, activation, settings.recurrent_units)
        self._optimiser = torch.optim.Adam(self.network.parameters())


class APGLearner(NetworkLearner):
    """Measures passes in rounds, and descends the variance of the contact force through the latest ones."""

    def __init__(self, settings: APG, lanes: PassLanes, seed: int) -> None:
        """lanes: where passes are measured. seed: of network and minibatches."""
        super().__init__(settings, lanes, seed)
        self._rounds: deque[list[Group]] = deque(maxlen=settings.rounds_kept)

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
        groups, (entries, washout) = [known[each] for each in chosen], self._lanes.terms
        ratios, shifts, actions = rollout(groups, entries, washout, self.network)
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
