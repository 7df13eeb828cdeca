"""Soft actor-critic with Stable-Baselines3 in Pantograph-v0, judged by the benchmark.

The actor sees two earlier control steps, since actuator and sensors are late, and readings relative to those
of a passive run. A critic that learns from single steps must not meet spans in which nothing counts: what it
sees there looks like the rest and earns nothing, so `settle=0`.

    python examples/train_sac.py --steps 400000 --output sac.safetensors

printed after ten minutes of one core

    200 km/h: sigma -20.1 %
    250 km/h: sigma -7.9 %
    300 km/h: sigma -12.2 %
    350 km/h: sigma -28.2 %
    ranked

of the passive pantograph at the same mean force, on lines as built that it has not seen. SAC needs few steps,
but steps cost little here; PPO reaches more in a minute (README, examples/ppo_cleanrl.py).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import torch
from stable_baselines3 import SAC

from panto_agents.lanes import PantographVecEnv
from panto_agents.stable_baselines import save_policy
from panto_baselines.benchmark.overall import Standing
from panto_baselines.benchmark.run import Benchmark, run
from panto_baselines.benchmark.settings import load_benchmark

SPEEDS_KMH, SEEDS = (200.0, 250.0, 300.0, 350.0), 6


def train(steps: int, lanes: int = 8) -> SAC:
    """Train a learner for this number of steps, summed over the lanes; it learns once per vector step."""
    torch.set_num_threads(1)  # such small networks are slower on more
    envs = gymnasium.make_vec(
        "panto_env:Pantograph-v0", lanes, accuracy="fast", history=2, normalise=(200, 350), settle=0
    )
    learner = SAC(
        "MlpPolicy",
        PantographVecEnv(envs),
        learning_rate=lambda left: 1e-3 * left,  # to 0 at the end: the last policy is then as good as others
        gamma=0.95,
        batch_size=512,
        ent_coef="auto_0.1",
        policy_kwargs={"net_arch": [64, 64]},
        seed=0,
        device="cpu",
    )
    return learner.learn(steps)


def judge(model: Path, seeds: int = SEEDS) -> Benchmark:
    """The benchmark of a model file on lines as built."""
    track = load_benchmark("benchmark/as-built")
    line = track.lines[0].model_copy(update={"speeds_kmh": SPEEDS_KMH})
    changes = {"policies": ("passive", str(model)), "lines": (line,), "seeds": tuple(range(seeds))}
    return run(track.model_copy(update=changes))


def main() -> None:
    """Train, store the policy, and print the change of sigma at each speed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=400_000)
    parser.add_argument("--output", type=Path, default=Path("sac.safetensors"))
    given = parser.parse_args()
    save_policy(train(given.steps), given.output)
    result = judge(given.output)
    for cell in result.cells:
        if cell.policy != "passive":
            print(f"{cell.speed_kmh:g} km/h: sigma {cell.change:+.1f} %")
    standing: Standing = result.standings[-1]
    print(standing.disqualified or "ranked")


if __name__ == "__main__":
    main()
