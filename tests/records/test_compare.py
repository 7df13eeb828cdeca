"""A record beside a run: the shift, deviations, and the verdict."""

import math
from dataclasses import replace

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.metrics.low_pass import low_pass
from panto_env.records.compare import acceptance_table, compare, deviation, shift_sentence, spans_table
from panto_env.records.measured import measured
from panto_env.records.record import Record


def changed(record, **series):
    """A record whose piece has other series, each a function of the old one."""
    (piece,) = record.pieces
    return Record(
        "a", (replace(piece, **{name: make(getattr(piece, name)) for name, make in series.items()}),)
    )


def deviations(found):
    return {each.key: each.value for each in found.criteria}


@pytest.mark.longer
@pytest.mark.parametrize("error", [1.7, -42.3])
def test_a_run_against_its_own_noisy_record(run, error):
    found = compare(measured(run, position_error=error), run)
    assert found.shift.value == pytest.approx(-error, abs=0.05)
    assert found.shift.correlation > 0.99
    if error > 0:  # from the other one, two spans away is more alike
        assert abs(found.shift.other - found.shift.value) == pytest.approx(60, abs=1)  # the next span
    assert found.shift.other_correlation < found.shift.correlation
    assert found.accepted is True
    assert found.verdict == "accepted"
    assert [pair.span for pair in found.spans] == list(range(10, 20)) if error > 0 else len(found.spans) > 7
    assert abs(deviations(found)["std"]) < 1.0
    assert found.notes == ()
    assert f"shifted by {-error:+.1f}" in shift_sentence(found)


@pytest.mark.longer
def test_figures_of_spans_are_those_of_the_run(run):
    found = compare(measured(run, force_noise=0.0), run)
    summary = run.summary()
    for key in ("mean", "std", "max", "min"):
        assert found.figures[key][1] == pytest.approx(getattr(summary, key), rel=1e-9)
        assert found.figures[key][0] == pytest.approx(getattr(summary, key), rel=5e-3)
    one = found.spans[3]
    assert one.std[1] == pytest.approx(run.summary((13, 13)).std)
    assert len(spans_table(found).rows) == 10
    short = spans_table(found, 2)
    assert "the 2 of 10 with the largest difference of σ" in short.title
    largest = sorted(found.spans, key=lambda each: -abs(deviation(each.std)))[:2]
    assert [row[0] for row in short.rows] == [f"{span}" for span in sorted(each.span for each in largest)]


def test_a_shift_that_is_given_is_searched_about(run):
    far = measured(run, position_error=2000.3)
    with pytest.raises(InputError, match=r"less than a span in common.*--shift"):
        compare(far, run)
    found = compare(far, run, shift=-1990.0)
    assert found.shift.value == pytest.approx(-2000.3, abs=0.05)
    other = compare(measured(run), run, shift=60.0)  # whoever knows better, gets it
    assert other.shift.value == pytest.approx(60.0, abs=0.5)


def test_a_causally_filtered_record_has_the_filter_s_delay(run):
    record = measured(run)
    step = record.longest.time_step
    found = compare(changed(record, force=lambda force: low_pass(force, step)), run)
    assert found.shift.value == pytest.approx(-0.031 * run.speed, abs=0.2)
    assert abs(deviations(found)["std"]) < 1.0


@pytest.mark.parametrize(
    ("key", "series", "value"),
    [
        ("std", {"force": lambda force: force.mean() + (force - force.mean()) / 1.1}, 10.0),
        ("std", {"force": lambda force: force.mean() + (force - force.mean()) / 1.25}, 25.0),
        ("uplift", {"uplift": lambda uplift: uplift + 0.015}, -15.0),
        ("uplift", {"uplift": lambda uplift: uplift + 0.025}, -25.0),
        ("height", {"height": lambda height: 3.0 * height}, None),
    ],
)
def test_deviations_are_run_minus_record_and_each_is_judged(run, record, key, series, value):
    found = compare(changed(record, **series), run)
    assert value is None or deviations(found)[key] == pytest.approx(value, abs=0.5)
    kept = value is not None and abs(value) < 20
    assert [each.key for each in found.criteria if each.kept is False] == ([] if kept else [key])
    assert found.accepted is kept
    assert found.verdict == ("accepted" if kept else "not accepted")


@pytest.mark.longer
def test_what_was_not_measured_is_not_judged(run, record):
    found = compare(changed(record, height=lambda _: None, uplift=lambda _: None), run)
    assert found.accepted is None
    assert found.verdict == (
        "not judged: uplift at a support and range of the contact point's height not measured"
    )
    rows = {row[0]: row[1] for row in acceptance_table(found).rows}
    assert rows["maximum uplift at the support (mm)"] == "not measured"
    assert rows["range of the contact point's height (mm)"] == "not measured"
    assert rows["σ of the contact force (%)"] != "not measured"
    worse = changed(record, height=lambda _: None, force=lambda force: 100 + 0.5 * (force - 100))
    assert compare(worse, run).accepted is False  # what is broken is broken


def test_a_mast_outside_the_evaluated_spans_is_not_judged(run, record):
    found = compare(changed(record, uplift=lambda uplift: np.roll(uplift, -3000)), run)
    assert found.missing == ("uplift at a support",)
    (note,) = (each.note for each in found.criteria if each.key == "uplift")
    assert "outside the run's evaluated spans" in note
    assert math.isnan(deviations(found)["uplift"])


def test_another_speed_is_refused(run, record):
    with pytest.raises(InputError, match=r"simulate the run at the record's speed: --speed 250\.0"):
        compare(record, replace(run, speed=1.04 * run.speed))
    compare(record, replace(run, speed=1.02 * run.speed))


def accelerating(record, change):
    """A record of the same forces by place, of a train whose speed rises evenly by a share of its mean."""
    (piece,) = record.pieces
    share = np.linspace(0, 1, len(piece.force))
    place = piece.position[0] + piece.length * ((1 - change / 2) * share + change / 2 * share**2)
    series = {
        name: np.interp(place, piece.position, getattr(piece, name)) for name in ("force", "height", "uplift")
    }
    return Record("a", (replace(piece, position=place, **series),))


@pytest.mark.longer
def test_a_speed_that_changes_is_refused(run, record):
    changes = accelerating(record, 0.4)
    assert changes.longest.speed == pytest.approx(run.speed)
    with pytest.raises(
        InputError,
        match=r"speed lies between \d+\.\d and 29\d\.\d km/h from .* up to 1[0-9]\.\d % from the run's 250",
    ):
        compare(changes, run)
    assert compare(accelerating(record, 0.04), run).accepted is True


def test_a_speed_that_changes_elsewhere_does_no_harm(run, record):
    (piece,) = record.pieces
    slow = piece.position < 400  # before the run's evaluated spans, which begin at 540 m
    step = np.where(slow[1:], 1.06, 1.0) * np.diff(piece.position)
    place = piece.position[-1] - np.r_[np.cumsum(step[::-1])[::-1], 0.0]
    found = compare(Record("a", (replace(piece, position=place),)), run)
    assert found.accepted is True


def test_another_line_is_not_accepted(record, other_run):
    found = compare(record, other_run)
    assert found.accepted is False
    assert found.shift.correlation < 0.3
    assert "another line" in found.notes[-1]


def test_a_run_that_is_too_short(record, run):
    short = replace(run, terminated=True, ending="It left its range.")
    with pytest.raises(InputError, match="It left its range"):
        compare(record, short)
