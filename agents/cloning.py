"""Demonstrations by a policy in the lanes of a training, from which an agent learns first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from panto_env.envs import PantographVectorEnv

from .algorithm import Cloning
from .lanes import PolicyLanes

Array = NDArray[np.float32]


class Demonstrations(NamedTuple):
    """Control steps of a policy in all lanes, in order."""

    observations: Array  # (steps, lanes, entries)
    intended: Array  # (steps, lanes, actions): the policy's actions
    taken: Array  # (steps, lanes, actions): actions taken: the policy's plus noise
    rewards: Array  # (steps, lanes)
    terminated: NDArray[np.bool_]  # (steps, lanes): the run left the plant's valid range
    ended: NDArray[np.bool_]  # (steps, lanes): an episode ended, early or at its end
    following: Array  # (steps, lanes, entries): observations after the step, of the same episode


def demonstrate(
    native: PantographVectorEnv, policy: PolicyLanes, seeds: range, steps: int, noise: float
) -> Demonstrations:
    """Let a policy act in all lanes; steps: control steps; seeds: one per lane.

    noise: rms of the noise added to its actions, so that an agent sees how the policy recovers. The lanes
    must reset within the step that ends an episode (``SameStep``).
    """
    random = np.random.default_rng(seeds[0])
    observations, _ = native.reset(seed=list(seeds))
    policy.begin(np.arange(native.num_envs))
    made: list[tuple[Any, ...]] = []
    for _ in range(steps):
        intended = policy.act(observations)
        noisy = intended + noise * random.standard_normal(intended.shape)
        taken = np.clip(noisy, -1.0, 1.0).astype(np.float32)
        after, rewards, terminated, truncated, infos = native.step(taken)
        ended, following = terminated | truncated, after
        if ended.any():
            following = after.copy()
            following[ended] = np.stack(infos["final_obs"][ended])
            policy.begin(np.flatnonzero(ended))
        made.append((observations, intended, taken, rewards, terminated, ended, following))
        observations = after
    kinds = (None, np.float32, None, np.float32, None, None, None)
    return Demonstrations(*map(np.array, zip(*made, strict=True), kinds))


def returns(examples: Demonstrations, gamma: float) -> tuple[Array, NDArray[np.bool_]]:
    """Discounted sums of future rewards, (steps, lanes), and which of them are known to within 1 %.

    Rewards after the last step, and after the end of a line, are not known.
    """
    sums, weight = np.zeros_like(examples.rewards), np.zeros_like(examples.rewards)
    total, unknown = np.zeros(examples.rewards.shape[1]), np.ones(examples.rewards.shape[1])
    for step in reversed(range(len(sums))):
        terminated, cut = examples.terminated[step], examples.ended[step] & ~examples.terminated[step]
        total = np.where(examples.ended[step], 0.0, total)
        unknown = np.where(terminated, 0.0, np.where(cut, 1.0, unknown))
        total, unknown = examples.rewards[step] + gamma * total, gamma * unknown
        sums[step], weight[step] = total, unknown
    return sums, weight < 0.01


HELD_OUT = 0.125
"""Share of the steps, the last ones, that are held out of the fit; the error is computed on them."""


def clone(actor: Any, parameters: list[Any], examples: Demonstrations, cloning: Cloning) -> dict[str, float]:
    """Fit an actor to a policy's actions; on steps that are held out rms of its error and of these actions.

    actor: actions, (n, actions), as a differentiable function of observations, (n, entries). parameters:
    torch parameters of the actor.
    """
    # Steps of all lanes, (n, width): the first ones, and the last ones, which are held out of the fit.
    first = round((1 - HELD_OUT) * len(examples.intended))
    (seen, unseen), (intended, unseen_intended) = (
        [part.reshape(-1, part.shape[-1]) for part in (each[:first], each[first:])]
        for each in (examples.observations, examples.intended)
    )
    regress(actor, parameters, seen, intended, cloning)
    with torch.no_grad():
        difference = actor(torch.as_tensor(unseen)).numpy() - unseen_intended
    rms = [float(np.sqrt(np.mean(each.astype(float) ** 2))) for each in (difference, unseen_intended)]
    return dict(zip(("error", "rms"), rms, strict=True))


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
