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


def backwards(columns):
    columns.update({name: each[::-1] for name, each in columns.items()})


def in_pairs(columns):
    """Without a time, and each two rows in the wrong order."""
    del columns["time (s)"]
    order = np.arange(5000).reshape(-1, 2)[:, ::-1].ravel()
    columns.update({name: each[order] for name, each in columns.items()})
    columns["speed (m/s)"] = np.full(5000, 50.0)


def in_threes(columns):
    """As ``in_pairs``, with more steps that rise than steps that fall."""
    in_pairs(columns)
    order = np.r_[np.arange(4998).reshape(-1, 3)[:, [1, 2, 0]].ravel(), 4998, 4999]
    columns["position (m)"] = (1000 + 0.1 * np.arange(5000))[order]


def noise(columns):
    columns["position (m)"] = 1000 - 5 * columns["time (s)"] + 0.5 * (-1) ** np.arange(5000)


def sensors(*names):
    def change(columns):
        force = columns.pop("force (N)")
        columns.update({f"{name} ({'N' if name[0] == 'f' else 'm/s2'})": force for name in names})

    return change


def mostly_back(columns):
    columns["position (m)"] = np.cumsum(np.r_[np.full(2000, 0.2), np.full(3000, -0.1)])


def still_at_last(columns):
    del columns["time (s)"]
    columns["speed (m/s)"] = np.r_[np.full(4999, 50.0), 0.0]


def rounded(columns):
    columns["time (s)"] = columns["time (s)"].round(2)


def two_rates(columns):
    columns["run"] = ["a"] * 2500 + ["b"] * 2500
    columns["time (s)"] = np.r_[0.002 * np.arange(2500), 0.004 * np.arange(2500)]


def again(columns):
    columns["run"] = ["a"] * 2000 + ["b"] * 2000 + ["a"] * 1000


REFUSED = {
    "no force": (drop("force (N)"), "no contact force; name the column force"),
    "no position": (drop("position (m)"), "no positions; add a column position"),
    "no axes": (drop("time (s)", "position (m)"), "no positions"),
    "no time": (drop("time (s)"), "no time; add a column time"),
    "nothing": (
        drop("time (s)", "position (m)", "force (N)"),
        "no samples|no column of a record; .*--column",
    ),
    "falling": (
        scale("position (m)", -1),
        "falls from -1000 to -1499.9 m, as the train runs against the chainage; write the position as that "
        "of a support minus each, best of the last support before the record begins",
    ),
    "rows backwards": (backwards, "rows run backwards in time, from 9.998 to 0 s; sort them by time"),
    "rows in pairs": (
        in_pairs,
        "falls at 2,500 samples and rises at 2,499, in turn, .* sort them by position",
    ),
    "rows in threes": (in_threes, "in turn, so the rows are not in the order in which a train runs"),
    "a position without order": (noise, "in turn, .* check whether it is the right column"),
    "six sensors": (
        sensors(*[f"force_{k}" for k in range(1, 7)]),
        r"Column force_5 of .* from 1 to 4, give more than 4 as their sum as one column force \(N\)",
    ),
    "sensor 0": (sensors("Force 0", "Force 1"), "Column force_0 of .* is of no sensor that is read"),
    "sensor 01": (sensors("f01", "f2"), "Column force_01 of .* is of no sensor that is read"),
    "a fifth accelerometer": (
        sensors("force_1", "acceleration_5"),
        r"Column acceleration_5 of .* as their mean as one column acceleration_1 \(m/s2\)",
    ),
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
    "mostly backwards": (mostly_back, "The position falls at most samples, as the train runs against"),
    "a speed of 0": (still_at_last, "no time follows"),
    "times that repeat": (rounded, "Time does not increase at sample"),
    "two rates": (two_rates, "different rates, from 250 to 500"),
    "both forces": (add(**{"force_1__(N)": np.arange(5000)}), "both force and force_1"),
    "never up": (add(raised=np.zeros(5000)), "No sample has a force of a raised pantograph"),
    "text": (add(**{"speed__(km/h)": ["x"] * 5000}), "holds 'x'"),
}


@pytest.mark.longer
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


def test_decimal_commas_between_commas(columns, tmp_path):
    rows = [
        f"{2 * k},{x:.2f},{f:.1f}" for k, (x, f) in enumerate(zip(*list(columns.values())[1:], strict=True))
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time (ms),position (m),force (N)", *rows]).replace(".", ","))
    with pytest.raises(
        InputError, match=r"Line 2 of .* has 5 cells under 3 headings; where commas are decimal"
    ):
        read_record(path)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"force (N)": ["x", "y"]}, "Column force of .* does not hold numbers"),
        ({"position (m)": [0.0, None]}, "Row 2 of .* column position is not a finite number"),
        ({"force": [1.0, 2.0]}, "has no unit"),
        ({"force_1 (N)": [1.0], "force_5 (N)": [1.0]}, "Column force_5 of .* is of no sensor that is read"),
    ],
)
def test_a_parquet_file_that_csv_would_not_allow(columns, words, tmp_path):
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=words):
        read_record(tmp_path / "a.parquet")
    (tmp_path / "a.parquet").write_bytes(b"PAR1 and nothing else")
    with pytest.raises(InputError, match="could not be read as Parquet"):
        read_record(tmp_path / "a.parquet")
