"""The benchmark's cells and standings of passes made up by hand: means, pairs, who is ranked and how."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy import stats

from panto_baselines.benchmark import statistics
from panto_baselines.benchmark.overall import standings, without_feedback
from panto_baselines.benchmark.settings import LineAtSpeed
from panto_baselines.benchmark.single_pass import Row
from panto_baselines.benchmark.statistics import Clusters, interval_for_lines, interval_of_mean
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
    advice = "a policy's attribute washout = 1.0 keeps the mean"
    assert cells[1].disqualified == f"it moves the mean force by -1.55 %, more than 1.5 % ({advice})"
    assert "1 of 1 runs ended early" in cells[5].disqualified
    assert "no passive pantograph can reach its mean force" in cells[6].disqualified
    assert cells[0].disqualified == ""


def moved(policy, changes):
    """Passes of a policy that moves the mean force by these shares, one per seed, with half of sigma."""
    return [row(policy, seed, mean=110 * (1 + change), std=0.5) for seed, change in enumerate(changes)]


def judged(changes):
    """Cell and standing of a policy that moves the mean force by these shares on one line at one speed."""
    rows = [*moved("passive", np.zeros(len(changes))), *moved("a", changes)]
    cells = statistics.compare(rows)
    return cells[1], standings(rows, cells)[1]


def test_a_policy_that_presses_in_one_pass_of_four_is_not_ranked():
    """The interquartile mean of its passes does not move at all."""
    for repeated in (1, 4):
        cell, standing = judged(repeated * [0.0, 0.2, 0.0, 0.0])
        assert (cell.mean_change, cell.rank, standing.rank) == (0.0, None, None)
        assert cell.disqualified.startswith("it moves the mean force by +20.0 % in one pass, more than 5 % (")
    cell, standing = judged([0.0] * 30 + [-0.0501])  # and however seldom it does
    assert (cell.rank, standing.rank) == (None, None)
    cell, standing = judged([0.0] * 30 + [-0.0499])
    assert (cell.rank, standing.rank, cell.most_moved) == (1, 1, pytest.approx(-4.99))


def test_a_policy_that_moves_the_mean_a_little_too_far_in_a_third_of_passes_is_not_ranked():
    cell, standing = judged([0.016, -0.016, 0.016, -0.016] + [0.0149] * 8)
    assert (cell.disqualified, cell.moved, standing.moved, standing.passes) == ("", 4, 4, 12)
    assert standing.rank is None
    assert standing.disqualified == (
        "it moves the mean force by more than 1.5 % in 4 of 12 passes, a third of them or more "
        "(a policy's attribute washout = 1.0 keeps the mean)"
    )
    _, standing = judged([0.016, -0.016, 0.016] + [0.0149] * 9)
    assert (standing.rank, standing.moved) == (1, 3)


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
    assert -12.0 < low < -10.0 < high < -8.0
    assert (passive.change, passive.interval) == (0.0, None)
    assert (active.seeds, active.improved) == (4, 1.0)
    assert passive.spread == pytest.approx(100 * sigma.std(ddof=1) / sigma.mean())


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
    assert {name: one.share for name, one in a.better_than.items()} == {"passive": 0.75, "b": 0.5}
    assert b.better_than["a"].share == 0.5
    costs = [cell.cost_change for cell in statistics.compare(rows) if cell.policy == "a"]
    assert a.cost_change == pytest.approx(np.mean(costs))
    assert a.contact_loss == ONES.contact_loss
    assert (a.worst_quarter, b.worst_quarter) == (pytest.approx(20.0), pytest.approx(-10.0))
    assert [found[name].rank for name in ("passive", "a", "b")] == [2, None, 1]
    assert "hard at 300 km/h: it changes σ by +20.0 % in one pass (seed 1)" in a.disqualified
    low, high = a.interval
    assert low < a.change < high
    assert found["passive"].interval is None


def test_a_pass_that_ended_early_is_lost_against_one_that_did_not():
    rows = [row("passive", k) for k in range(4)]
    rows += [row("a", k, std=0.5) for k in range(4)] + [row("b", k, std=math.nan) for k in range(4)]
    found = {each.policy: each for each in standings(rows, statistics.compare(rows))}
    assert found["a"].better_than["b"].share == 1.0
    assert found["b"].better_than["a"].share == 0.0


def test_two_pantographs_on_a_line_are_no_two_lines():
    """Their seeds draw the same line, so their passes say no more of other lines."""
    random = np.random.default_rng(1)
    own = random.uniform(0.4, 0.9, 8)
    widths = []
    for names in (("p",), ("p", "q")):
        rows = [
            replace(row(policy, k, std=std), pantograph=name)
            for name in names
            for policy, stds in (("passive", np.ones(8)), ("a", own))
            for k, std in enumerate(stds)
        ]
        widths.append(np.ptp(standings(rows, statistics.compare(rows))[1].interval))
    assert widths[1] == pytest.approx(widths[0], rel=0.05)


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


def test_share_of_a_stored_oracle():
    rows = [
        row(line="easy"),
        row(line="hard"),
        row("a", line="easy", std=0.8),
        row("a", line="hard", std=0.9),
    ]
    cells = statistics.compare(rows, {LineAtSpeed("easy", "pantograph", 300.0): {0: -40.0}})
    found = {(cell.policy, cell.catenary): cell.oracle_share for cell in cells}
    assert found["a", "easy"] == pytest.approx(0.5)
    assert found["passive", "easy"] == 0.0
    assert found["a", "hard"] is None
    assert [each.oracle_share for each in standings(rows, cells)] == [None, None]
    both = {LineAtSpeed(line, "pantograph", 300.0): {0: -40.0} for line in ("easy", "hard")}
    assert standings(rows, statistics.compare(rows, both))[1].oracle_share == pytest.approx(0.375)


def test_the_share_of_an_oracle_is_over_the_passes_that_it_ran():
    """The third seed, where the policy is at its worst, was not the oracle's."""
    rows = [row(seed=k, line="easy") for k in range(3)]
    rows += [row("a", k, line="easy", std=std) for k, std in enumerate((0.8, 0.6, 2.0))]
    place = LineAtSpeed("easy", "pantograph", 300.0)
    found = statistics.compare(rows, {place: {0: -40.0, 1: -60.0, 7: -99.0}})[1]
    assert found.oracle_share == pytest.approx(30 / 50)
    assert found.oracle == pytest.approx(-50.0)
    elsewhere = statistics.compare(rows, {place: {7: -99.0}})[1]
    assert (elsewhere.oracle, elsewhere.oracle_share) == (None, None)


def test_an_interval_for_other_lines_is_that_of_the_lines_means():
    changes = np.array([-0.6, -0.58, -0.5, -0.52, -0.4, -0.42])
    clusters = Clusters(np.repeat(np.arange(3), 2), np.tile(np.arange(2), 3))
    low, high = interval_for_lines(changes, clusters)
    half = stats.t.ppf(0.975, 2) * stats.sem([-0.59, -0.51, -0.41])
    middle = np.mean([-0.58, -0.52, -0.5, -0.42])
    assert (low, high) == pytest.approx((middle - half, middle + half))
    within = interval_of_mean(changes, clusters)
    assert high - low > 3 * (within[1] - within[0])
    assert interval_for_lines(changes[:4], Clusters(clusters.line[:4], clusters.seed[:4])) is None


def test_a_method_s_result_is_over_its_trainings():
    trainings = {"1": ([0.5, 0.6], [0.9, 0.8]), "2": ([0.4, 0.5], [0.8, 0.7]), "3": ([0.6, 0.7], [1.0, 0.9])}
    rows = two_cells("passive", [1.0, 1.0], [1.0, 1.0]) + two_cells("other", [0.5, 0.6], [0.9, 0.8])
    rows += [each for name, passes in trainings.items() for each in two_cells(name, *passes)]
    cells = statistics.compare(rows)
    found = {each.policy: each for each in standings(rows, cells, {"method": tuple(trainings)})}
    method, other = found["method"], found["other"]
    assert list(found) == ["passive", "other", "1", "2", "3", "method"]
    assert method.trainings == pytest.approx({"1": -30.0, "2": -40.0, "3": -20.0})
    assert method.change == pytest.approx(-30.0)
    assert (method.worst, method.worst_at) == (pytest.approx(-5.0), "hard, 300 km/h")
    assert method.worst_quarter == pytest.approx((-10 - 20 + 0) / 3)
    assert (method.passes, method.moved) == (12, 0)
    assert [found[name].rank for name in found] == [3, 1, None, None, None, 1]
    # The second is better than the other in all passes, the first and the third in none; the first is equal.
    assert method.better_than["other"].share == pytest.approx(1 / 3)
    assert other.better_than["method"].share == pytest.approx(1 / 3)
    assert set(method.better_than) == {"passive", "other"}
    assert found["1"].better_than == {}


def test_a_method_s_interval_covers_that_trainings_differ():
    def width(*changes):
        rows = [row(seed=seed) for seed in range(8)]
        for name, change in enumerate(changes):
            rows += [row(str(name), seed, std=1 + (change + 0.1 * (seed % 4)) / 100) for seed in range(8)]
        names = tuple(map(str, range(len(changes))))
        return np.ptp(standings(rows, statistics.compare(rows), {"method": names})[-1].interval)

    assert width(-30.0, -30.0, -30.0) < 0.3
    assert width(-40.0, -30.0, -20.0) == pytest.approx(2 * 4.303 * 10 / 3**0.5, rel=0.01)


def test_a_method_is_ranked_if_all_of_its_trainings_qualify():
    rows = [row(), row("1", std=0.5), row("2", std=0.5, mean=120.0)]
    *_, second, method = standings(rows, statistics.compare(rows), {"method": ("1", "2")})
    assert (second.rank, method.rank) == (None, None)
    assert method.disqualified == f"2: {second.disqualified}"


def test_a_track_on_which_a_tape_does_nearly_as_well_says_so():
    def words(**changes):
        rows = [row()] + [row(name, std=1 + change / 100) for name, change in changes.items()]
        return without_feedback(standings(rows, statistics.compare(rows)))

    tape, blind = "tape of the best", "blind of the best"
    assert words(best=-30.0, **{tape: -25.1}) == "needs no feedback: tape of the best -25.1 %, best -30.0 %"
    assert words(best=-30.0, **{tape: -35.0}) == "needs no feedback: tape of the best -35.0 %, best -30.0 %"
    assert words(best=-30.0, **{tape: -24.9}) == ""
    assert words(best=-30.0, **{blind: -30.0}) == ""
    assert words(best=-30.0) == ""
