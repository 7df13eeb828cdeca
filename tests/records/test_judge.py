"""Figures of a record: those of a run where it is one, by speed, section and span; what cannot be judged."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.records.judge import (
    force_spectrum,
    judge,
    part_tables,
    requirement_remarks,
    requirements_table,
    whole_table,
)
from panto_env.records.measured import measured
from panto_env.records.record import SETTLING, Piece, Record, Samples
from panto_env.records.record_file import read_record, write_record

LINE = "en50318-2002"


def within(run, begin, end):
    """A record of a run's samples between two places (m)."""
    here = (run.position >= begin) & (run.position < end)
    return Record("part", (Piece("", run.time_step, 0.0, run.position[here], run.contact_force[here]),))


def steady(speed, seconds, force=None, begin=0.0, run=""):
    count = round(500 * seconds)
    if force is None:
        force = 120 + 30 * np.random.default_rng(0).standard_normal(count)
    return Piece(run, 0.002, 0.0, begin + 0.002 * speed * np.arange(count), force)


@pytest.mark.longer
def test_spans_have_the_figures_of_the_run(run, tmp_path):
    run.save(tmp_path / "run.csv")
    found = judge(read_record(tmp_path / "run.csv"), load_catenary(LINE))
    spans = found.of("span")
    assert [part.where.partition(":")[0] for part in spans] == [str(k) for k in range(1, 20)]
    for number in (2, 5, 12, 19):  # in the first one the filter settles
        ours, theirs = spans[number - 1].figures.as_dict(), run.summary((number, number)).as_dict()
        for key in ("mean", "std", "statistical_max", "statistical_min", "max", "min", "contact_loss"):
            assert ours[key] == pytest.approx(theirs[key], rel=1e-9), key
        assert ours["distance"] == pytest.approx(theirs["distance"], rel=2e-3)


def test_the_whole_is_that_of_the_run_but_for_the_begin(run):
    found = judge(within(run, 0, 2000))
    force = low_pass(run.contact_force, run.time_step)[run.time - run.time[0] > SETTLING - 1e-9]
    assert found.whole.figures.std == pytest.approx(float(force.std()), rel=1e-9)
    assert found.whole.figures.max == float(force.max())
    assert found.whole.figures.distance == pytest.approx(run.distance, rel=1e-3)


def test_requirements_are_those_of_a_run(run):
    covered = run.spans()
    found = judge(within(run, *run.alignment.limits(covered)), load_catenary(LINE))
    ((_, criteria),) = found.requirements
    theirs = {each.key: each for each in run.compliance()}
    for each in criteria:
        assert (each.lowest, each.source) == (theirs[each.key].lowest, theirs[each.key].source)
        if each.key != "std":  # its limit is a share of the mean
            assert each.highest == pytest.approx(theirs[each.key].highest) or each.highest is None
    assert {"mean", "std", "max", "min", "arcing", "speed"} <= {each.key for each in criteria}
    assert not any("--mean-force" in each.note for each in criteria)


def test_the_uplift_is_judged_by_the_line_s_room(record):
    ((_, criteria),) = judge(record, load_catenary(LINE)).requirements
    (uplift,) = (each for each in criteria if each.key == "uplift")
    assert uplift.value == pytest.approx(2e3 * record.longest.uplift.max())
    ((_, without),) = judge(record).requirements
    assert "uplift" not in {each.key for each in without}


def test_classes_of_speeds():
    record = Record("a", (steady(250 / 3.6, 5), steady(300 / 3.6, 5)))
    found = judge(record)
    slow, fast = found.of("speed")
    assert (slow.where, fast.where) == ("235-255 km/h", "295-315 km/h")
    assert slow.samples == fast.samples == 2500
    limits = [{each.key: each.highest for each in criteria} for _, criteria in found.requirements]
    assert limits[0]["arcing"] == 0.1
    assert limits[1]["arcing"] == 0.2
    assert limits[1]["mean"] == pytest.approx(0.00097 * 300**2 + 70)
    assert requirements_table(found).headings[0] == "speed"
    told = requirement_remarks(judge(record, load_catenary(LINE)))
    assert any("losses of contact over 5 ms" in line for line in told)
    assert not any("Doppler" in line for line in told)  # it differs from class to class


def test_sections_and_spans():
    record = Record("a", (steady(50.0, 50, begin=1500.0),))
    found = judge(record, span=50.0)
    assert [part.where for part in found.of("section")] == [
        "1,000 to 2,000 m",
        "2,000 to 3,000 m",
        "3,000 to 4,000 m",
    ]
    assert [part.samples for part in found.of("section")] == [5000, 10000, 10000]
    assert len(found.of("span")) == 50
    assert judge(record, section=2500.0).of("section")[0].figures.distance == pytest.approx(1000)
    assert "Supports are taken to stand every 50 m from 0 m on." in found.notes
    assert [table.title for table in part_tables(found)] == ["By section", "By span"]
    whole, short = (part_tables(found, most)[1] for most in (None, 3))
    assert short.title == "By span: the 3 of 50 with the largest σ"
    largest = sorted(found.of("span"), key=lambda part: -part.figures.std)[:3]
    assert [row[0] for row in short.rows] == [
        row[0] for row in whole.rows if row[0] in {p.where for p in largest}
    ]


def test_sections_from_overlap_to_overlap(run):
    table = load_catenary(LINE).model_dump(exclude={"sources", "spans"}, exclude_none=True)
    table["sequence"] = [{}] * 20
    table["overlaps"] = [{"first_span": 10, "rises": (0.5,)}]
    line = FlexibleCatenaryData.model_validate(table)
    found = judge(within(run, 0, 2000), line)
    assert [part.where for part in found.of("section")] == ["0 to 570 m", "570 to 1,200 m"]


def test_losses_of_contact_are_those_of_the_raw_force():
    force = 120 + 30 * np.random.default_rng(0).standard_normal(5000)
    force[1000:1004] = 0.0  # 8 ms
    force[2000:2002] = 0.0  # 4 ms, which does not count as an arc
    whole = judge(Record("a", (steady(60, 10, np.maximum(force, 0.1 * (force != 0))),))).whole
    assert whole.figures.contact_loss == pytest.approx(100 * 6 / 5000)
    assert whole.arcing == pytest.approx(100 * 4 / 5000)


def test_a_record_that_was_low_passed_is_judged_as_it_is(run):
    record = measured(run)
    (piece,) = record.pieces
    filtered = low_pass(piece.force, piece.time_step)
    found = judge(Record("a", (replace(piece, force=filtered),)))
    assert found.samples.low_passed
    assert not judge(record).samples.low_passed
    fourth = sosfilt(butter(4, 20, fs=1 / piece.time_step, output="sos"), piece.force)
    assert Samples(Record("a", (replace(piece, force=fourth),))).low_passed
    assert found.whole.figures.std == pytest.approx(float(filtered.std()))
    assert np.isnan(found.whole.figures.contact_loss)
    assert np.isnan(found.whole.arcing)
    assert any("low-passed before it was recorded" in note for note in found.notes)
    assert ("contact loss CL (%)", "–") in whole_table(found, "").rows


@pytest.mark.longer
def test_arcing_is_not_judged_behind_a_filter_that_is_known(run, tmp_path):
    """A weak filter looks like none: "arcing 0, kept" was said of a force that cannot fall to 0 any more."""
    record, weak = measured(run), butter(1, 20, fs=1 / run.time_step, output="sos")
    (piece,) = record.pieces
    write_record(Record("a", (replace(piece, force=sosfilt(weak, piece.force)),)), tmp_path / "a.csv")
    unknown, at_20, at_40 = (
        judge(read_record(tmp_path / "a.csv", filtered=hertz)) for hertz in (None, 20.0, 40.0)
    )
    for found, verdict in ((unknown, "kept"), (at_20, "not judged"), (at_40, "not judged")):
        ((_, criteria),) = found.requirements
        (arcing,) = (each for each in criteria if each.key == "arcing")
        assert arcing.verdict == verdict
        assert ("not judged, as the force was low-passed" in arcing.note) == (verdict == "not judged")
        assert [row[4] for row in requirements_table(found).cells if "arcing" in row[0]] == [verdict]
    assert at_20.samples.low_passed  # and judged as it is, while one of 40 Hz is filtered on
    assert not at_40.samples.low_passed
    assert any("(at 40 Hz, as given)" in note for note in at_40.notes)


def test_arcs_that_the_samples_do_not_resolve(run):
    found = judge(measured(run, rate=125.0))
    assert np.isnan(found.whole.arcing)
    assert found.whole.figures.contact_loss == 0
    assert any("NQ cannot be judged" in note for note in found.notes)
    assert not np.isnan(judge(measured(run, rate=200.0)).whole.arcing)


def test_a_peak_of_the_spectrum_has_the_amplitude_of_its_harmonic():
    time = 0.002 * np.arange(20000)
    force = 120 + 25 * np.cos(2 * np.pi * 1.5 * time)
    frequency, amplitude = force_spectrum(Record("a", (steady(60, 40, force),)))
    assert frequency[np.argmax(amplitude)] == pytest.approx(1.5)
    assert amplitude.max() == pytest.approx(25, rel=1e-3)


def test_what_cannot_be_placed(record):
    with pytest.raises(InputError, match="Give a line or the length of its spans, not both"):
        judge(record, load_catenary(LINE), span=60.0)
    far = Record("a", (replace(record.longest, position=record.longest.position + 1e5),))
    table = load_catenary(LINE).model_dump(exclude={"sources", "spans"}, exclude_none=True)
    with pytest.raises(InputError, match="write positions from the line's first support"):
        judge(far, FlexibleCatenaryData.model_validate(table | {"sequence": [{}, {"span_length": 65}] * 10}))


def test_the_way_of_several_runs_counts_once():
    fast, slow = steady(80.0, 1, run="a"), steady(10.0, 2, begin=30.0, run="b")
    beyond = steady(50.0, 1, begin=70.0, run="c")
    samples = Samples(Record("a", (fast, slow, beyond)))
    assert samples.distance(samples.run == 0) == pytest.approx(80)
    assert samples.distance(samples.run <= 1) == pytest.approx(80)
    assert samples.distance(samples.run >= 0) == pytest.approx(120)
    assert samples.distance(samples.run >= 1) == pytest.approx(70)
    assert samples.distance(samples.run > 2) == 0


def ended():
    """A line of 20 spans that ends, so it has no others."""
    table = load_catenary(LINE).model_dump(exclude={"sources", "spans"}, exclude_none=True)
    return FlexibleCatenaryData.model_validate(table | {"sequence": [{}, {"span_length": 55}] * 10})


def test_spans_beyond_the_line_s_ends_are_not_shown():
    line = ended()
    length = line.alignment().length
    record = Record("a", (steady(50.0, 40, begin=-130.0),))
    found = judge(record, line)
    assert [part.where.partition(":")[0] for part in found.of("span")] == [str(k) for k in range(1, 21)]
    assert found.notes == (
        f"The record runs from -130 to 1,870 m, and spans are known from 0 to {length:,.0f} m: what lies "
        "beyond counts in all figures but those by span.",
    )
    assert found.reach == (0.0, length)
    within = Record("a", (steady(50.0, 20, begin=10.0),))
    assert judge(within, line).notes == ()


def test_before_the_first_support_there_are_no_spans():
    record = Record("a", (steady(50.0, 20, begin=-130.0),))
    endless = judge(record, load_catenary(LINE))
    assert endless.of("span")[0].where.startswith("1: 0 to 60 m")
    assert "spans are known from 0 m on" in endless.notes[-1]
    assert "spans are known from 0 m on" in judge(record, span=60.0).notes[-1]
    with pytest.raises(InputError, match="write positions from the line's first support"):
        judge(Record("a", (steady(50.0, 20, begin=-2000.0),)), load_catenary(LINE))


def test_a_class_that_a_train_only_passes_has_no_requirements():
    faster = np.linspace(200 / 3.6, 300 / 3.6, 2500)
    position = np.cumsum(0.002 * np.r_[np.full(5000, 200 / 3.6), faster, np.full(5000, 300 / 3.6)])
    force = 120 + 30 * np.random.default_rng(0).standard_normal(12500)
    found = judge(Record("a", (Piece("", 0.002, 0.0, position.round(1), force),)))
    assert [part.where for part, _ in found.requirements] == ["195-215 km/h", "295-315 km/h"]
    assert len(found.of("speed")) == 6
