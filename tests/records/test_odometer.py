"""Trains that turn back, and positions that repeat: what of them counts, and how fast the train then ran."""

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.records.axes import BACK, runs_back
from panto_env.records.judge import judge
from panto_env.records.plausibility import check_speed
from panto_env.records.record import Piece
from panto_env.records.record_file import read_record

NOTE = "The train runs back once, at {} m and {} s; the way back is left out."


def turned(columns, out, hold=0, back=0, again=0):
    """Columns of a train that goes out, stands, goes back and out again, in samples of 0.1 m."""
    ways = np.r_[np.full(out, 0.1), np.zeros(hold), np.full(back, -0.1), np.full(again, 0.1)]
    count = len(ways)
    force = np.resize(columns["force (N)"], count) + np.arange(count) / count
    return {"time (s)": 0.002 * np.arange(count), "position (m)": 1000 + np.cumsum(ways), "force (N)": force}


STANDS = "The train stands once, at 1,300.0 m and 5.998 s; the record is cut there."


@pytest.mark.longer
@pytest.mark.parametrize(
    ("hold", "samples", "notes"),
    [
        (0, 3000, (NOTE.format("1,299.9", "6"),)),
        (1000, 2999, (STANDS, NOTE.format("1,299.9", "8"))),
    ],
)
def test_a_train_that_turns_back_counts_on_the_way_out_only(hold, samples, notes, columns, written):
    found = read_record(written(turned(columns, 3000, hold=hold, back=1900)))
    (piece,) = found.pieces
    assert len(piece.force) == samples
    assert found.notes == notes
    judged = judge(found)
    assert judged.whole.figures.distance == pytest.approx(0.1 * samples)
    assert judged.whole.speed == pytest.approx(50)
    assert [part.where for part in judged.of("speed")] == ["175-195 km/h"]


@pytest.mark.longer
def test_a_train_that_goes_out_again_counts_from_there_on(columns, written):
    found = read_record(written(turned(columns, 3000, back=1500, again=2500)))
    assert [len(piece.force) for piece in found.pieces] == [3000, 2500]
    assert found.pieces[1].position[0] == pytest.approx(1150.1)
    assert all(piece.speed == pytest.approx(50) for piece in found.pieces)


@pytest.mark.parametrize("grain", [0.0, 0.25])
def test_a_train_that_turns_back_without_a_time(grain, columns, written):
    columns = turned(columns, 3000, back=1500, again=2500)
    del columns["time (s)"]
    if grain:
        columns["position (m)"] = grain * np.round(columns["position (m)"] / grain)
    columns["speed (m/s)"] = np.full(7000, 50.0)
    found = read_record(written(columns))
    assert [len(piece.force) for piece in found.pieces] == pytest.approx([3000, 2500], abs=10)
    assert [piece.speed for piece in found.pieces] == pytest.approx([50, 50], rel=2e-3)
    assert found.pieces[1].start == pytest.approx(9, abs=0.05)
    (back,) = (note for note in found.notes if note.startswith("The train runs back once, at "))
    assert 1299.5 < float(back.split()[6].replace(",", "")) < 1300.5


def test_noise_of_the_odometer_is_no_turn():
    position = np.array([0.0, 1.0, 2.0, 2.0 - BACK, 1.5, 2.5, 3.0])
    apart = np.zeros(6, dtype=bool)
    assert not runs_back(position, apart).any()
    position[3] -= 0.01
    np.testing.assert_array_equal(np.flatnonzero(runs_back(position, apart)), [3])


def test_behind_a_reset_a_train_runs_forward_until_it_is_seen_to_turn():
    position = np.array([100.0, 101, 102, 0, 1, 2, 50, 49, 48, 47])
    apart = np.isin(np.arange(9), [2, 5])
    np.testing.assert_array_equal(np.flatnonzero(runs_back(position, apart)), [6, 7, 8, 9])


def test_speeds_that_are_below_0_give_no_positions(columns, written):
    del columns["position (m)"]
    columns["speed (km/h)"] = np.full(5000, -180.0)
    with pytest.raises(InputError, match="Most speeds are below 0; turn the sign of column speed"):
        read_record(written(columns))


def over_place(columns, position):
    return {
        "position (m)": position,
        "speed (m/s)": np.full(len(position), 50.0),
        "force (N)": np.resize(columns["force (N)"], len(position)),
    }


# at 0.1005 m from sample to sample one in 200 rounds to two grains of 0.1 m, and none to 0
@pytest.mark.parametrize(("way", "grain"), [(0.1, 0.07), (0.1, 1.0), (0.1005, 0.1), (0.139, 0.15)])
def test_rounded_positions_without_a_time_have_the_speed_of_the_column(way, grain, columns, written):
    position = 1000 + grain * np.round(way * np.arange(5000) / grain)
    found = read_record(written(over_place(columns, position)))
    (piece,) = found.pieces
    assert piece.speed == pytest.approx(50, rel=2e-3)
    assert piece.time_step == pytest.approx(way / 50, rel=0.01)
    assert len(piece.force) == pytest.approx(5000, rel=0.01)
    repeated = int((np.diff(position) == 0).sum())
    told = f"positions that repeat the one before ({repeated:,}) are taken to rise evenly"
    assert (told in found.notes[0]) == (repeated > 0)


@pytest.mark.parametrize("every", [1, 3])
def test_samples_that_are_there_twice_without_a_time_take_no_time(every, columns, written):
    number = np.sort(np.r_[np.arange(5000), np.arange(0, 5000, every)])
    columns = over_place(columns, 1000 + 0.1 * np.arange(5000))
    piece = read_record(written({name: each[number] for name, each in columns.items()})).longest
    assert piece.speed == pytest.approx(50, rel=1e-3)
    assert piece.force.mean() == pytest.approx(columns["force (N)"].mean(), rel=2e-3)


def test_rounded_positions_with_a_gap_and_a_reset(columns, written):
    position = 0.2 * np.round(0.1 * np.r_[0:3000, 3100:6000] / 0.2)
    position[4000:] -= 400
    found = read_record(written(over_place(columns, position)))
    assert [len(piece.force) for piece in found.pieces] == pytest.approx([3000, 1000, 1900], abs=3)
    assert [piece.speed for piece in found.pieces] == pytest.approx([50] * 3, rel=3e-3)
    assert [piece.start for piece in found.pieces[1:]] == pytest.approx([6.2, 8.2], abs=0.02)
    assert [note.split(" once")[0] for note in found.notes[1:]] == [
        "Samples are missing",
        "The position jumps, as an odometer that is reset",
    ]


def test_one_sample_that_is_missing_is_a_gap_where_positions_are_not_rounded(columns, written):
    found = read_record(written(over_place(columns, 0.1 * np.r_[0:2000, 2001:5000])))
    assert [len(piece.force) for piece in found.pieces] == [2000, 2999]


def test_many_gaps_are_no_usual_steps(columns, written):
    number = np.arange(3000) + 20 * (np.arange(3000) // 300)  # 2.4 s, and 0.16 s without a sample
    found = read_record(written(over_place(columns, 0.4 * number)))
    assert [len(piece.force) for piece in found.pieces] == [300] * 10
    assert found.notes[1].startswith("Samples are missing 9 times")


def test_a_train_that_stands_without_a_time_is_a_gap(columns, written):
    position = 0.1 * np.minimum(np.arange(5000), 2500)
    position[3500:] += 0.1 * np.arange(1, 1501)
    found = read_record(written(over_place(columns, position)))
    assert [len(piece.force) for piece in found.pieces] == pytest.approx([2500, 1500], abs=1)
    assert any(note.startswith("The train stands once") for note in found.notes)


def test_a_time_that_contradicts_the_speeds_it_was_had_from():
    piece = Piece("", 0.002, 0.0, 0.1 * np.arange(1001), np.zeros(1001))
    check_speed("", piece, np.full(1001, 51.0), over_place=True)
    with pytest.raises(InputError, match=r"a mean of 187\.2 km/h, but the way .* is 180 km/h"):
        check_speed("", piece, np.full(1001, 52.0), over_place=True)
    check_speed("", piece, np.full(1001, 52.0))  # a column beside time and position need not be as exact
