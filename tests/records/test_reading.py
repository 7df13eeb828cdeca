"""What a record's file may hold, and how it is cut into pieces."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from panto_env.base.errors import InputError
from panto_env.records.record_file import read_record, write_record


def test_a_written_record_is_read_back_to_the_last_bit(record, tmp_path):
    write_record(record, tmp_path / "a.csv")
    again = read_record(tmp_path / "a.csv")
    assert again.notes == ()
    (piece,), (then,) = again.pieces, record.pieces
    for name in ("position", "force", "height", "uplift"):
        np.testing.assert_array_equal(getattr(piece, name), getattr(then, name))
    assert piece.time_step == pytest.approx(then.time_step, rel=1e-12)
    assert piece.start == then.start
    with pytest.raises(InputError, match=r"must end in \.csv"):
        write_record(record, tmp_path / "a.txt")


@pytest.mark.longer
def test_the_csv_of_a_run_is_read_as_it_is(run, tmp_path):
    run.save(tmp_path / "run.csv")
    (piece,) = read_record(tmp_path / "run.csv").pieces
    np.testing.assert_array_equal(piece.force, run.contact_force)
    np.testing.assert_array_equal(piece.position, run.position)
    np.testing.assert_array_equal(piece.height, run.wire)
    assert piece.speed_kmh == pytest.approx(250)


def test_units_in_headings_or_given(columns, written):
    plain = read_record(written(columns)).longest
    columns["force [kN]"] = columns.pop("force (N)") / 1e3
    columns["time"] = columns.pop("time (s)") * 1e3
    columns["Position (km)"] = columns.pop("position (m)") / 1e3
    other = read_record(written(columns), {"time": "ms"}).longest
    np.testing.assert_allclose(other.force, plain.force)
    np.testing.assert_allclose(other.position, plain.position)
    assert other.time_step == pytest.approx(0.002)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-8-sig"])
def test_a_measuring_trains_export_is_read(encoding, columns, tmp_path):
    """Preamble, names and units in rows of their own, commas, umlauts, km+m, an empty row."""
    plain = tmp_path / "plain.csv"
    force = columns["force (N)"]
    rows = [",".join(columns)] + [
        ",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True)
    ]
    plain.write_text("\n".join(rows))
    lines = ["Meßfahrt;5520;Höhe", "Datum: 12.03.2021;;", "Zeit;Ort;F_zw1;F_zw2;Bem.", "s;km;kN;kN;"]
    for time, place, each in zip(columns["time (s)"], columns["position (m)"], force, strict=True):
        km, metres = divmod(place, 1000)
        half = repr(float(each) / 2000)
        lines.append(f"{time:.3f};{km:.0f}+{metres:.1f};{half};{half};".replace(".", ","))
    path = tmp_path / "export.csv"
    path.write_bytes("\r\n".join([*lines, ";;;;", ""]).encode(encoding))
    named = {"time": "Zeit", "position": "Ort", "force_1": "F_zw1", "force_2": "F_zw2"}
    found, then = read_record(path, None, named).longest, read_record(plain).longest
    np.testing.assert_allclose(found.force, then.force, rtol=1e-12)
    np.testing.assert_allclose(found.position, then.position, atol=1e-6)
    with pytest.raises(InputError, match=r"has no column force_1 .*give --column force_1=HEADING"):
        read_record(path, None, named | {"force_1": "F_zw3"})


def test_parquet_has_the_same_columns(columns, written, tmp_path):
    columns["run"] = ["a"] * 5000
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    (piece,) = read_record(tmp_path / "a.parquet").pieces
    (then,) = read_record(written(columns)).pieces
    np.testing.assert_array_equal(piece.force, then.force)
    assert piece.run == then.run == "a"


def empty(*samples):
    return lambda columns: columns["force (N)"].put(samples, np.nan)


def missing(*samples):
    return lambda columns: columns.update({name: np.delete(each, samples) for name, each in columns.items()})


def down(columns):
    columns["raised"] = np.where((columns["time (s)"] > 3) & (columns["time (s)"] < 4), 0, 1)


def stands(columns):
    behind = np.where(np.arange(5000) > 3000, 0.1 * np.arange(-3000, 2000), 0)
    columns["position (m)"] = np.minimum(columns["position (m)"], 1200.0) + behind


@pytest.mark.parametrize(
    ("change", "samples", "note"),
    [
        (
            empty(2000, 2001, 2002),
            [2000, 2997],
            "The force is missing once, at 1,200.0 m and 4 s; the",
        ),
        (empty(2000, 2200), [2000, 2799], "A piece is shorter than 1 s once"),
        (down, [1501, 3000], "The pantograph is down once"),
        (missing(1500, 1501, 3000), [1500, 1498, 1999], "Samples are missing 2 times, first at 1,149.9 m"),
        (stands, [2000, 1999], "The train stands once, at 1,200.0 m"),
    ],
)
def test_gaps_cut_a_record(change, samples, note, columns, written):
    change(columns)
    found = read_record(written(columns))
    assert [len(piece.force) for piece in found.pieces] == samples
    assert any(each.startswith(note) for each in found.notes)
    assert found.pieces[-1].time[-1] == pytest.approx(9.998)


@pytest.mark.parametrize("jump", [-800.0, 300.0])
def test_a_reset_of_the_odometer_cuts(columns, written, jump):
    columns["position (m)"] = columns["position (m)"] + np.where(np.arange(5000) >= 1700, jump, 0)
    found = read_record(written(columns))
    assert [len(piece.force) for piece in found.pieces] == [1700, 3300]
    assert "as an odometer that is reset once" in found.notes[0]


def test_positions_in_steps_of_the_odometer_rise_evenly(columns, written):
    true = columns["position (m)"]
    columns["position (m)"] = np.ceil(true - 1e-9)
    piece = read_record(written(columns)).longest
    assert (np.diff(piece.position) > 0).all()
    assert np.abs(piece.position[20:] - true[20:]).max() < 1.0
    assert piece.speed == pytest.approx(50, rel=2e-3)


def test_several_runs(columns, written):
    columns["run"] = ["up"] * 2500 + ["down"] * 2500
    columns["time (s)"] = np.tile(columns["time (s)"][:2500], 2)
    columns["position (m)"] = np.tile(columns["position (m)"][:2500], 2)
    found = read_record(written(columns))
    assert [piece.run for piece in found.pieces] == ["up", "down"]
    assert [piece.start for piece in found.pieces] == [0, 0]


def test_position_is_the_integral_of_the_speed(columns, written):
    time = columns["time (s)"]
    del columns["position (m)"]
    columns["speed (km/h)"] = 180 + 3.6 * time
    found = read_record(written(columns))
    np.testing.assert_allclose(found.longest.position, 50 * time + time**2 / 2, atol=1e-6)
    assert found.notes == ("Positions are the integral of the speed, from 0 m.",)


def test_a_record_over_place_is_brought_to_equal_steps_of_time(columns, written):
    time = columns["time (s)"]
    position = 0.1 * np.arange(5500)  # equal steps of place, at a speed that rises from 50 to 60 m/s
    speed = np.sqrt(50**2 + 2 * position)
    when = speed - 50
    force = 120 + 20 * np.sin(2 * np.pi * 1.5 * when)
    columns = {"position (m)": position, "speed (m/s)": speed, "force (N)": force}
    piece = read_record(written(columns)).longest
    at = piece.time
    np.testing.assert_allclose(piece.position, 50 * at + at**2 / 2, atol=1e-3)
    np.testing.assert_allclose(piece.force, 120 + 20 * np.sin(2 * np.pi * 1.5 * at), atol=0.01)
    assert time[-1] - 0.1 < at[-1] < time[-1] + 0.1
