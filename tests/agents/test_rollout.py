"""Kernels that drive a network through linear passes, beside the same in torch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

import torch
from torch import nn

from panto_agents.linear_pass import Columns, LinearPass
from panto_agents.linear_rollout import Network, Rollout, Terms, grouped
from panto_baselines.policies.repetitive import Washout, WashoutSettings

from .rollout_in_torch import Washout as InTorch
from .rollout_in_torch import driven

ENTRIES, VALUES, DEPTH, PLACES, LENGTH = 23, 6, 2, 3, 12
INTERVAL, LIMIT = 0.01, 100.0
WASHOUT = WashoutSettings(time_constant=0.3)


def terms(memory: bool = True, deviate: bool = True, washout: Any = WASHOUT) -> Terms:
    order = np.random.default_rng(5).permutation(ENTRIES)
    now, rest = order[: DEPTH * VALUES].reshape(DEPTH, VALUES), order[DEPTH * VALUES :]
    places = rest[: 2 * PLACES * memory].reshape(2, 1, PLACES * memory)
    return Terms(Columns(now, places[0], places[1], 4, deviate), INTERVAL, LIMIT, washout)


def a_pass(seed: int, times: int) -> LinearPass:
    """Smooth random numbers in the form of a pass, with places passed 15 to 20 steps ago."""
    random = np.random.default_rng(seed)
    response = random.integers(-3000, 3000, (times + 1, LENGTH, VALUES + 1)).astype(np.int16)
    recalled = np.arange(times + 1.0)[:, None, None] - random.uniform(15, 20, (1, 1, PLACES))
    return LinearPass(
        random.normal(size=(times + 1, ENTRIES)).astype(np.float32),
        np.tanh(random.normal(size=times)).astype(np.float32),
        (100 + 20 * random.normal(size=times + 1)).astype(np.float32),
        response,
        np.full(VALUES + 1, 1e-4, dtype=np.float32),
        np.where(recalled < 0, -1.0, recalled).astype(np.float32),
        100.0,
        300.0,
        20,
    )


CASES = {
    "layers": {},
    "recurrent": {"units": 5},
    "relu": {"activation": nn.ReLU, "units": 4, "widths": (7, 6, 5)},
    "one layer": {"widths": (9,)},
    "no washout": {"units": 5, "washout": None},
    "washout without lag": {"washout": WashoutSettings(time_constant=0.3, lag=0.0)},
    "an actuator that is slow": {"washout": WashoutSettings(time_constant=0.3, rate=300.0)},
    "no memory": {"units": 5, "memory": False},
    "readings as they are": {"units": 5, "deviate": False},
}


@pytest.mark.parametrize("given", CASES.values(), ids=CASES)
def test_rollouts_and_their_derivatives_are_those_of_torch(given):
    """Eleven passes of unequal lengths: two groups, one of them not full."""
    own = {key: given[key] for key in ("memory", "deviate", "washout") if key in given}
    common = terms(**own)
    torch.manual_seed(1)
    network = Network(
        ENTRIES, given.get("widths", (8, 6)), given.get("activation", nn.Tanh), given.get("units", 0)
    )
    with torch.no_grad():
        network.rest[-1].weight *= 300
    passes = [a_pass(seed, 40 + 3 * (seed % 4)) for seed in range(11)]
    if not own.get("memory", True):
        passes = [each._replace(recalled=each.recalled[:, :, :0]) for each in passes]
    groups = grouped(passes)
    ratios, shifts, actions = Rollout(groups, common)(network)
    loss = (ratios * torch.arange(1.0, 12)).sum() + (shifts**2).sum()
    loss = loss + sum((each.diff() ** 2).sum() for each in actions)
    found = torch.autograd.grad(loss, list(network.parameters()))
    loss_in_torch, ordered = 0.0, sorted(passes, key=lambda each: len(each.actions))
    for number, each in enumerate(ordered):
        force, acted = driven(network, each, common)
        np.testing.assert_allclose(actions[number].detach(), acted.detach(), atol=2e-5)
        counted = force[each.counted_from + 1 :]
        ratio = counted.var(correction=0) / each.passive_variance
        assert ratios[number].item() == pytest.approx(ratio.item(), rel=1e-4)
        loss_in_torch = loss_in_torch + (number + 1) * ratio + (acted.diff() ** 2).sum()
        loss_in_torch = loss_in_torch + (counted.mean() / each.passive_mean - 1) ** 2
    expected = torch.autograd.grad(loss_in_torch, list(network.parameters()))
    assert max(float(each.abs().max()) for each in expected) > 0.1
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=2e-3, atol=2e-4 * float(b.abs().max()) + 1e-6)


def test_the_washout_in_torch_is_that_of_the_policies():
    random, common = np.random.default_rng(0), terms()
    requested = np.cumsum(random.normal(0, 0.3, 200)).clip(-1, 1)
    own, known = InTorch(common), Washout(common.washout, INTERVAL, LIMIT, (1,))
    for each in requested:
        expected = float(known(np.array([LIMIT * each]))[0]) / LIMIT
        assert float(own(torch.tensor(each))) == pytest.approx(expected, abs=1e-6)
