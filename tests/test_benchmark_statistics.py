"""The benchmark's statistics on passes made up by hand: means, paired intervals, who is ranked and how."""

from dataclasses import fields, replace

import numpy as np
import pytest

from panto_baselines.benchmark import statistics
from panto_baselines.benchmark.single_pass import Row
from panto_env.metrics.figures import Figures

ONES = Figures(*[1.0] * len(fields(Figures)))


def row(policy="passive", seed=0, *, terminated=False, speed_kmh=300.0, action_rate=0.0, **figures):
    """A pass with these figures, under a nominal force of 120 N."""
    figures = replace(ONES, **{"mean": 110.0} | figures)
    return Row(policy, "line", "pantograph", speed_kmh, seed, 120.0, terminated, figures, action_rate)


def test_interquartile_mean_leaves_out_the_ends():
    assert statistics.interquartile_mean(np.array([0.0, 1.0, 3.0, 100.0])) == 2
    assert statistics.interquartile_mean(np.array([1.0, 3.0, 8.0])) == 4
    assert np.isnan(statistics.interquartile_mean(np.array([1.0, 3.0, np.nan, 3.0, 3.0])))


def test_interval_is_that_of_resampled_interquartile_means():
    """Against a bootstrap written out with other random numbers."""
    values = np.random.default_rng(3).exponential(1.0, 12)  # skewed: mean and trimmed mean differ
    draws = np.random.default_rng(4).choice(values, (100_000, 12))
    means = np.sort(draws)[:, 3:9].mean(axis=1)
    expected = np.quantile(means, [0.025, 0.975])
    assert statistics.bootstrap_interval(values) == pytest.approx(tuple(expected), rel=0.03)
    # Wide enough apart to tell a confidence of 95 % from one of 90 %.
    assert np.quantile(means, 0.95) < 0.95 * expected[1]


def test_interval_repeats_and_is_missing_where_nothing_is_known():
    values = np.random.default_rng(3).normal(5.0, 1.0, 40)
    low, high = statistics.bootstrap_interval(values)
    assert low < 5 < high
    assert statistics.bootstrap_interval(values) == (low, high)
    for nothing in ([1.0], [2.0, 2.0, 2.0], [1.0, np.nan]):
        assert statistics.bootstrap_interval(np.array(nothing)) is None


def test_mean_force_lies_between_passive_and_nominal_widened():
    assert statistics.mean_range(44.0, 54.0) == pytest.approx((0.975 * 44, 1.025 * 54))
    assert statistics.mean_range(130.0, 120.0) == pytest.approx((0.975 * 120, 1.025 * 130))


def test_the_qualified_are_ranked_by_cost_and_the_others_are_not():
    cells = statistics.compare(
        [
            row(mean=110.0, cost_function=9.0),
            row("pressing less", mean=107.0, cost_function=1.0),
            row("just enough", mean=107.5, cost_function=8.0),
            row("as much as allowed", mean=122.9, cost_function=7.0),
            row("pressing more", mean=123.1, cost_function=2.0),
            row("off the wire", mean=np.nan, cost_function=np.nan, terminated=True),
        ]
    )
    assert [cell.rank for cell in cells] == [3, None, 2, 1, None, None]
    assert "107.0 N, outside 107.2 to 123.0 N" in cells[1].disqualified
    assert "1 of 1 runs ended early" in cells[5].disqualified
    assert cells[0].disqualified == ""


def test_equal_costs_share_a_rank():
    costs = {"passive": 3.0, "a": 2.0, "b": 2.0}
    cells = statistics.compare([row(policy, cost_function=cost) for policy, cost in costs.items()])
    assert [cell.rank for cell in cells] == [3, 1, 1]


def test_one_run_that_ends_early_disqualifies_whatever_its_figures():
    rows = [row(seed=0), row(seed=1), row("a", 0), row("a", 1, terminated=True)]
    _, cell = statistics.compare(rows)
    assert cell.rank is None
    assert cell.disqualified == "1 of 2 runs ended early, outside the plant's range"


def test_nothing_is_ranked_where_the_passive_pantograph_ends_early():
    rows = [row(terminated=True, mean=np.nan, cost_function=np.nan), row("a", mean=120.0)]
    passive, active = statistics.compare(rows)
    assert (passive.rank, active.rank) == (None, None)
    assert "the passive pantograph's runs ended early" in active.disqualified


def test_change_of_sigma_is_paired_by_seed():
    """Each seed's line is easier or harder for both: what differs is 1 N throughout, but for a little."""
    harder, noise = np.array([0.0, 10.0, 30.0, 20.0]), np.array([0.0, 0.1, -0.1, 0.0])
    rows = [row(seed=k, std=30 + harder[k]) for k in range(4)]
    rows += [row("a", k, std=29 + harder[k] + noise[k]) for k in range(4)]
    passive, active = statistics.compare(rows)
    assert active.std_change == pytest.approx(-1.0)
    low, high = active.std_interval
    assert -1.11 < low < -1.0 < high < -0.89
    assert (passive.std_change, passive.std_interval) == (0.0, None)
    assert active.seeds == 4


def test_figures_are_interquartile_means_over_the_seeds_of_one_speed():
    rows = [row(seed=k, std=std, action_rate=2 * std) for k, std in enumerate([0.0, 1.0, 3.0, 100.0])]
    rows.append(row(speed_kmh=200.0, std=7.0))
    fast, slow = statistics.compare(rows)
    assert (fast.speed_kmh, fast.figures["std"], fast.figures["action_rate"]) == (300.0, 2.0, 4.0)
    assert (slow.speed_kmh, slow.figures["std"], slow.seeds) == (200.0, 7.0, 1)
