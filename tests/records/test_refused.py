"""What cannot be a measuring train's record is refused in one sentence, with the likely mistake."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from panto_env.base.errors import InputError
from panto_env.records.record_file import read_record


def drop(*names):
    return lambda columns: [columns.pop(name) for name in names]


def scale(name, factor, heading=None):
    return lambda columns: columns.update({heading or name: factor * columns.pop(name)})


def swap(one, other):
    return lambda columns: columns.update({one: columns[other], other: columns[one]})


def add(**more):
    return lambda columns: columns.update({name.replace("__", " "): each for name, each in more.items()})


def few(count):
    return lambda columns: columns.update({name: each[:count] for name, each in columns.items()})


def thin(columns):
    columns.update({name: each[::6] for name, each in columns.items()})


def uneven(columns):
    columns["time (s)"] = columns["time (s)"] + 0.0006 * np.sin(np.arange(5000))


def twice(columns):
    for name in ("time (s)", "position (m)", "force (N)"):
        columns[name] = np.tile(columns[name][:2500], 2)
    columns["run"] = ["a"] * 2500 + ["b"] * 2500


def again(columns):
    columns["run"] = ["a"] * 2000 + ["b"] * 2000 + ["a"] * 1000


REFUSED = {
    "no force": (drop("force (N)"), "no contact force; name the column force"),
    "no position": (drop("position (m)"), "no positions; add a column position"),
    "no axes": (drop("time (s)", "position (m)"), "no positions"),
    "no time": (drop("time (s)"), "no time; add a column time"),
    "nothing": (drop("time (s)", "position (m)", "force (N)"), "no samples|no column of a record"),
    "falling": (scale("position (m)", -1), "as the train runs against the chainage; write the position as"),
    "kilonewtons in N": (scale("force (N)", 1e-3), "is in kilonewtons, name the unit: --unit force=kN"),
    "newtons in kN": (scale("force (N)", 1, "force (kN)"), "is in newtons, name the unit: --unit force=N"),
    "sign": (scale("force (N)", -1), "turn the sign of the column"),
    "too slow": (scale("position (m)", 1e-2), "columns swapped|outside 5 to 600"),
    "too fast": (scale("position (m)", 10), "outside 5 to 600"),
    "time and position": (
        swap("time (s)", "position (m)"),
        "with the two columns swapped it would be 180 km/h",
    ),
    "force and position": (swap("force (N)", "position (m)"), "never falls, as a position does"),
    "time falls": (
        scale("time (s)", -1),
        "does not rise, but the position does; check whether the two are swapped",
    ),
    "stands": (scale("position (m)", 0), "never changes; check the odometer"),
    "constant": (scale("force (N)", 0), "Column force never changes"),
    "speed": (add(**{"speed__(km/h)": np.full(5000, 50.0)}), "positions over time one of 180 km/h"),
    "short": (few(800), "takes 1.6 s; give a record of 2 s or more"),
    "two samples": (few(1), "No sample|one sample"),
    "slow sampling": (thin, "83.33 samples a second; any rate from 100 a second"),
    "uneven": (uneven, "Time steps are not equal"),
    "same runs": (twice, "have the same forces, sample by sample"),
    "a run again": (again, "Run 'a' begins twice, at samples 1 and 4001"),
    "heights in mm": (
        add(**{"height__(m)": 5300 + np.arange(5000) % 90}),
        "in millimetres, name the unit: --unit height=mm",
    ),
    "uplift in mm": (
        add(**{"uplift__(m)": np.arange(5000) % 90}),
        "in millimetres, name the unit: --unit uplift=mm",
    ),
    "both forces": (add(**{"force_1__(N)": np.arange(5000)}), "both force and force_1"),
    "never up": (add(raised=np.zeros(5000)), "No sample has a force of a raised pantograph"),
    "text": (add(**{"speed__(km/h)": ["x"] * 5000}), "holds 'x'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_one_sentence(name, columns, written):
    change, words = REFUSED[name]
    change(columns)
    with pytest.raises(InputError, match=words) as caught:
        read_record(written(columns or {"other": [1.0]}))
    sentence = str(caught.value)
    assert sentence.endswith(".")
    assert not {". ", "? "} & {sentence[k : k + 2] for k in range(len(sentence))}
    assert "record.csv" in sentence


def test_a_speed_of_0_gives_no_time(columns, written):
    del columns["time (s)"]
    columns["speed (m/s)"] = np.r_[np.full(4999, 50.0), 0.0]
    with pytest.raises(InputError, match="no time follows"):
        read_record(written(columns))


def test_times_that_repeat(columns, written):
    columns["time (s)"] = columns["time (s)"].round(2)
    with pytest.raises(InputError, match="Time does not increase at sample"):
        read_record(written(columns))


def test_runs_with_different_rates(columns, written):
    columns["run"] = ["a"] * 2500 + ["b"] * 2500
    columns["time (s)"] = np.r_[0.002 * np.arange(2500), 0.004 * np.arange(2500)]
    with pytest.raises(InputError, match="different rates, from 250 to 500"):
        read_record(written(columns))


def test_a_saved_run_is_not_a_record(run, tmp_path):
    run.save(tmp_path / "run.parquet")
    with pytest.raises(InputError, match="give it to `panto compare` as the run"):
        read_record(tmp_path / "run.parquet")


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"force (N)": ["x", "y"]}, "Column force of .* does not hold numbers"),
        ({"position (m)": [0.0, None]}, "Row 2 of .* column position is not a finite number"),
        ({"force": [1.0, 2.0]}, "has no unit"),
    ],
)
def test_a_parquet_file_that_csv_would_not_allow(columns, words, tmp_path):
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=words):
        read_record(tmp_path / "a.parquet")


def test_what_is_no_parquet(tmp_path):
    (tmp_path / "a.parquet").write_bytes(b"PAR1 and nothing else")
    with pytest.raises(InputError, match="could not be read as Parquet"):
        read_record(tmp_path / "a.parquet")
