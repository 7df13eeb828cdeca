"""One pass of a pantograph along a line: its figures, a plot, and the same pass as an environment.

The line is the reference model of EN 50318:2002, at 300 km/h. An environment without any action is the same
simulation, step by step, so that its figures are the same.

    python examples/first_run.py --plot first_run.png

printed

    mean force 115.6 N, sigma 35.15 N
    sigma of the environment: 35.15 N
    broken of EN 50367 and EN 50119: standard deviation σ (N)
"""

from __future__ import annotations

import argparse

import gymnasium
import numpy as np

from panto_env import Trajectory, simulate
from panto_env.analysis.plots import plot_run, save
from panto_env.envs import BARE

SPEED_KMH = 300.0


def one_pass() -> Trajectory:
    """The record of one pass, from the line's start to its end."""
    return simulate(catenary="en50318-2002", pantograph="en50318-2002", speed_kmh=SPEED_KMH)


def same_as_environment(distance: float) -> Trajectory:
    """The same pass over a distance (m) through Gymnasium, with an action of zero: no force added."""
    # BARE: line and pantograph as designed, without the scatter, delays and noise of Pantograph-v0.
    task = BARE | {"catenary": "en50318-2002", "pantograph": "en50318-2002", "speed_kmh": SPEED_KMH}
    task |= {"distance": distance}  # by default an episode is shorter
    env = gymnasium.make("panto_env:Pantograph-v0", **task)
    env.reset(seed=0)
    passive = np.zeros(env.action_space.shape, dtype=np.float32)
    ended = False
    while not ended:
        _, _, terminated, truncated, _ = env.step(passive)
        ended = terminated or truncated
    record: Trajectory = env.unwrapped.trajectory
    return record


def main() -> None:
    """Print the figures of both, and draw the first."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", help="picture to write, as .png, .svg or .pdf")
    plot = parser.parse_args().plot
    run = one_pass()
    again = same_as_environment(run.distance)
    figures = run.summary()  # of spans 10 to 19, where the start has died out, as EN 50317 filters them
    print(f"mean force {figures.mean:.1f} N, sigma {figures.std:.2f} N")
    print(f"sigma of the environment: {again.summary().std:.2f} N")
    broken = [criterion.heading for criterion in run.compliance() if criterion.kept is False]
    print(f"broken of EN 50367 and EN 50119: {', '.join(broken) or 'nothing'}")
    if plot is not None:
        save(plot_run(run), plot)


if __name__ == "__main__":
    main()
