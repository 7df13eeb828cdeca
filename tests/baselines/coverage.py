"""Coverage of the benchmark's intervals where the truth is known: `python -m tests.baselines.coverage`.

Passes are drawn as stored results have them: speeds differ, seeds differ at all speeds alike, and there is a
rest. The truth is the figure of very many such passes. A 95 % interval should contain it in 95 % of draws.
"""

from collections.abc import Callable

import numpy as np
from scipy import stats

from panto_baselines.benchmark.statistics import Clusters, interval_of_mean, share_of
from panto_env.base.table import Table

SEEDS = (4, 8, 16, 32)
SPEEDS = (1, 5)
KINDS: dict[str, Callable] = {  # of what seeds and passes add: mean 0, standard deviation 1
    "normal": lambda random, size: random.standard_normal(size),
    "skewed": lambda random, size: (random.gamma(2.0, 1.0, size) - 2.0) / np.sqrt(2.0),
    "heavy-tailed": lambda random, size: random.standard_t(3.0, size) / np.sqrt(3.0),
}
MEANS = (-50.0, -34.0)
"""Change (%) at the lowest and the highest speed, of `agent-high-speed` on the high-speed track as built."""
DEVIATION = 5.0
"""Standard deviation (%) of the passes of one cell, of the same: seeds add 4.1, the rest 3.1."""
OF_SEEDS = 0.5
"""Share of that variance that a seed's passes have in common: 0.3 to 0.6 there, up to 0.9 on other tracks."""
WON = 0.7
"""Share of passes that a policy wins against another: those below this quantile of all changes."""
TRAININGS, BETWEEN_TRAININGS = 5, 2.0
"""Number of trainings of a method, and the standard deviation between their means (%)."""
MANY = 400_000


def draw(random, kind, repetitions, seeds, speeds):
    """Changes (%), (repetitions, seeds, speeds)."""
    effect = KINDS[kind]
    common = effect(random, (repetitions, seeds, 1))
    rest = effect(random, (repetitions, seeds, speeds))
    means = np.linspace(*MEANS, speeds) if speeds > 1 else np.mean(MEANS)
    return means + DEVIATION * (np.sqrt(OF_SEEDS) * common + np.sqrt(1 - OF_SEEDS) * rest)


def mean(many):
    """The benchmark's interval of the interquartile mean of (seeds, speeds) changes, and the truth."""

    def interval(changes):
        return interval_of_mean(changes.ravel(), Clusters.of_one_line(*changes.shape))

    return interval, stats.trim_mean(many, 0.25)


def mean_by_cell(many, resamples=499):
    """A percentile bootstrap for which seeds are drawn anew at each speed, and the truth."""

    def interval(changes):
        draws = np.random.default_rng(0).integers(0, len(changes), (resamples, *changes.shape))
        drawn = np.take_along_axis(changes[None], draws, 1).reshape(resamples, -1)
        return np.quantile(stats.trim_mean(drawn, 0.25, axis=1), (0.025, 0.975))

    return interval, stats.trim_mean(many, 0.25)


def mean_of_trainings(many):
    """The benchmark's interval of a method's mean over ``TRAININGS`` trainings, drawn here, and the truth."""
    random = np.random.default_rng(2)

    def interval(changes):
        trainings = BETWEEN_TRAININGS * random.standard_normal((TRAININGS, 1))
        return interval_of_mean(changes.ravel() + trainings, Clusters.of_one_line(*changes.shape))

    return interval, stats.trim_mean(many, 0.25)


def share(many):
    """The benchmark's interval of the share of changes below a value, and the truth."""
    below = np.quantile(many, WON)

    def interval(changes):
        wins = changes.ravel()[None, None] < below
        return share_of(wins, Clusters.of_one_line(*changes.shape)).interval

    return interval, WON


FIGURES = {
    "mean, by cell": mean_by_cell,
    "mean": mean,
    f"mean of {TRAININGS} trainings": mean_of_trainings,
    f"share of {WON}": share,
}


def coverage(figure, kind, seeds, speeds, repetitions=4000):
    """Share (%) of draws whose interval contains the truth."""
    random = np.random.default_rng([seeds, speeds])
    interval, truth = FIGURES[figure](draw(random, kind, 1, MANY, speeds).ravel())
    found = [interval(changes) for changes in draw(random, kind, repetitions, seeds, speeds)]
    return 100 * np.mean([low <= truth <= high for low, high in found])


def table():
    """Coverage of all intervals, for all numbers of speeds and seeds and all kinds."""
    rows = [
        (name, str(speeds), str(seeds), *(f"{coverage(name, kind, seeds, speeds):.1f}" for kind in KINDS))
        for name in FIGURES
        for speeds in SPEEDS
        for seeds in SEEDS
    ]
    return Table("Coverage of 95 % intervals (%)", ("interval of", "speeds", "seeds", *KINDS), rows)


if __name__ == "__main__":
    print(table().markdown)
