"""Behaviour cloning: an agent learns a policy's actions by regression before it learns from rewards."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from .cloning_settings import Cloning, CloningError
from .demonstrations import Demonstrations

HELD_OUT = 0.125
"""Share of the steps, the last ones, that are held out of the fit; the error is computed on them."""


def clone(actor: Any, parameters: list[Any], examples: Demonstrations, cloning: Cloning) -> CloningError:
    """Fit an actor to a policy's actions.

    actor: actions, (n, actions), as a differentiable function of observations, (n, entries). parameters:
    torch parameters of the actor.
    """
    (seen, intended), (unseen, unseen_intended) = _split(examples.observations, examples.intended)
    regress(actor, parameters, seen, intended, cloning)
    with torch.no_grad():
        difference = actor(torch.as_tensor(unseen)).numpy() - unseen_intended
    return CloningError(error=_rms(difference), rms=_rms(unseen_intended))


def regress(
    function: Callable[[Any], Any],
    parameters: list[Any],
    inputs: NDArray[np.float32],
    outputs: NDArray[np.float32],
    cloning: Cloning,
) -> None:
    """Least squares by Adam: fit function(inputs) to the outputs, both (n, width)."""
    x, y = torch.as_tensor(inputs), torch.as_tensor(outputs)
    batches = -(-len(x) // cloning.batch_size)
    optimiser = torch.optim.Adam(parameters, lr=cloning.learning_rate)
    decay = torch.optim.lr_scheduler.LinearLR(optimiser, 1.0, 0.1, cloning.epochs * batches)
    for _ in range(cloning.epochs):
        for batch in torch.randperm(len(x)).chunk(batches):
            loss = torch.nn.functional.mse_loss(function(x[batch]), y[batch])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            decay.step()


def _split(*arrays: NDArray[np.float32]) -> list[list[NDArray[np.float32]]]:
    """Split arrays, (steps, lanes, width), into first steps and held-out ones, each as (n, width)."""
    first = round((1 - HELD_OUT) * len(arrays[0]))
    parts = [[each[:first] for each in arrays], [each[first:] for each in arrays]]
    return [[each.reshape(-1, each.shape[-1]) for each in part] for part in parts]


def _rms(values: NDArray[np.float32]) -> float:
    return float(np.sqrt(np.mean(values.astype(float) ** 2)))
