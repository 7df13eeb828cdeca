"""Figures span by span, droppers one by one where spans differ, and figures of overlaps."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.metrics.by_span import by_span, by_stretch, moving_droppers
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import droppers, of_stretches
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


def test_figures_of_all_spans_follow_from_those_of_each_by_its_length(run):
    """CF and CL over the distance, as in paper 1 (Eqs 13 and 14); mean and σ over samples of equal time.

    At constant speed samples are equally spaced along the track, so that a span counts by its length. The
    mean over spans, each counted alike, is another one.
    """
    away = (run.alignment.length_at(run.position) > 58) & (run.position % 7.0 < 1.5)  # in the long spans
    lost = replace(run, contact_force=np.where(away, 0.0, run.contact_force))
    for each_run in (run, lost):
        spans = by_span(each_run, (3, 12))
        length = np.array([each.length for each in spans])
        share, whole = length / length.sum(), each_run.summary((3, 12))
        means, deviations = (np.array([getattr(each, name) for each in spans]) for name in ("mean", "std"))
        assert whole.distance == pytest.approx(length.sum(), abs=2 * each_run.stride)
        assert share @ means == pytest.approx(whole.mean, abs=0.01)
        variance = share @ (deviations**2 + (means - whole.mean) ** 2)
        assert np.sqrt(variance) == pytest.approx(whole.std, rel=1e-3)
        losses = np.array([each.contact_loss for each in spans])
        assert share @ losses == pytest.approx(whole.contact_loss, abs=0.02)
        costs = sum(each_run.summary((k, k)).cost_function for k in range(3, 13))
        # Eq. 14 has no step from the last sample of a span to the first one of the next.
        assert costs == pytest.approx(whole.cost_function, rel=10 * each_run.stride / length.sum())
    assert whole.contact_loss > 3
    assert abs(losses.mean() - whole.contact_loss) > 0.1  # each span counted alike
    assert abs(np.sqrt(np.mean(deviations**2 + (means - means.mean()) ** 2)) / whole.std - 1) > 1e-3


def test_the_evaluated_spans_end_before_the_line_s_end_is_felt(long_run, run):
    """Its anchor reflects waves; a line that goes on behind it shows by how much the last spans are off."""
    shorter, longer = long_run
    assert shorter.spans() == (10, 22)  # of 30
    assert longer.spans() == (10, 46)
    ours, true = (by_span(each, (10, 29)) for each in long_run)
    off = np.array([abs(a.max - b.max) / longer.summary().mean for a, b in zip(ours, true, strict=True)])
    assert off[:13].max() < 0.025  # the two lines have grids of their own
    assert off[13:].max() > 0.05
    assert shorter.summary() == shorter.summary((10, 22))
    with pytest.warns(AccuracyWarning, match="The line has only 13 spans: in the last 8 its end reflects"):
        assert run.spans() == (10, 12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run.spans((10, 12)) == (10, 12)


@pytest.fixture(scope="module")
def long_run():
    """Runs on a line of 30 spans, and on one that goes on with another 24."""
    base = load_catenary("re250")
    table = base.model_dump(exclude={"sources", "spans"}, exclude_none=True)
    lengths = np.random.default_rng(0).uniform(0.8, 1.0, 54) * base.span_length
    lines = [
        FlexibleCatenaryData.model_validate(
            table | {"sequence": [{"span_length": length} for length in lengths[:count].tolist()]}
        )
        for count in (30, 54)
    ]
    return [simulate(line, "dsa380", 250, record_droppers=False) for line in lines]


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


def test_the_maximum_of_a_real_run_is_that_of_the_requirements():
    """Of droppers beside a support it is reached while the train is in a span beside theirs."""
    run = simulate("re250", "dsa250", 200.0)
    largest = max(each.largest for each in moving_droppers(run))
    assert largest == by_key(run.compliance())["dropper force"].value
    train, own = run.alignment.span_of(run.position), run.alignment.span_of(run.dropper_position)
    evaluated = run.dropper_force[run.inside()]
    near = (train[:, None] == own)[run.inside()]
    assert largest == evaluated[:, (own >= 10) & (own <= 19)].max()
    assert largest > 1.1 * evaluated[near].max(), "the run does not show the difference"
