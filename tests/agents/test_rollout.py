"""Kernels that drive a network through linear passes, beside the same in torch, step by step."""

from __future__ import annotations

import pytest

pytest.importorskip("torch")


import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import torch
from torch import nn

from panto_agents.apg import Network, grouped, rollout, washout_of
from panto_agents.linear_pass import Judged, LinearPass
from panto_agents.model_file import Actor
from panto_agents.rollout import Entries
from panto_baselines.policies.repetitive import Washout, WashoutSettings

from ..marks import some_at_once


def driven(network: Any, own: Any, entries: Any, settings: Any) -> tuple[torch.Tensor, torch.Tensor]:
    """Force (N) and actions at the steps of a pass, (times,)."""
    washout, share = InTorch(settings), torch.tensor(entries.average)
    response = torch.tensor(own.response) * torch.tensor(own.unit)
    averages, state = torch.zeros(len(share)), None
    now, changes, actions, force = [], [], [], []
    for t in range(len(own.actions)):
        moved = sum(
            (changes[t - 1 - k] * response[t, k] for k in range(min(t, response.shape[1]))),
            0 * response[0, 0],
        )
        averages = averages + share * (moved[:-1] - averages)
        now.append(moved[:-1] - averages)
        seen = torch.tensor(own.observations[t])
        for ago in range(min(len(entries.now), t + 1)):
            seen = seen.index_add(0, torch.tensor(entries.now[ago]), now[t - ago])
        for place in range(entries.force.size):
            when = float(own.recalled[t].ravel()[place])
            if when >= 0:
                part = torch.lerp(now[int(when)], now[int(when) + 1], when - int(when))
                places = torch.tensor([entries.force[place], entries.acted[place]])
                seen = seen.index_add(0, places, part[[entries.of_force, -1]])
        action, state = stepped(network, seen, state)
        actions.append(washout(action))
        changes.append(actions[-1] - float(own.actions[t]))
        force.append(float(own.judged.force[t]) + moved[-1])
    return torch.stack(force), torch.stack(actions)


def stepped(network: Any, seen: torch.Tensor, state: Any) -> tuple[torch.Tensor, Any]:
    """Action and next state of a network by torch's own modules."""
    values = network.activation(network.first(seen[None]))
    if network.cell is not None:
        state = network.cell(values, state)
        values = torch.cat([state, values], dim=1)
    for layer in network.rest[:-1]:
        values = network.activation(layer(values))
    return torch.tanh(network.rest[-1](values))[0, 0], state


class InTorch:
    """``panto_baselines.policies.repetitive.Washout`` of one action in torch."""

    def __init__(self, settings: Any) -> None:
        self._settings = settings
        if settings is not None:
            self._share = 1 - math.exp(-INTERVAL / settings.time_constant)
            self._rate = settings.rate / LIMIT
        self._average = self._force = torch.tensor(0.0)

    def __call__(self, requested: torch.Tensor) -> torch.Tensor:
        if self._settings is None:
            return requested.clamp(-1, 1)
        left = (requested - self._average).clamp(-1, 1)
        ahead, lag = left - self._force, self._settings.lag
        by_rate = (ahead.abs() - self._rate * lag).clamp(0, self._rate * INTERVAL)
        nearer = 1 - torch.exp((by_rate / self._rate - INTERVAL) / lag) if lag else 1.0
        self._force = self._force + ahead.sign() * (by_rate + (ahead.abs() - by_rate) * nearer)
        self._average = self._average + self._share * self._force
        return left


torch.set_num_threads(1)
ENTRIES, VALUES, DEPTH, PLACES, LENGTH = 23, 6, 2, 3, 12
INTERVAL, LIMIT = 0.01, 100.0
WASHOUT = WashoutSettings(time_constant=0.3)


def entries(memory: bool = True, deviate: bool = True) -> Entries:
    order = np.random.default_rng(5).permutation(ENTRIES)
    now, rest = order[: DEPTH * VALUES].reshape(DEPTH, VALUES), order[DEPTH * VALUES :]
    force, acted = rest[: 2 * PLACES * memory].reshape(2, PLACES * memory)
    average = np.zeros(VALUES, dtype=np.float32)
    average[:-1] = deviate * 0.02
    return Entries(now, force, acted, 4, average)


def a_pass(seed: int, times: int) -> LinearPass:
    """Smooth random numbers in the form of a pass, with places passed 15 to 20 steps ago."""
    random = np.random.default_rng(seed)
    response = random.integers(-3000, 3000, (times + 1, LENGTH, VALUES + 1)).astype(np.int16)
    recalled = np.arange(times + 1.0)[:, None, None] - random.uniform(15, 20, (1, 1, PLACES))
    return LinearPass(
        random.normal(size=(times + 1, ENTRIES)).astype(np.float32),
        np.tanh(random.normal(size=times)).astype(np.float32),
        response,
        np.full(VALUES + 1, 1e-4, dtype=np.float32),
        np.where(recalled < 0, -1.0, recalled).astype(np.float32),
        Judged((100 + 20 * random.normal(size=times + 1)).astype(np.float32), 20, times, 100.0, 300.0),
    )


CASES = {
    "recurrent": {"units": 5},
    "a slow actuator": {"washout": WashoutSettings(time_constant=0.3, rate=300.0)},
    "one layer, no lag": {"widths": (9,), "washout": WashoutSettings(time_constant=0.3, lag=0.0)},
    "relu, no washout": {"activation": nn.ReLU, "units": 4, "widths": (7, 6, 5), "washout": None},
    "no memory, readings as they are": {"units": 5, "memory": False, "deviate": False},
}


@pytest.mark.longer
@pytest.mark.parametrize("case", some_at_once(CASES, ("recurrent", "a slow actuator")))
def test_rollouts_and_their_derivatives_are_those_of_torch(case):
    """Nine passes of unequal lengths: two groups, one of them not full."""
    given = CASES[case]
    moved = entries(given.get("memory", True), given.get("deviate", True))
    settings = given.get("washout", WASHOUT)
    context = SimpleNamespace(control_interval=INTERVAL, force_limit=LIMIT)
    torch.manual_seed(1)
    network = Network(
        ENTRIES, given.get("widths", (8, 6)), given.get("activation", nn.Tanh), given.get("units", 0)
    )
    with torch.no_grad():
        network.rest[-1].weight *= 300
    passes = [a_pass(seed, 30 + 3 * (seed % 4)) for seed in range(9)]
    if not moved.force.size:
        passes = [each._replace(recalled=each.recalled[:, :, :0]) for each in passes]
    groups = grouped(passes)
    ratios, shifts, actions = rollout(groups, moved, washout_of(settings, context), network)
    loss = (ratios * torch.arange(1.0, 10)).sum() + (shifts**2).sum()
    loss = loss + sum((each.diff() ** 2).sum() for each in actions)
    found = torch.autograd.grad(loss, list(network.parameters()))
    loss_in_torch, ordered = 0.0, sorted(passes, key=lambda each: len(each.actions))
    for number, each in enumerate(ordered):
        force, acted = driven(network, each, moved, settings)
        np.testing.assert_allclose(actions[number].detach(), acted.detach(), atol=2e-5)
        counted = force[each.judged.counted_from + 1 :]
        ratio = counted.var(correction=0) / each.judged.passive_variance
        assert ratios[number].item() == pytest.approx(ratio.item(), rel=1e-4)
        loss_in_torch = loss_in_torch + (number + 1) * ratio + (acted.diff() ** 2).sum()
        loss_in_torch = loss_in_torch + (counted.mean() / each.judged.passive_mean - 1) ** 2
    expected = torch.autograd.grad(loss_in_torch, list(network.parameters()))
    assert max(float(each.abs().max()) for each in expected) > 0.1
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=2e-3, atol=2e-4 * float(b.abs().max()) + 1e-6)


def test_the_washout_in_torch_is_that_of_the_policies():
    requested = np.cumsum(np.random.default_rng(0).normal(0, 0.3, 200)).clip(-1, 1)
    own, known = InTorch(WASHOUT), Washout(WASHOUT, INTERVAL, LIMIT, (1,))
    for each in requested:
        expected = float(known(np.array([LIMIT * each]))[0]) / LIMIT
        assert float(own(torch.tensor(each))) == pytest.approx(expected, abs=1e-6)


def test_a_recurrent_actor_acts_as_its_network_in_torch_and_forgets_at_a_reset():
    torch.manual_seed(0)
    network = Network(4, (6, 5), nn.Tanh, 3)
    with torch.no_grad():
        network.rest[-1].weight *= 100
    linear = [network.first, *network.rest]
    arrays = [[getattr(each, kind).detach().numpy() for each in linear] for kind in ("weight", "bias")]
    actor = Actor(*map(tuple, arrays), "tanh", True, network.arrays())
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
