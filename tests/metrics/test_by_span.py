"""Figures span by span, droppers one by one where spans differ, and figures of overlaps."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.metrics.by_span import by_span, by_stretch, moving_droppers
from panto_env.metrics.figures import chosen_spans
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import droppers, of_stretches
from panto_env.plant.alignment import Alignment
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import droppers_at_rest

from .test_compliance import by_key
from .test_summary import RUN, SPAN

LENGTHS = (50, 60, 55, 65, 45, 62, 50, 65, 60, 40, 60, 55, 64)


@pytest.fixture(scope="module")
def run():
    line = load_catenary("en50318-2002").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    spans = [{"span_length": length} for length in LENGTHS]
    return simulate(
        FlexibleCatenaryData.model_validate(line | {"sequence": spans}), "en50318-2002", 250, accuracy="fast"
    )


def test_each_span_has_its_own_figures(run):
    supports = np.append(0.0, np.cumsum(LENGTHS))
    force = low_pass(run.contact_force, run.time_step)
    found = by_span(run, (3, 12))
    assert [each.span for each in found] == list(range(3, 13))
    for each in found:
        begin, end = supports[each.span - 1], supports[each.span]
        own = force[(run.position >= begin) & (run.position < end)]
        assert (each.begin, each.length) == (begin, pytest.approx(end - begin))
        assert (each.mean, each.std, each.max, each.min) == (own.mean(), own.std(), own.max(), own.min())
        at = np.abs(run.support_position - begin).argmin()
        assert each.uplift == run.uplift[:, at].max() > 0.02
    assert [each.span for each in by_span(run, "all")] == list(range(1, 13))
    assert np.isnan(by_span(run, (1, 1))[0].uplift)  # an anchor
    assert max(each.max for each in by_span(run)) == run.summary().max


def test_each_dropper_has_a_row_with_what_it_is_at_rest(run):
    line = FlexibleCatenaryData.model_validate(run.design["catenary"])
    resting = {(each.span, each.number): each for each in droppers_at_rest(line)}
    found = moving_droppers(run, (3, 12))
    assert len(found) == sum(3 <= span <= 12 for span, _ in resting)
    sheet, inside = droppers([run], (3, 12)), run.inside((3, 12))
    rows = [dict(zip(sheet.columns, row, strict=True)) for row in zip(*sheet.columns.values(), strict=True)]
    for each, row in zip(found, rows, strict=True):
        rest = resting[row["span"], row["number"]]
        assert (rest.position, rest.length) == (pytest.approx(row["position"]), row["length"])
        place = sum(LENGTHS[: row["span"] - 1]) + row["position"]
        column = np.abs(run.dropper_position - place).argmin()
        assert each.largest == row["largest"] == run.dropper_force[inside, column].max()
        assert each.largest > rest.static_force
    assert len({row["length"] for row in rows}) > 20  # they are not those of one span


@pytest.mark.slow
def test_waves_from_the_line_s_end_change_figures_of_the_spans_that_are_left_out():
    """A line that goes on behind its end shows by how much the last spans are off."""
    base = load_catenary("re250")
    table = base.model_dump(exclude={"sources", "spans"}, exclude_none=True)
    lengths = np.random.default_rng(0).uniform(0.8, 1.0, 54) * base.span_length
    runs = []
    for count in (30, 54):
        spans = [{"span_length": length} for length in lengths[:count].tolist()]
        line = FlexibleCatenaryData.model_validate(table | {"sequence": spans})
        runs.append(simulate(line, "dsa380", 250, record_droppers=False))
    shorter, longer = runs
    ours, true = (by_span(each, (10, 29)) for each in runs)
    off = np.array([abs(a.max - b.max) / longer.summary().mean for a, b in zip(ours, true, strict=True)])
    assert off[:13].max() < 0.025  # the two lines have grids of their own
    assert off[13:].max() > 0.05
    assert shorter.summary() == shorter.summary((10, 22))


def test_the_evaluated_spans_end_before_the_line_s_end_is_felt(run):
    """Its anchor reflects waves."""
    assert chosen_spans(None, 1700.0, Alignment.equal(60.0, 30), ends=True) == (10, 22)
    with pytest.warns(AccuracyWarning, match="The line has only 13 spans: in the last 8 its end reflects"):
        assert run.spans() == (10, 12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run.spans((10, 12)) == (10, 12)


def test_figures_of_overlaps_and_behind_them_are_those_of_their_places():
    run = simulate("sweden-st15-bridge", "dsa250", 160, accuracy="fast")
    assert by_stretch(run, (10, 12)) == []
    line = load_catenary("sweden-st15-bridge")
    supports, (first, last) = np.array(line.alignment().supports), run.spans()
    limits = [(supports[each.first_span - 1], supports[each.first_span + 2]) for each in line.overlaps]
    found = by_stretch(run)
    assert [each.stretch for each in found] == ["overlaps", "up to 200 m behind an overlap", "elsewhere"]
    force, x = low_pass(run.contact_force, run.time_step), run.position
    evaluated = (x >= supports[first - 1]) & (x < supports[last])
    overlaps = sum((x >= begin) & (x < end) for begin, end in limits).astype(bool)
    behind = sum((x >= end) & (x < end + 200) for _, end in limits).astype(bool)
    for each, there in zip(found, (overlaps, behind, ~overlaps & ~behind), strict=True):
        own = force[there & evaluated]
        assert (each.mean, each.std, each.max, each.min) == (own.mean(), own.std(), own.max(), own.min())
    whole = run.summary()
    assert sum(each.distance for each in found) == pytest.approx(whole.distance, abs=1.0)
    weights = [each.distance for each in found]
    assert np.average([each.mean for each in found], weights=weights) == pytest.approx(whole.mean, rel=1e-4)
    table = of_stretches(run)
    assert table.columns["stretch"] == [each.stretch for each in found]
    assert table.titles[table.titles.index("where") + 1] == "distance (m)"


def test_forces_are_those_of_the_evaluated_spans_over_the_whole_evaluated_run():
    forces = np.full((40, 4), 50.0)
    forces[12:14, 2] = 90.0  # ahead of the train, which is in span 2
    forces[22:27, 1] = 0.0  # behind the train, which is in span 3
    forces[15, 1] = 0.0  # while the train is there
    forces[15, 0], forces[15, 3] = 500.0, 400.0  # in spans that are not evaluated
    forces[5, 1], forces[35, 2] = 300.0, 300.0  # before and after the evaluated run
    made_up = replace(RUN, dropper_force=forces, dropper_position=SPAN * np.array([0.5, 1.5, 2.5, 3.5]))
    (found,) = moving_droppers(made_up, (2, 3))
    assert found.position == pytest.approx(SPAN / 2)
    assert (found.largest, found.smallest) == (90.0, 0.0)
    assert found.slack == pytest.approx(100 * 1 / 20)
    (whole,) = moving_droppers(made_up, "all")
    assert whole.largest == 500.0
    required = by_key(made_up.compliance((2, 3)))
    assert (required["dropper force"].value, required["slack"].value) == (90.0, pytest.approx(100 * 1 / 20))
