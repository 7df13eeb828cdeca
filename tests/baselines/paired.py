"""Change of σ from policy A of a benchmark's result to B: ``python -m tests.baselines.paired RESULT A B``.

Prints the interquartile mean with its 95 % interval at each speed and over all of them; both policies met the
same lines, speeds and noise.
"""

import sys

import numpy as np

from panto_baselines.benchmark.statistics import Clusters, interquartile_mean, interval_of_mean
from panto_env.base.checksums import read_checked


def paired(result, before, after):
    """Change of σ (%) of each pass of a result on one line, (seeds, speeds), and the speeds (km/h)."""
    of = {
        policy: {(row["seed"], row["speed_kmh"]): row["std"] for row in result if row["policy"] == policy}
        for policy in (before, after)
    }
    seeds, speeds = (sorted({key[k] for key in of[before]}) for k in (0, 1))
    change = [
        [100 * (of[after][key] / of[before][key] - 1) for key in ((s, v) for v in speeds)] for s in seeds
    ]
    return np.array(change), speeds


def told(changes, speeds):
    """The interquartile mean and its interval, in words."""
    interval = interval_of_mean(changes.ravel(), Clusters.of_one_line(len(changes), changes.shape[1]))
    between = "" if interval is None else f" ({interval[0]:+.1f} to {interval[1]:+.1f})"
    at = " and ".join(f"{speed:g}" for speed in speeds)
    return f"{at} km/h: {interquartile_mean(changes.ravel()):+.1f} %{between}"


if __name__ == "__main__":
    path, before, after = sys.argv[1:]
    changes, speeds = paired(read_checked(path)["rows"], before, after)
    for place, speed in enumerate(speeds):
        print(told(changes[:, [place]], [speed]))
    print(told(changes, speeds))
