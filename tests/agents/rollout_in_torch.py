"""A network in one linear pass, step by step in torch: what the kernels of a rollout must agree with."""

from __future__ import annotations

import math
from typing import Any

import torch

from panto_env.control.entries import AVERAGED


def driven(network: Any, own: Any, terms: Any) -> tuple[torch.Tensor, torch.Tensor]:
    """Force (N) and actions at the steps of a pass, (times,)."""
    columns, washout = terms.columns, Washout(terms)
    response = torch.tensor(own.response) * torch.tensor(own.unit)
    share = torch.full((columns.now.shape[1],), 1 - math.exp(-terms.interval / AVERAGED))
    share[-1] = 0.0  # the action has no average
    share *= columns.deviate
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
        for ago in range(min(len(columns.now), t + 1)):
            seen = seen.index_add(0, torch.tensor(columns.now[ago]), now[t - ago])
        for place in range(columns.force.size):
            when = float(own.recalled[t].ravel()[place])
            if when >= 0:
                part = torch.lerp(now[int(when)], now[int(when) + 1], when - int(when))
                entries = torch.tensor([columns.force.ravel()[place], columns.acted.ravel()[place]])
                seen = seen.index_add(0, entries, part[[columns.of_force, -1]])
        action, state = stepped(network, seen, state)
        actions.append(washout(action))
        changes.append(actions[-1] - float(own.actions[t]))
        force.append(float(own.force[t]) + moved[-1])
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


class Washout:
    """``panto_baselines.policies.repetitive.Washout`` of one action in torch."""

    def __init__(self, terms: Any) -> None:
        self._settings, self._interval = terms.washout, terms.interval
        if self._settings is not None:
            self._share = 1 - math.exp(-terms.interval / self._settings.time_constant)
            self._rate = self._settings.rate / terms.limit
        self._average = self._force = torch.tensor(0.0)

    def __call__(self, requested: torch.Tensor) -> torch.Tensor:
        if self._settings is None:
            return requested.clamp(-1, 1)
        left = (requested - self._average).clamp(-1, 1)
        ahead, lag = left - self._force, self._settings.lag
        by_rate = (ahead.abs() - self._rate * lag).clamp(0, self._rate * self._interval)
        nearer = 1 - torch.exp((by_rate / self._rate - self._interval) / lag) if lag else 1.0
        self._force = self._force + ahead.sign() * (by_rate + (ahead.abs() - by_rate) * nearer)
        self._average = self._average + self._share * self._force
        return left
