"""What a policy does in the lanes of a training, for an agent to begin with."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env.envs import PantographVectorEnv

from .base_policy import PolicyLanes

Array = NDArray[np.float32]


class Demonstrations(NamedTuple):
    """Control steps of all lanes, in order."""

    observations: Array  # (steps, lanes, entries)
    wanted: Array  # (steps, lanes, actions): what the policy does
    taken: Array  # (steps, lanes, actions): what was done: that and noise
    rewards: Array  # (steps, lanes)
    terminated: NDArray[np.bool_]  # (steps, lanes): the run left the plant's valid range
    ended: NDArray[np.bool_]  # (steps, lanes): an episode ended, so or at its end
    following: Array  # (steps, lanes, entries): observations after the step, of the same episode


def demonstrate(
    native: PantographVectorEnv, policy: PolicyLanes, seeds: range, steps: int, noise: float
) -> Demonstrations:
    """Let a policy act for so many control steps in all lanes, seeded so.

    noise: rms of what is added to its actions, so that an agent sees how the policy finds back. The lanes
    must begin anew at once (``SameStep``).
    """
    random = np.random.default_rng(seeds[0])
    observations, _ = native.reset(seed=list(seeds))
    policy.begin(np.arange(native.num_envs))
    made: list[tuple[Any, ...]] = []
    for _ in range(steps):
        wanted = policy.act(observations)
        noisy = wanted + noise * random.standard_normal(wanted.shape)
        taken = np.clip(noisy, -1.0, 1.0).astype(np.float32)
        after, rewards, terminated, truncated, infos = native.step(taken)
        ended, following = terminated | truncated, after
        if ended.any():
            following = after.copy()
            following[ended] = np.stack(infos["final_obs"][ended])
            policy.begin(np.flatnonzero(ended))
        made.append((observations, wanted, taken, rewards, terminated, ended, following))
        observations = after
    observed, wanted, taken, rewards, ends, cuts, after = (np.array(each) for each in zip(*made, strict=True))
    return Demonstrations(
        observed, wanted.astype(np.float32), taken, rewards.astype(np.float32), ends, cuts, after
    )


def returns(shown: Demonstrations, gamma: float) -> tuple[Array, NDArray[np.bool_]]:
    """Discounted sums of rewards to come, (steps, lanes), and which of them are known to 1 %.

    What comes after the last step, and after the end of a line, is not known.
    """
    sums, weight = np.zeros_like(shown.rewards), np.zeros_like(shown.rewards)
    total, unknown = np.zeros(shown.rewards.shape[1]), np.ones(shown.rewards.shape[1])
    for step in reversed(range(len(sums))):
        terminated, cut = shown.terminated[step], shown.ended[step] & ~shown.terminated[step]
        total = np.where(shown.ended[step], 0.0, total)
        unknown = np.where(terminated, 0.0, np.where(cut, 1.0, unknown))
        total, unknown = shown.rewards[step] + gamma * total, gamma * unknown
        sums[step], weight[step] = total, unknown
    return sums, weight < 0.01
