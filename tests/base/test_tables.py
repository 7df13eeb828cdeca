"""Tables: as they are printed in a terminal, written for other programs, and read from text."""

import math
import re
import zipfile
from collections import Counter

import numpy as np
import openpyxl
import pandas
import pytest
import rich.table

from panto_env import InputError
from panto_env.base import table as table_file
from panto_env.base.errors import listed
from panto_env.base.record_columns import LENGTHS, TIME, Column, read_columns
from panto_env.base.table import TABLES, Alarm, Sheet, Table, number, write_rows, write_table
from panto_env.estimation.motion import read_motion
from panto_env.identification.record import read_record
from panto_env.terminal import PlainConsole, print_table

from ..command import panto
from ..fuzz.lines import SHORT

READ = {".csv": pandas.read_csv, ".xlsx": pandas.read_excel, ".parquet": pandas.read_parquet}
FORMULAS = ["=1+1", "+1+1", "-1+1", "@SUM(1)", '=cmd|"/c calc"!A1', "\t=1+1"]
ROWS = [
    {"policy": "pd", "mean": 1 / 3, "std": math.nan, "ended": False, "seed": 0},
    {"policy": "passive", "mean": -2e-9, "std": 20.5, "ended": True, "seed": 7},
]
HEADINGS = {"mean": "mean (N)", "std": "std (N)"}
COLUMNS = {"time": TIME, "head": Column(("head",), LENGTHS, "mm")}


# --- printed ----------------------------------------------------------------------------------------


def test_a_number_that_is_rounded_to_0_has_no_sign():
    rows = [(Alarm("-0.0"), -0.0, f"{-0.04:+.1f} to {-0.01:.0f} %", "−0", "-0.04", "M-0", "5-0", "1e-0")]
    (shown,) = Table("", ("a",) * 8, rows).cells
    assert shown == ("0.0", "0", "0.0 to 0 %", "0", "-0.04", "M-0", "5-0", "1e-0")
    assert isinstance(shown[0], Alarm)
    assert (number(-0.04), number(-0.4, 0), number(-0.06)) == ("0.0", "0", "-0.1")


def test_names_as_a_clause():
    assert listed(["a"]) == "a, which is"
    assert listed(["a", "b", "c"]) == "a, b and c, which are"


def test_a_table_is_markdown_and_is_printed_with_figures_at_the_right(capsys, monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 60)
    table = Table(
        "Forces", ("case", "unit", "F"), [("slow", "N", 123.456), ("b", "kN", 12.0)], text_columns=2
    )
    assert table.markdown.splitlines() == [
        "| case | unit | F |",
        "| --- | --- | ---: |",
        "| slow | N | 123.5 |",
        "| b | kN | 12 |",
    ]
    print_table(table)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].strip() == "Forces"
    assert {"│ slow │ N    │ 123.5 │", "│ b    │ kN   │    12 │"} <= set(lines)


def test_a_table_that_does_not_fit_is_a_list(capsys, monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 20)
    rows = [("static force", 54.0, Alarm("broken")), ("uplift", 12.5, "")]
    print_table(Table("Forces", ("figure", "value (N)", "verdict of it"), rows))
    shown = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert shown[:4] == ["Forces", "", "static force", "  value (N): 54"]
    assert shown[-3:] == ["uplift", "  value (N): 12.5", ""]


def test_a_narrow_terminal_shows_every_number_that_a_wide_one_shows(monkeypatch):
    words, shown = ["simulate", *SHORT], {}
    for width in (40, 400):
        monkeypatch.setattr("panto_env.terminal.console._width", width)
        text = re.sub("[┃│━─┏┓┗┛┡┩┢┪├┤┼╇┳┻└┘┴╭╮╰╯]", " ", panto(*words).stdout)
        shown[width] = Counter(word for word in text.split() if re.fullmatch(r"[+−-]?\d[\d,.]*", word))
    assert sum(shown[400].values()) > 10
    assert not shown[400] - shown[40]


def test_a_heading_breaks_before_a_row_does_and_a_long_name_is_folded(capsys):
    table = rich.table.Table("where", *(f"statistical minimum {k} of all (N)" for k in range(8)))
    table.add_row("12 (17-23, 12+980.0): 680 to 745 m", *["100.0"] * 8)
    PlainConsole(width=120).print(table)
    lines = capsys.readouterr().out.splitlines()
    assert any("12 (17-23, 12+980.0): 680 to 745 m" in line for line in lines)
    assert max(map(len, lines)) <= 120
    table, path = rich.table.Table("model file", "step"), "runs/" + "very-long-name-" * 5 + ".zip"
    table.add_row(path, "20000")
    PlainConsole(width=40).print(table)
    assert path in re.sub(r"[\s│]|20000", "", capsys.readouterr().out)


def test_a_pipe_without_a_terminal_takes_wide_tables(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr("os.isatty", lambda file: False)
    assert PlainConsole().width >= 200


# --- written ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", TABLES)
def test_pandas_reads_what_was_written(suffix, tmp_path):
    path = tmp_path / f"table{suffix}"
    write_rows(ROWS, path, HEADINGS)
    frame = READ[suffix](path)
    names = ["policy", "mean", "std", "ended", "seed"]
    assert list(frame) == (names if suffix == ".parquet" else [HEADINGS.get(name, name) for name in names])
    mean, std = frame.iloc[:, 1], frame.iloc[:, 2]
    assert mean.tolist() == pytest.approx([1 / 3, -2e-9], rel=1e-14)
    assert std.isna().tolist() == [True, False]
    assert (frame["ended"].tolist(), frame["seed"].tolist()) == ([False, True], [0, 7])


def test_text_never_becomes_a_formula_nor_a_link(tmp_path):
    sheet = Sheet("table", {"name": FORMULAS, "=A1": list(range(len(FORMULAS)))})
    write_table(sheet, tmp_path / "table.xlsx")
    page = openpyxl.load_workbook(tmp_path / "table.xlsx").active
    cells = [row[0] for row in page.iter_rows(min_row=2)]
    assert [(cell.data_type, cell.value) for cell in cells] == [("s", text) for text in FORMULAS]
    assert "<f>" not in zipfile.ZipFile(tmp_path / "table.xlsx").read("xl/worksheets/sheet1.xml").decode()
    write_table(sheet, tmp_path / "table.csv")
    frame = pandas.read_csv(tmp_path / "table.csv")
    assert frame["name"].tolist() == [f"'{text}" for text in FORMULAS]
    assert list(frame) == ["name", "'=A1"]
    write_table(Sheet("table", {"site": ["https://example.org"]}), tmp_path / "link.xlsx")
    assert openpyxl.load_workbook(tmp_path / "link.xlsx").active["A2"].hyperlink is None


def test_numbers_are_numbers_in_csv_and_only_more_than_ascii_has_a_mark(tmp_path):
    path = tmp_path / "table.csv"
    write_rows([{"force": -5.0}], path, {"force": "force (N)"})
    assert path.read_bytes() == b'"force (N)"\n-5\n'
    write_rows([{"name": "σ"}], path)
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    assert pandas.read_csv(path)["name"].tolist() == ["σ"]


def test_workbooks_are_the_same_bytes_and_show_infinite_numbers(tmp_path):
    rows = [*ROWS, ROWS[0] | {"mean": math.inf}, ROWS[0] | {"mean": -math.inf}]
    one, two = tmp_path / "one.xlsx", tmp_path / "two.xlsx"
    for path in (one, two):
        write_rows(rows, path)
    assert one.read_bytes() == two.read_bytes()
    page = openpyxl.load_workbook(one).active
    assert [row[1].value for row in page.iter_rows(min_row=4)] == ["inf", "-inf"]


def test_what_excel_cannot_hold_is_refused_and_the_old_file_stays(tmp_path, monkeypatch):
    assert (table_file.MOST_ROWS, table_file.MOST_COLUMNS) == (1_048_576, 16_384)
    path = tmp_path / "table.xlsx"
    path.write_text("mine")
    monkeypatch.setattr(table_file, "MOST_ROWS", 3)
    with pytest.raises(InputError, match=r"at most 3 rows .* this table has 4"):
        write_table(Sheet("table", {"x": np.arange(3)}), path)
    with pytest.raises(InputError, match="too long for a cell"):
        write_table(Sheet("table", {"x": ["a" * 40_000]}), path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(InputError, match=r"must end in one of \.csv, \.xlsx, \.parquet"):
        write_rows(ROWS, tmp_path / "table.ods")


# --- read from text ---------------------------------------------------------------------------------


@pytest.fixture
def read(tmp_path):
    """Reads a table of time and head from its lines."""

    def of(*lines, encoding="utf-8-sig"):
        (tmp_path / "record.csv").write_text("\n".join(lines), encoding=encoding)
        return read_columns(tmp_path / "record.csv", COLUMNS)

    return of


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_between_semicolons_are_read(separator, read):
    rows = ["time (s);note;head (mm)", "0;no. 1;1,5", "0,001;;-2,25", "0,002;;3e1;", "0,003;;4"]
    found = read(*(row.replace(";", separator) for row in rows))
    assert found["time"] == pytest.approx([0, 1e-3, 2e-3, 3e-3], abs=1e-15)
    assert found["head"] == pytest.approx(1e-3 * np.array([1.5, -2.25, 30, 4]))


def test_a_separator_at_the_end_of_a_line_is_no_cell(read):
    assert read("time (s),head (mm)", "0.5,1,", "1,2 , ,")["head"] == pytest.approx([1e-3, 2e-3])


SHOWN = "holds '{}', which is not a finite number"
CELLS = "has {} cells under 2 headings; where commas"


@pytest.mark.parametrize(
    ("rows", "line", "message"),
    [
        (["0.0;1.5", "0.001;2,25"], 3, SHOWN.format("2,25")),  # which of the two is meant?
        (["0,0;1.234,5"], 2, SHOWN.format("0,0")),
        (["0,0;1,234,5"], 2, SHOWN.format("1,234,5")),
        (["0,0,1,5"], 2, CELLS.format(4)),  # decimal commas in both columns
        (["1,2", "# a remark", "", "2,1,5"], 5, CELLS.format(3)),
        (["0.0,1.5", "0.1,1,234.5"], 3, CELLS.format(3)),  # a comma between thousands
        (["0.0;1.5;2"], 2, CELLS.format(3)),
        (["1,5,"], 2, CELLS.format(3)),  # without a point anywhere, the comma may be decimal
    ],
)
def test_commas_that_may_be_decimal_are_refused_with_the_line(rows, line, message, read):
    header = "time (s);head (mm)" if ";" in rows[0] else "time (s),head (mm)"
    with pytest.raises(InputError, match=f"Line {line} of .* {message}"):
        read(header, *rows)


def record():
    t = 0.01 * np.arange(40)
    cells = zip(t, 100 + np.sin(t), np.sin(t), np.cos(t), np.sin(2 * t), strict=True)
    rows = [",".join(f"{cell:.4f}" for cell in row) for row in cells]
    return ["time (s),force (N),y_p1 (mm),y_p2 (mm),y_p3 (mm)", *rows]


def with_line(number, change):
    rows = record()
    rows[number] = change(rows[number])
    return "\n".join(rows).encode()


OPEN = "^Line {} of .*record.csv has a quotation mark without"
DAMAGED = {
    "a quotation mark in the header": (with_line(0, lambda row: '"' + row), OPEN.format(1)),
    "a quotation mark before a cell": (with_line(5, lambda row: row.replace(",", ',"', 1)), OPEN.format(6)),
    "a cell without end": (with_line(5, lambda row: row + "0" * 200_000), "a cell without end"),
    "text in a row": (with_line(5, lambda row: row.replace(",", ",x", 1)), "^Line 6 of .* holds 'x"),
    "a row cut off": (with_line(5, lambda row: row[:8]), "^Line 6 of .* is empty"),
    "infinity in a row": (with_line(5, lambda row: "inf" + row[4:]), "^Line 6 of .* holds 'inf"),
    "zeros in a row": (with_line(5, lambda row: row.replace("0", "\0")), "it is not text"),
    "half a letter of UTF-16": ("\n".join(record()).encode("utf-16")[:-1], "it is not text"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20, "it is not text"),
    "nothing": (b"", "is empty"),
    "a header alone": (record()[0].encode(), "0 samples|too few"),
    "no unit": (with_line(0, lambda row: row.replace("time (s)", "time")), "Column time of .* has no unit"),
    "a column twice": (with_line(0, lambda row: row.replace("force (N)", "y_p1 (mm)")), "twice; keep one"),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_record_is_refused_in_one_sentence(damage, tmp_path):
    path = tmp_path / "record.csv"
    content, message = DAMAGED[damage]
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_record(path)
    with pytest.raises(InputError):
        read_motion(path, 100.0)


def test_quotation_marks_in_pairs_are_read(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("\n".join(record()))
    plain = read_record(path)
    path.write_text("\n".join(",".join(f'"{cell}"' for cell in row.split(",")) for row in record()))
    assert read_record(path).plate.tolist() == plain.plate.tolist()
