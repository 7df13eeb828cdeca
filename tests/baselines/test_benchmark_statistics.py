"""The benchmark's statistics on passes made up by hand: means, paired intervals, who is ranked and how."""

from dataclasses import fields, replace

import numpy as np
import pytest

from panto_baselines.benchmark import statistics
from panto_baselines.benchmark.overall import standings
from panto_baselines.benchmark.single_pass import Row
from panto_env.metrics.figures import Figures

ONES = Figures(*[1.0] * len(fields(Figures)))


def row(policy="passive", seed=0, *, line="line", speed_kmh=300.0, pressed=(1.0, 1.0), **given):
    """A pass with these figures, under a nominal force of 120 N; pressed: σ and CF of the pressed passive."""
    terminated, rate = given.pop("terminated", False), given.pop("action_rate", 0.0)
    power, saturation = given.pop("power", 0.0), given.pop("saturation", 0.0)
    figures = replace(ONES, **{"mean": 110.0} | given)
    own = (figures.std, figures.cost_function) if policy == "passive" else pressed
    place = (policy, line, "pantograph", speed_kmh, seed, 120.0, terminated)
    return Row(*place, figures, rate, saturation, power, *own)


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


def test_the_mean_force_may_move_by_a_little():
    assert statistics.mean_range(100.0) == pytest.approx((98.5, 101.5))


def test_the_qualified_are_ranked_by_sigma_and_the_others_are_not():
    cells = statistics.compare(
        [
            row(mean=110.0),
            row("pressing less", mean=108.3, std=0.1),
            row("just enough", mean=108.4, std=0.9),
            row("as much as allowed", mean=111.6, std=0.8),
            row("pressing more", mean=111.7, std=0.1),
            row("off the wire", mean=np.nan, std=np.nan, terminated=True),
            row("not to be pressed to", std=0.1, pressed=(np.nan, np.nan)),
        ]
    )
    assert [cell.rank for cell in cells] == [3, None, 2, 1, None, None, None]
    assert cells[1].disqualified == "it moves the mean force by -1.5 %, more than 1.5 %"
    assert "1 of 1 runs ended early" in cells[5].disqualified
    assert "no passive pantograph can reach its mean force" in cells[6].disqualified
    assert cells[0].disqualified == ""


def test_equal_changes_share_a_rank():
    cells = statistics.compare([row(), row("a", std=0.5), row("b", std=0.5)])
    assert [cell.rank for cell in cells] == [3, 1, 1]


def test_changes_are_against_the_passive_pantograph_pressed_to_the_same_mean():
    """Sigma falls because the mean does: held against a passive one pressed as little, it rises."""
    cells = statistics.compare(
        [
            row(mean=110.0, std=30.0, cost_function=50.0),
            row("a", mean=109.0, std=29.7, cost_function=60.0, pressed=(27.0, 40.0)),
        ]
    )
    assert cells[1].change == pytest.approx(10.0)
    assert cells[1].cost_change == pytest.approx(50.0)
    assert cells[1].mean_change == pytest.approx(-100 / 110)
    assert (cells[1].improved, cells[0].improved) == (0.0, 0.0)


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
    """Each seed's line is easier or harder for both: what differs is 10 % throughout, but for a little."""
    sigma, noise = np.array([30.0, 40.0, 60.0, 50.0]), np.array([0.0, 0.01, -0.01, 0.0])
    rows = [row(seed=k, std=sigma[k]) for k in range(4)]
    rows += [row("a", k, std=sigma[k] * (0.9 + noise[k]), pressed=(sigma[k], 1.0)) for k in range(4)]
    passive, active = statistics.compare(rows)
    assert active.change == pytest.approx(-10.0)
    low, high = active.interval
    assert -11.01 < low < -10.0 < high < -8.99
    assert (passive.change, passive.interval) == (0.0, None)
    assert (active.seeds, active.improved) == (4, 1.0)
    assert passive.spread == pytest.approx(100 * sigma.std(ddof=1) / sigma.mean())


def test_change_of_the_mean_is_paired_by_seed():
    rows = [row(mean=100.0), row(seed=1, mean=200.0), row("a", mean=101.0), row("a", 1, mean=202.0)]
    assert statistics.compare(rows)[1].mean_change == pytest.approx(1.0)


def test_figures_are_interquartile_means_over_the_seeds_of_one_speed():
    rows = [row(seed=k, std=std, action_rate=2 * std) for k, std in enumerate([0.0, 1.0, 3.0, 100.0])]
    rows.append(row(speed_kmh=200.0, std=7.0))
    fast, slow = statistics.compare(rows)
    assert (fast.speed_kmh, fast.figures["std"], fast.figures["action_rate"]) == (300.0, 2.0, 4.0)
    assert (slow.speed_kmh, slow.figures["std"], slow.seeds) == (200.0, 7.0, 1)


def two_cells(policy, easy, hard):
    """Passes of a policy on two lines with these ratios of sigma, one a seed."""
    return [row(policy, k, std=x, line="easy") for k, x in enumerate(easy)] + [
        row(policy, k, std=x, line="hard") for k, x in enumerate(hard)
    ]


def test_standings_are_over_all_cells():
    rows = two_cells("passive", [1.0, 1.0], [1.0, 1.0])
    rows += two_cells("a", [0.5, 0.6], [0.9, 1.2]) + two_cells("b", [0.7, 0.7], [0.8, 0.9])
    rows += [row("on one line alone", k, line="easy", std=0.1) for k in range(2)]
    found = {each.policy: each for each in standings(rows, statistics.compare(rows))}
    assert list(found) == ["passive", "a", "b"]
    a, b = found["a"], found["b"]
    assert a.change == pytest.approx(100 * (np.mean([0.6, 0.9]) - 1))  # without the best and the worst
    assert (a.worst, a.worst_at) == (pytest.approx(5.0), "hard, 300 km/h")
    assert (a.improved, b.improved) == (0.75, 1.0)
    assert a.better_than == {"passive": 0.75, "b": 0.5}
    assert b.better_than["a"] == 0.5
    assert [found[name].rank for name in ("passive", "a", "b")] == [3, 1, 1]
    low, high = a.interval
    assert low < a.change < high
    assert found["passive"].interval is None


def test_a_standing_s_effort_power_and_saturation_are_means_of_the_cells():
    """Of figures that all differ, with other numbers of passes per cell."""
    names, random = ("effort", "power", "saturation"), np.random.default_rng(0)
    easy, hard = random.uniform(0.1, 0.9, (2, 3)), random.uniform(0.1, 0.9, (1, 3))
    rows = [
        row(name, k, line=line, **dict(zip(names, values, strict=True)))
        for name in ("passive", "a")
        for line, passes in (("easy", easy), ("hard", hard))
        for k, values in enumerate(passes)
    ]
    _, found = standings(rows, statistics.compare(rows))
    expected = (easy.mean(axis=0) + hard[0]) / 2
    assert (found.effort, found.power, found.saturation) == pytest.approx(tuple(expected))


def test_who_does_not_qualify_in_one_cell_has_no_standing():
    rows = two_cells("passive", [1.0], [1.0])
    rows += [row("a", std=0.5, line="easy"), row("a", std=0.5, line="hard", mean=100.0)]
    passive, a = standings(rows, statistics.compare(rows))
    assert (passive.rank, a.rank) == (1, None)
    assert a.disqualified.startswith("hard at 300 km/h: it moves the mean force by -9.1 %")


def test_share_of_a_stored_oracle():
    rows = [
        row(line="easy"),
        row(line="hard"),
        row("a", line="easy", std=0.8),
        row("a", line="hard", std=0.9),
    ]
    cells = statistics.compare(rows, {("easy", "pantograph", 300.0): -40.0})
    found = {(cell.policy, cell.catenary): cell.oracle_share for cell in cells}
    assert found["a", "easy"] == pytest.approx(0.5)
    assert found["passive", "easy"] == 0.0
    assert found["a", "hard"] is None
    assert [each.oracle_share for each in standings(rows, cells)] == [None, None]
    both = {(line, "pantograph", 300.0): -40.0 for line in ("easy", "hard")}
    assert standings(rows, statistics.compare(rows, both))[1].oracle_share == pytest.approx(0.375)
