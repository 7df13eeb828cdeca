"""Tables for other programs: what they read is what was written, with units, and nothing runs."""

import math
import shutil
import subprocess
import zipfile

import numpy as np
import openpyxl
import pandas
import pytest

from panto_env import InputError
from panto_env.base import table as table_file
from panto_env.base.table import TABLES, Sheet, write_rows, write_table, write_workbook

LIBREOFFICE = shutil.which("libreoffice") or shutil.which("soffice")
READ = {".csv": pandas.read_csv, ".xlsx": pandas.read_excel, ".parquet": pandas.read_parquet}
FORMULAS = ["=1+1", "+1+1", "-1+1", "@SUM(1)", '=cmd|"/c calc"!A1', "\t=1+1"]
ROWS = [
    {"policy": "pd", "mean": 1 / 3, "std": math.nan, "ended": False, "seed": 0},
    {"policy": "passive", "mean": -2e-9, "std": 20.5, "ended": True, "seed": 7},
]
HEADINGS = {"mean": "mean (N)", "std": "std (N)"}


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


def test_text_never_becomes_a_formula(tmp_path):
    sheet = Sheet("table", {"name": FORMULAS, "=A1": list(range(len(FORMULAS)))})
    write_table(sheet, tmp_path / "table.xlsx")
    page = openpyxl.load_workbook(tmp_path / "table.xlsx").active
    cells = [row[0] for row in page.iter_rows(min_row=2)]
    assert [cell.data_type for cell in cells] == ["s"] * len(FORMULAS)
    assert [cell.value for cell in cells] == FORMULAS
    assert "<f>" not in zipfile.ZipFile(tmp_path / "table.xlsx").read("xl/worksheets/sheet1.xml").decode()
    write_table(sheet, tmp_path / "table.csv")
    frame = pandas.read_csv(tmp_path / "table.csv")
    assert frame["name"].tolist() == [f"'{text}" for text in FORMULAS]
    assert list(frame) == ["name", "'=A1"]


def test_negative_numbers_are_numbers_in_csv(tmp_path):
    write_rows([{"force": -5.0}], tmp_path / "table.csv", {"force": "force (N)"})
    assert (tmp_path / "table.csv").read_text() == '"force (N)"\n-5\n'


def test_only_a_file_with_more_than_ascii_begins_with_a_mark(tmp_path):
    for text, marked in (("sigma", False), ("σ", True)):
        write_rows([{"name": text}], tmp_path / "table.csv")
        assert (tmp_path / "table.csv").read_bytes().startswith(b"\xef\xbb\xbf") is marked
        assert pandas.read_csv(tmp_path / "table.csv")["name"].tolist() == [text]


def test_the_same_tables_give_the_same_workbook(tmp_path):
    for name in ("one.xlsx", "two.xlsx"):
        write_rows(ROWS, tmp_path / name)
    assert (tmp_path / "one.xlsx").read_bytes() == (tmp_path / "two.xlsx").read_bytes()


def test_infinite_numbers_are_shown_as_such(tmp_path):
    rows = [{"c": math.inf}, {"c": -math.inf}]
    write_rows(rows, tmp_path / "table.csv")
    assert pandas.read_csv(tmp_path / "table.csv")["c"].tolist() == [math.inf, -math.inf]
    write_rows(rows, tmp_path / "table.xlsx")
    page = openpyxl.load_workbook(tmp_path / "table.xlsx").active
    assert [row[0].value for row in page.iter_rows(min_row=2)] == ["inf", "-inf"]


def test_what_excel_cannot_hold_is_refused_and_the_old_file_stays(tmp_path, monkeypatch):
    path = tmp_path / "table.xlsx"
    path.write_text("mine")
    monkeypatch.setattr(table_file, "MOST_ROWS", 3)
    with pytest.raises(InputError, match=r"at most 3 rows .* this table has 4"):
        write_table(Sheet("table", {"x": np.arange(3)}), path)
    with pytest.raises(InputError, match="too long for a cell"):
        write_table(Sheet("table", {"x": ["a" * 40_000]}), path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_a_workbook_that_fails_half_way_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "table.xlsx"
    path.write_text("mine")
    monkeypatch.setattr(table_file, "_write", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_rows(ROWS, path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"must end in one of \.csv, \.xlsx, \.parquet"):
        write_rows(ROWS, tmp_path / "table.ods")


@pytest.mark.skipif(LIBREOFFICE is None, reason="LibreOffice is not installed")
def test_libreoffice_reads_sheets_and_evaluates_nothing(tmp_path):
    """What its reader makes of a workbook and of a CSV: the same cells, no formula evaluated."""
    texts = Sheet("texts", {"name": FORMULAS[:5]})
    write_workbook([Sheet.of_rows("rows", ROWS, HEADINGS), texts], tmp_path / "book.xlsx")
    write_table(texts, tmp_path / "texts.csv")
    out, home = tmp_path / "out", f"-env:UserInstallation=file://{tmp_path}/home"
    every_sheet = "csv:Text - txt - csv (StarCalc):44,34,76,1,,0,false,true,false,false,false,-1"
    for file, kind in (("book.xlsx", every_sheet), ("texts.csv", "xlsx")):
        command = [LIBREOFFICE, home, "--headless", "--convert-to", kind, "--outdir", out, tmp_path / file]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
    rows = pandas.read_csv(out / "book-rows.csv")
    assert list(rows) == ["policy", "mean (N)", "std (N)", "ended", "seed"]
    assert rows["mean (N)"].tolist() == pytest.approx([1 / 3, -2e-9])
    assert pandas.read_csv(out / "book-texts.csv")["name"].tolist() == FORMULAS[:5]
    cells = openpyxl.load_workbook(out / "texts.xlsx").active
    assert all(row[0].data_type == "s" for row in cells.iter_rows(min_row=2))
