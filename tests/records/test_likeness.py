"""Gross errors of records that a comparison finds, each named; right records pass without a doubt."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.records.compare import compare
from panto_env.records.judge import judge
from panto_env.records.measured import measured
from panto_env.records.record import Record

LINE, PANTOGRAPH, SPEED_KMH = "en50318-2002", "dsa380", 250.0


@pytest.fixture(scope="module")
def as_designed():
    return simulate(LINE, PANTOGRAPH, SPEED_KMH, record_droppers=False)


@pytest.fixture(scope="module")
def train():
    riding = {"pantographs": [PANTOGRAPH] * 2, "distances": [200.0]}
    return simulate(LINE, speed_kmh=SPEED_KMH, line_condition="as-built", seed=1, **riding)


@pytest.fixture(scope="module")
def as_built():
    return measured(simulate(LINE, PANTOGRAPH, SPEED_KMH, line_condition="as-built", seed=1))


def changed(record, **values):
    (piece,) = record.pieces
    return Record("record", (replace(piece, **values),))


def test_a_right_record_gives_no_doubt(as_built, as_designed):
    found = compare(as_built, as_designed)
    assert found.shift.correlation > 0.8
    assert found.accepted is True
    assert not found.notes


def test_a_record_that_runs_the_other_way(as_built, as_designed):
    (piece,) = as_built.pieces
    backwards = changed(as_built, force=piece.force[::-1].copy(), height=piece.height[::-1].copy())
    with pytest.raises(
        InputError, match=r"Read backwards the record correlates with 0\.9. instead of 0\.[3-7]"
    ):
        compare(backwards, as_designed)


def test_the_forces_of_two_pantographs_added(train, as_designed):
    first, second = (measured(own).longest for own in train.train)
    there = np.interp(second.position, first.position, first.force)
    found = compare(Record("sum", (replace(second, force=second.force + there),)), as_designed)
    assert found.accepted is False
    assert any("2 times the run's: it may be the sum of two pantographs" in note for note in found.notes)


@pytest.mark.longer
def test_a_trailing_pantograph(train, as_designed):
    behind = measured(train.train[1])
    found = compare(behind, as_designed)
    assert any("a trailing pantograph" in note for note in found.notes)
    riding = {"pantographs": [PANTOGRAPH] * 2, "distances": [200.0]}
    with pytest.raises(
        InputError, match=r"With pantograph 2 of the run's train the record correlates with 0\.[6-9]"
    ):
        compare(behind, simulate(LINE, speed_kmh=SPEED_KMH, **riding))
    assert compare(measured(train), simulate(LINE, speed_kmh=SPEED_KMH, **riding)).accepted is True


@pytest.mark.parametrize(("factor", "unit"), [(1 / 3.6, "m/s"), (3.6, "km/h")])
def test_a_speed_in_the_wrong_unit(as_built, as_designed, factor, unit):
    (piece,) = as_built.pieces
    wrong = changed(as_built, position=piece.position * factor)
    for read in (lambda: compare(wrong, as_designed), lambda: judge(wrong, as_designed.designed.line)):
        with pytest.raises(InputError, match=f"The force repeats every .* of a span: .*--unit speed={unit}"):
            read()


def test_a_time_made_from_a_speed_in_the_wrong_unit(as_built, as_designed):
    (piece,) = as_built.pieces
    with pytest.raises(InputError, match=r"3\.6 times as much: if the speed was recorded in m/s"):
        compare(changed(as_built, time_step=piece.time_step * 3.6), as_designed)
