"""Policies alone and behind the guard, on lines as built: python -m tests.baselines.guard [seeds]."""

import sys
import warnings

import numpy as np

from .test_guarded import changes

CASES = (
    ("re330", "dsa380", 250.0),
    ("re330", "dsa380", 300.0),
    ("beijing-tianjin", "dsa380", 300.0),
    ("beijing-tianjin", "dsa380", 350.0),
    ("sweden-st15", "dsa250", 160.0),
    ("sweden-st15", "dsa250", 200.0),
    ("ln2", "dsa250", 220.0),
    ("ln2", "dsa250", 260.0),
    ("benchmark-2015", "benchmark-2015", 250.0),
    ("benchmark-2015", "benchmark-2015", 300.0),
    ("re250", "dsa250", 200.0),
)
POLICIES = ("agent-any-pantograph", "agent-any-line", "repetitive", "fb+ff:gain=0.3,washout=1", "pd", "fb+ff")


def main(seeds: int, policies: tuple[str, ...]) -> None:
    """Print a row for each policy, alone and guarded: mean and worst change (%) in both windows."""
    print("| policy | spans 10–19 | worst | spans 40–49 | worst |\n|---|---:|---:|---:|---:|")
    for policy in policies:
        for name in (policy, f"guarded:{policy}"):
            found = np.array([changes(*case, name, seed) for case in CASES for seed in range(seeds)])
            (first, late), (worst, worst_late) = found.mean(axis=0), found.max(axis=0)
            print(f"| `{name}` | {first:.1f} | {worst:.1f} | {late:.1f} | {worst_late:.1f} |", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(int(sys.argv[1]) if sys.argv[1:] else 2, POLICIES)
