"""Means, worst quarters, shares, and intervals: against bootstraps written out, SciPy, and a known truth."""

import numpy as np
import pytest
from scipy import stats

from panto_baselines.benchmark.statistics import (
    Clusters,
    interquartile_mean,
    interval_of_mean,
    share_of,
    worst_quarter,
)

from .coverage import KINDS, coverage


def test_interquartile_mean_leaves_out_the_ends():
    assert interquartile_mean(np.array([0.0, 1.0, 3.0, 100.0])) == 2
    assert interquartile_mean(np.array([1.0, 3.0, 8.0])) == 4
    assert np.isnan(interquartile_mean(np.array([1.0, 3.0, np.nan, 3.0, 3.0])))


def test_worst_quarter_is_the_upper_end_that_the_interquartile_mean_leaves_out():
    assert worst_quarter(np.array([7.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0])) == 8
    assert worst_quarter(np.array([7.0, 1.0, 9.0])) == 9
    assert np.isnan(worst_quarter(np.array([1.0, np.nan, 2.0])))


def drawn_anew(lines, repetitions=6000):
    """Deviation of interquartile means for which the seeds of each line, (seeds, speeds), are drawn anew."""
    random = np.random.default_rng(4)
    means = []
    for _ in range(repetitions):
        drawn = [passes[random.integers(0, len(passes), len(passes))].ravel() for passes in lines]
        means.append(stats.trim_mean(np.concatenate(drawn), 0.25))
    return stats.iqr(means, rng=(15.866, 84.134)) / 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "seeds", "freedom"),
    [([(9, 1)], 9, 8), ([(9, 5)], 9, 8), ([(4, 2), (6, 3)], 10, 8)],
    ids=["one speed", "five speeds", "two lines"],
)
def test_interval_is_that_of_means_for_which_whole_seeds_are_drawn_within_lines(lines, seeds, freedom):
    """Against a bootstrap written out, with other random numbers."""
    random = np.random.default_rng(3)
    passes = [
        10.0 * k + random.exponential(5.0, (shape[0], 1)) + random.normal(0.0, 2.0, shape)
        for k, shape in enumerate(lines)
    ]
    parts = [Clusters.of_one_line(*shape) for shape in lines]
    clusters = Clusters(
        np.concatenate([part.line + k for k, part in enumerate(parts)]),
        np.concatenate([part.seed for part in parts]),
    )
    values = np.concatenate([part.ravel() for part in passes])
    low, high = interval_of_mean(values, clusters)
    assert (low + high) / 2 == pytest.approx(interquartile_mean(values))
    half = stats.t.ppf(0.975, freedom) * (seeds / freedom) ** 0.5 * drawn_anew(passes)
    assert (high - low) / 2 == pytest.approx(half, rel=0.07)
    shuffled = random.permutation(len(values))
    again = interval_of_mean(values[shuffled], Clusters(clusters.line[shuffled], clusters.seed[shuffled]))
    assert again == pytest.approx((low, high))


def test_interval_is_missing_where_nothing_is_known():
    assert interval_of_mean(np.array([2.0, 2.0, 2.1]), Clusters.of_one_line(3)) is not None
    for nothing in ([1.0], [2.0, 2.0, 2.0], [1.0, np.nan]):
        assert interval_of_mean(np.array(nothing), Clusters.of_one_line(len(nothing))) is None
    assert interval_of_mean(np.array([1.0, 2.0, 3.0]), Clusters.of_one_line(1, 3)) is None
    assert interval_of_mean(np.array([0.1, 0.2, 0.1, 0.2]), Clusters.of_one_line(2, 2)) is None
    assert share_of(np.array([[[True, False]]]), Clusters.of_one_line(1, 2)).interval is None


def test_trainings_alone_have_the_t_interval_of_their_means():
    """Seeds that make no difference: what is left is between trainings."""
    means = np.array([-20.0, -26.0, -23.0, -24.0, -22.0])
    values = means[:, None] + np.tile([0.0, 1.0, -3.0, 2.0], 6)
    shift = interquartile_mean(values[0]) - means[0]
    expected = stats.t.interval(0.95, 4, loc=means.mean() + shift, scale=stats.sem(means))
    assert interval_of_mean(values, Clusters.of_one_line(6, 4)) == pytest.approx(expected)


def test_a_share_of_independent_passes_has_wilson_s_interval():
    wins = np.arange(1000) % 10 < 3
    found = share_of(wins[None, None], Clusters.of_one_line(1000))
    expected = stats.binomtest(300, 1000).proportion_ci(method="wilson")
    assert found.share == 0.3
    assert found.interval == pytest.approx((expected.low, expected.high), rel=0.02)
    assert str(found) == "30 % (27 to 33)"


def test_a_share_knows_no_more_from_passes_that_a_seed_decides():
    wins = np.array([True, True, False, True, False, True, True, True])
    single = share_of(wins[None, None], Clusters.of_one_line(8))
    fivefold = share_of(np.repeat(wins, 5)[None, None], Clusters.of_one_line(8, 5))
    assert fivefold.interval == pytest.approx(single.interval)


def test_all_passes_won_leave_room_for_doubt():
    few, many = (share_of(np.full((1, 1, 5 * n), True), Clusters.of_one_line(n, 5)) for n in (4, 16))
    assert few.interval[1] == many.interval[1] == 1.0
    assert 0.4 < few.interval[0] < 0.7 < many.interval[0] < 0.95


def test_a_share_s_interval_covers_that_trainings_differ():
    wins = np.zeros((5, 1, 40), dtype=bool)
    wins[:2] = True  # two of five trainings win always, the others never
    low, high = share_of(wins, Clusters.of_one_line(8, 5)).interval
    assert low < 0.1
    assert high > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("seeds", "speeds", "repetitions"), [(8, 1, 2500), (16, 5, 1200)])
def test_intervals_cover_the_truth_in_95_percent_of_draws(kind, seeds, speeds, repetitions):
    assert 93 <= coverage("mean", kind, seeds, speeds, repetitions) <= 97


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_intervals_of_shares_cover_the_truth_in_95_percent_of_draws(kind):
    assert 93 <= coverage("share of 0.7", kind, 8, 5, repetitions=2500) <= 98


@pytest.mark.slow
def test_the_interval_of_a_method_covers_the_truth():
    assert 93 <= coverage("mean of 5 trainings", "normal", 16, 5, repetitions=500) <= 97


@pytest.mark.longer
def test_a_bootstrap_of_each_cell_by_itself_covers_far_less():
    """So that the simulation has the power to show what is wrong."""
    assert coverage("mean, by cell", "normal", 8, 5, repetitions=200) < 85
