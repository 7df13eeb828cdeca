"""What the pantograph in front tells of the one behind: ``python -m tests.baselines.preview``, some minutes.

Prints the tables of docs/train.md: the share of the variance behind that a filter of the force in front
explains, and what policies gain behind on lines as built that no gain was fitted on.
"""

import numpy as np
from rich.console import Console
from rich.table import Table

from panto_env import simulate
from panto_env.metrics.low_pass import low_pass

STEP, REACH, TAPS = 0.5, 40.0, 2.0  # m: of places, to either side, between taps of the filter
FITTED, HELD_OUT = range(2000, 2006), range(100, 103)
CASES = [
    ("en50318-2002", 250, 100.0),
    ("en50318-2002", 250, 200.0),
    ("en50318-2002", 300, 100.0),
    ("en50318-2002", 300, 200.0),
    ("re330", 250, 100.0),
    ("re330", 250, 200.0),
    ("re330", 300, 100.0),
    ("re330", 300, 200.0),
    ("beijing-tianjin", 300, 200.0),
]
POLICIES = ("front-preview:base=''", "repetitive", "front-preview")


def of_train(line, speed, apart, **settings):
    """Settings of two of the same on a line as built."""
    return {
        "catenary": line,
        "pantographs": ["dsa380"] * 2,
        "distances": [apart],
        "speed_kmh": speed,
        "line_condition": "as-built",
        **settings,
    }


def explained(case):
    """Share of the variance of the force behind, on the seeds held out."""

    def forces(seeds):
        told, own = [], []
        for seed in seeds:
            first, second = simulate(seed=seed, **of_train(*case, distance=1800.0)).train
            x = np.arange(540.0, 1800.0, STEP)
            front, behind = (
                np.interp(x, run.position, low_pass(run.contact_force, run.time_step))
                for run in (first, second)
            )
            reach, every = int(REACH / STEP), int(TAPS / STEP)
            shifts = range(-reach, reach + 1, every)
            taps = [front[reach + shift : len(x) - reach + shift] for shift in shifts]
            told.append(np.stack(taps, axis=1) - front.mean())
            own.append(behind[reach : len(x) - reach] - behind.mean())
        return np.concatenate(told), np.concatenate(own)

    x, y = forces(FITTED)
    filtering = np.linalg.solve(x.T @ x + 1e-2 * len(x) * np.eye(x.shape[1]), x.T @ y)
    x, y = forces(HELD_OUT)
    return 1 - np.mean((y - x @ filtering) ** 2) / np.var(y)


def gained(case):
    """Mean passive sigma behind (N), and its mean change under each policy (%)."""
    settings = of_train(*case, controlled=2, actuator="realistic", sensors="realistic")
    passive, changes = [], []
    for seed in range(6):
        std = simulate(seed=seed, **settings).train[1].summary().std
        own = [simulate(seed=seed, policy=each, **settings).train[1].summary().std for each in POLICIES]
        passive.append(std)
        changes.append([100 * (each / std - 1) for each in own])
    return np.mean(passive), np.mean(changes, axis=0)


def main():
    table = Table("line", "km/h", "apart (m)", "explained", "passive σ (N)", *POLICIES)
    for case in CASES:
        std, changes = gained(case)
        line, speed, distance = case
        row = [f"{explained(case):.2f}", f"{std:.1f}", *(f"{each:.1f}" for each in changes)]
        table.add_row(line, f"{speed}", f"{distance:g}", *row)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
