"""A policy's network in many linear passes at once, differentiable by torch through whole passes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch

from panto_baselines.policies.washout import WashoutSettings
from panto_env.control.entries import AVERAGED

from .linear_pass import Columns, LinearPass

Network = Callable[[torch.Tensor], torch.Tensor]


class Rollout:
    """Passes side by side; a network drives them in place of their own policy."""

    def __init__(
        self,
        passes: Sequence[LinearPass],
        columns: Columns,
        interval: float,
        limit: float,
        washout: WashoutSettings | None,
    ) -> None:
        """interval: of control (s); limit: of the actuator's force (N); washout: of the action, if any."""
        self._columns, self._washout, self._interval, self._limit = columns, washout, interval, limit
        self._average_share = torch.full((columns.now.shape[1],), 1.0 - math.exp(-interval / AVERAGED))
        self._average_share[-1] = 0.0  # the action has no average
        self._ends = [len(each.actions) for each in passes]
        self.steps = max(self._ends)

        def stacked(values: list[Any]) -> torch.Tensor:
            """Values of all passes, (steps, passes, ...); zeros after the end of each."""
            every = np.zeros((self.steps, len(values), *values[0].shape[1:]), dtype=values[0].dtype)
            for own, value, end in zip(every.swapaxes(0, 1), values, self._ends, strict=True):
                own[:end] = value[:end]
            return torch.from_numpy(every)

        self._observations = stacked([each.observations for each in passes])
        self._actions = stacked([each.actions for each in passes])
        self._response = stacked([each.response for each in passes])
        self._force = stacked([each.force for each in passes])
        recalled = stacked([each.recalled for each in passes]).flatten(2)
        self._known, self._recalled = recalled >= 0, recalled.clamp(min=0.0)
        self._counted_from = [each.counted_from for each in passes]
        self._passive = torch.tensor([each.passive_variance for each in passes])
        # Within so many steps none of them is remembered.
        lag = torch.arange(float(self.steps))[:, None, None] - recalled.ceil()
        self._stretch = max(1, int(lag[self._known].min())) if self._known.any() else self.steps
        self._into = _selection(columns, self._observations.shape[2])

    def __call__(self, network: Network) -> tuple[torch.Tensor, list[torch.Tensor]]:
        """Variance of the force, where it counts, over the passive one, (passes,); actions of each pass.

        network: actions, (passes, 1), for observations, (passes, entries).
        """
        lanes, values = self._actions.shape[1], self._columns.now.shape[1]
        changes = torch.zeros(lanes, self._response.shape[2])  # of the actions 1, 2, .. steps ago
        told = torch.zeros(lanes, self._columns.now.size)  # changes of the observed values, the latest first
        averages = torch.zeros(lanes, values)
        kept: list[torch.Tensor] = []  # changes of the values of each step
        moved, taken = [], []
        washout = _Washout(self._washout, self._interval, self._limit, lanes)
        for first in range(0, self.steps, self._stretch):
            last = min(first + self._stretch, self.steps)
            remembered = self._remembered(kept, first, last)
            for step in range(first, last):
                change = torch.bmm(changes[:, None], self._response[step].float())[:, 0]
                moved.append(change[:, -1])
                now = change[:, :-1]
                if self._columns.deviate:
                    averages = averages + self._average_share * (now - averages)
                    now = now - averages
                kept.append(now)
                told = torch.cat([now, told[:, :-values]], dim=1)
                every = torch.cat([told, remembered[step - first]], dim=1)
                action = washout(network(self._observations[step] + every @ self._into)[:, 0])
                taken.append(action)
                changes = torch.cat([(action - self._actions[step])[:, None], changes[:, :-1]], dim=1)
        force = (self._force + torch.stack(moved)).T
        counted = [
            own[start + 1 : end].var(correction=0)
            for own, start, end in zip(force, self._counted_from, self._ends, strict=True)
        ]
        actions = torch.stack(taken, dim=1)
        return torch.stack(counted) / self._passive, [
            own[:end] for own, end in zip(actions, self._ends, strict=True)
        ]

    def _remembered(self, kept: list[torch.Tensor], first: int, last: int) -> torch.Tensor:
        """Changes of what is remembered in steps from first to before last, (steps, passes, values)."""
        if first < 2:
            return torch.zeros(last - first, self._recalled.shape[1], 2 * self._recalled.shape[2])
        when = self._recalled[first:last].clamp(max=first - 1.0)
        before = when.floor().long().clamp(max=first - 2)
        share, known = when - before, self._known[first:last]
        values = torch.stack(kept, dim=1)  # (passes, steps before, values)

        def between(line: torch.Tensor) -> torch.Tensor:
            steps = last - first
            at = before.transpose(0, 1).flatten(1)
            low, high = (
                torch.gather(line, 1, each).view(len(line), steps, -1).transpose(0, 1)
                for each in (at, at + 1)
            )
            return known * (low + share * (high - low))

        return torch.cat([between(values[:, :, self._columns.of_force]), between(values[:, :, -1])], dim=2)


def _selection(columns: Columns, entries: int) -> torch.Tensor:
    """Matrix from changes to the entries that they change, (changes, entries).

    Changes: of readings and action now and in earlier steps, of the remembered force and actions.
    """
    into = [*columns.now.ravel(), *columns.force.ravel(), *columns.acted.ravel()]
    matrix = torch.zeros(len(into), entries)
    matrix[torch.arange(len(into)), torch.tensor(np.array(into))] = 1.0
    return matrix


class _Washout:
    """``panto_baselines.policies.washout.Washout`` in torch, for actions; none leaves them as they are."""

    def __init__(self, settings: WashoutSettings | None, interval: float, limit: float, lanes: int) -> None:
        self._settings, self._interval = settings, interval
        if settings is not None:
            self._share = 1.0 - math.exp(-interval / settings.time_constant)
            self._rate = settings.rate / limit
            self._average, self._force = torch.zeros(lanes), torch.zeros(lanes)

    def __call__(self, requested: torch.Tensor) -> torch.Tensor:
        """Actions, (lanes,), each in -1..1."""
        if self._settings is None:
            return requested.clamp(-1.0, 1.0)
        left = (requested - self._average).clamp(-1.0, 1.0)
        ahead, lag, interval = left - self._force, self._settings.lag, self._interval
        distance = ahead.abs()
        by_rate = (distance - self._rate * lag).clamp(0.0, self._rate * interval)
        nearer = -torch.expm1((by_rate / self._rate - interval) / lag) if lag else 1.0
        self._force = self._force + ahead.sign() * (by_rate + (distance - by_rate) * nearer)
        self._average = self._average + self._share * self._force
        return left
