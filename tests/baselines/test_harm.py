"""Harm and the late window: what they count, and cheap policies that try to win by one window alone."""

import math
from dataclasses import replace

import numpy as np
import pytest

from panto_baselines.benchmark import run as benchmark
from panto_baselines.benchmark.harm import Harm, harm_of, window_changes
from panto_baselines.benchmark.overall import standings
from panto_baselines.benchmark.report import harm_table, kilometre_tables, margins_table
from panto_baselines.benchmark.run import evaluated_windows
from panto_baselines.benchmark.settings import BenchmarkSettings, Line, Windows, load_benchmark
from panto_baselines.benchmark.statistics import compare
from panto_env import InputError, simulate
from panto_env.base.settings import parse

from .test_benchmark_statistics import row


def passes(policy, early, late=None, line="line", **given):
    """A pass for each σ, early and late; the passive pantograph has 1 in both."""
    return [
        replace(
            row(policy, seed, line=line, std=own, **given),
            late=late and row(policy, seed, line=line, std=late[seed]),
        )
        for seed, own in enumerate(early)
    ]


def judged(early, late=None, **given):
    """Cell and standing of a policy beside the passive pantograph."""
    ones = [1.0] * len(early)
    rows = [*passes("passive", ones, late and ones), *passes("a", early, late, **given)]
    cells = compare(rows)
    return cells[1], standings(rows, cells)[1]


def test_a_pass_has_the_mean_of_its_windows_and_the_rank_follows_it():
    cell, standing = judged([0.5, 0.6], [0.7, 0.6])
    assert window_changes(passes("a", [0.5, 0.6], [0.7, 0.6])) == pytest.approx(
        np.array([[-0.5, -0.4], [-0.3, -0.4]])
    )
    assert (cell.change, cell.early, cell.late) == pytest.approx((-40, -45, -35))
    assert (standing.change, standing.early, standing.late) == pytest.approx((-40, -45, -35))
    alone, _ = judged([0.5, 0.6])
    assert (alone.change, alone.early, alone.late) == (pytest.approx(-45), pytest.approx(-45), None)


def test_one_pass_far_above_passive_takes_the_rank_in_either_window():
    """An interquartile mean would not show it."""
    for early, late in (([0.5] * 7 + [1.11], [0.5] * 8), ([0.5] * 8, [0.5] * 7 + [1.11])):
        cell, standing = judged(early, late)
        assert standing.rank is None
        assert "it changes σ by +11.0 % in one pass (seed 7" in cell.disqualified
        assert cell.harm.sigma == 1
    cell, standing = judged([0.5] * 7 + [1.09], [0.5] * 8)
    assert standing.rank == 1
    assert cell.harm.worst == pytest.approx(9)


def test_a_change_that_grows_along_the_line_takes_the_rank():
    cell, standing = judged([0.5] * 4, [0.61] * 4)
    assert standing.rank is None
    assert "grows along the line by 11.0 points, from -50.0 % to -39.0 %" in cell.disqualified
    assert judged([0.5] * 4, [0.59] * 4)[1].rank == 1
    assert judged([0.61] * 4, [0.5] * 4)[1].rank == 1  # it learns


def test_contact_lost_where_the_passive_pantograph_keeps_it_takes_the_rank():
    kept, lost = row(contact_loss=0.0), row(contact_loss=0.2)
    for passive, own, ranked in (
        (kept, kept, True),
        (kept, lost, False),
        (lost, lost, True),
        (lost, kept, True),
    ):
        rows = [passive, replace(own, policy="a", figures=replace(own.figures, std=0.5))]
        cells = compare(rows)
        assert (standings(rows, cells)[1].rank is not None) == ranked
        assert cells[1].harm.lost == (not ranked)


def test_passes_with_more_loss_are_counted():
    passive = [row(seed=seed, contact_loss=0.2) for seed in range(4)]
    own = [row("a", seed, contact_loss=loss) for seed, loss in enumerate((0.2, 0.9, 0.0, 0.5))]
    harm = harm_of(own, passive)
    assert (harm.loss, harm.lost) == (2, 0)


def test_minimum_and_uplift_are_counted_with_the_worst():
    passive = [row(seed=seed, min=50.0, max_uplift=0.05) for seed in range(3)]
    own = [
        row("a", seed, min=low, max_uplift=up)
        for seed, low, up in ((0, 49.5, 0.0502), (1, 45.0, 0.053), (2, 60.0, 0.04))
    ]
    harm = harm_of(own, passive)
    assert (harm.minimum, harm.uplift, harm.passes) == (1, 1, 3)
    assert (harm.lowest_minimum, harm.most_uplift) == pytest.approx((5.0, 0.003))
    rows = [*passive, *own]
    table = harm_table("track", standings(rows, compare(rows)))
    assert table.cells[0][-3:] == ("1 (5 N)", "1 (3 mm)", "3")


def test_harm_passes_over_what_has_no_figure():
    """A pass whose early mean no passive pantograph has, and one that ended early."""
    late = row("a", 0, std=1.2, min=40.0)
    nowhere = replace(late, pressed_std=math.nan, late=late)
    harm = harm_of([nowhere], [replace(row(min=50.0), late=row(min=50.0))])
    assert (harm.sigma, harm.worst) == (1, pytest.approx(20))
    ended = harm_of([row("a", std=math.nan, min=math.nan)], [row(min=50.0)])
    for parts in (("a", harm), ("b", ended)), (("b", ended), ("a", harm)):
        assert Harm.over(parts).lowest_minimum == pytest.approx(10.0)


LATE = {"late_spans": (30, 32), "policies": ["passive"], "seeds": 1}


def asked(**given):
    return parse(BenchmarkSettings, LATE | given, "the benchmark")


@pytest.mark.longer
def test_both_windows_are_those_of_one_pass_and_the_passive_run_of_the_early_one_may_end_with_it():
    given = asked(lines=[{"speeds_kmh": [280]}], line_condition="as-built", policies=["p:gain=0.3"])
    done = benchmark.run(given, workers=1)
    assert done.windows == (Windows((10, 19), (30, 32)),)
    passive, found = done.rows
    line = {"speed_kmh": 280, "spans": 44, "line_condition": "as-built", "record_droppers": False}
    run = simulate(**line)
    assert passive.figures == run.summary((10, 19))
    assert passive.late.figures == run.summary((30, 32))
    assert passive.as_dict()["late_std"] == passive.late.figures.std
    whole = simulate(**line, mean_force=found.figures.mean, trimmed_over=(10, 19))
    assert found.pressed_std == whole.summary((10, 19)).std


def test_a_line_that_ends_before_has_one_window():
    given = asked(lines=[{"catenary": "sweden-st15-bridge", "pantograph": "dsa250", "speeds_kmh": [160]}])
    assert evaluated_windows(given, given.lines[0]).late is None
    early = asked(late_spans=(15, 20))
    with pytest.raises(InputError, match="late_spans must come after spans 10 to 19"):
        evaluated_windows(early, Line())


@pytest.mark.slow
def test_tracks_of_lines_that_nobody_fitted_have_two_windows():
    for track in ("any-line", "unknown-line", "train-both", "train-trailing", "long"):
        assert load_benchmark(f"benchmark/{track}").late_spans == (101, 110)


@pytest.mark.slow
def test_a_case_changes_the_runs_of_its_line_and_keeps_its_rows_apart():
    line = {"catenary": "en50318-2002", "speeds_kmh": [280], "distance": 900.0, "spans": (5, 12)}
    cases = [line, line | {"case": "weak", "run": {"faults": "actuator-weak"}}]
    slow = line | {"case": "slow", "run": {"speed_profile": "place:0=280,500=240"}, "distance": 900.0}
    given = asked(policies=["pd:washout=1"], lines=[*cases, slow], late_spans=None)
    done = benchmark.run(given, workers=1)
    assert [cell.case for cell in done.cells] == ["", "", "weak", "weak", "slow", "slow"]
    assert [cell.place.name for cell in done.cells[::2]] == [
        "en50318-2002 on en50318-2002",
        "en50318-2002 on en50318-2002, weak",
        "en50318-2002 on en50318-2002, slow",
    ]
    passive, full, alike, weak, slower, _ = (row.figures for row in done.rows)
    assert passive == alike != slower
    assert weak.effort == pytest.approx(0.5 * full.effort, rel=0.1)
    own = {"policy": "pd:washout=1", "faults": "actuator-weak", "line_condition": "smooth", "speed_kmh": 280}
    assert weak == simulate(**own, distance=900.0).summary((5, 12))


@pytest.mark.parametrize("run", [{"speed_kmh": 200}, {"catenary": "re330"}, {"wind": 3}, {"spans": 50}])
def test_a_case_changes_no_setting_that_names_its_row(run):
    with pytest.raises(InputError, match="which is no setting that a case may change"):
        asked(lines=[{"case": "a", "run": run}])


@pytest.mark.slow
def test_kilometres_are_compared_one_by_one():
    line = {"speeds_kmh": [280], "distance": 2900.0, "case": "long"}
    given = asked(policies=["pd:washout=1"], lines=[line], late_spans=None, by_kilometre=True)
    done = benchmark.run(given, workers=1)
    passive, active = done.rows
    assert passive.kilometres == (0.0, 0.0)
    assert len(active.kilometres) == 2
    assert np.mean(active.kilometres) == pytest.approx(active.figures.std / active.pressed_std - 1, abs=0.02)
    assert done.rows[1].as_dict()["km_2"] == active.kilometres[1]
    (table,) = kilometre_tables("track", done.cells)
    assert table.cells == [("pd:washout=1", *(f"{100 * change:.0f}" for change in active.kilometres))]


def test_margins_are_where_a_policy_meets_the_passive_pantograph():
    sweeps = {"none": {"delay (ms)": 0, "gain": 1}, "a": {"delay (ms)": 20}, "b": {"delay (ms)": 40}}
    lines = [{"case": case, "sweep": own} for case, own in (sweeps | {"c": {"gain": 2}}).items()]
    lines.append({"case": "d"})
    stds = {"none": 0.8, "a": 0.9, "b": 1.05, "c": 0.9, "d": 2.0}
    rows = [
        replace(row(name, std=std), case=case)
        for case, own in stds.items()
        for name, std in (("passive", 1), ("p", own))
    ]
    table = margins_table("track", lines, compare(rows))
    assert table.headings == ("policy", "delay (ms)", "gain")
    assert table.cells == [("p", f"{20 + 20 * 10 / 15:.3g}", "> 2")]
    assert margins_table("track", [{"case": "d"}], compare(rows)) is None


@pytest.mark.parametrize(
    ("stds", "shown"),
    [((0.6, 0.8, math.nan), "–"), ((0.6, math.nan, 1.3), "–"), ((1.5, 0.9, 0.9), "0"), ((0.6, 0.8), "> 20")],
)
def test_a_margin_needs_a_figure_of_every_case(stds, shown):
    lines = [{"case": f"{k}", "sweep": {"delay (ms)": 20 * k}} for k in range(len(stds))]
    rows = [
        replace(row(name, std=own), case=f"{k}")
        for k, std in enumerate(stds)
        for name, own in (("passive", 1), ("p", std))
    ]
    assert margins_table("track", lines, compare(rows)).cells == [("p", shown)]


CHEATS = '''
import numpy as np
from panto_baselines.policies.repetitive import Repetitive

class Early(Repetitive):
    """Acts up to the end of the early window only."""
    def reset(self, context):
        super().reset(context)
        self.step = 0
    def acts(self, step):
        return step < 1460
    def act(self, observation):
        self.step += 1
        action = super().act(observation)
        return action if self.acts(self.step) else np.zeros_like(action)

class Late(Early):
    """Acts from the late window on only."""
    def acts(self, step):
        return step > 2100
'''


@pytest.mark.slow
def test_who_acts_in_one_window_alone_is_not_ranked_or_loses(tmp_path):
    """At 280 km/h a span of 60 m takes 77 control steps."""
    file = tmp_path / "cheats.py"
    file.write_text(CHEATS)
    given = asked(
        policies=["repetitive", f"{file}:Early", f"{file}:Late"],
        lines=[{"speeds_kmh": [280]}],
        seeds=2,
        line_condition="as-built",
        late_spans=(30, 39),
    )
    _, honest, early, late = benchmark.run(given).standings
    assert honest.rank == 1
    assert early.rank is None
    assert "grows along the line" in early.disqualified
    assert early.early == pytest.approx(honest.early, abs=1.0)
    assert late.change > honest.change + 5
    assert late.early == pytest.approx(0, abs=0.5)
