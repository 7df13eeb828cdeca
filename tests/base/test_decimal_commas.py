"""Files of a country with decimal commas, and of editors that begin a file with a byte-order mark."""

import numpy as np
import pytest

from panto_env import InputError
from panto_env.base.files import read_toml
from panto_env.base.record_columns import LENGTHS, TIME, Column, read_columns
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.loader import text_of

FLAT = ", ".join(9 * ["0.0"])
COLUMNS = {"time": TIME, "head": Column(("head",), LENGTHS, "mm")}


def test_a_byte_order_mark_is_no_part_of_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text_of("re250"), encoding="utf-8-sig")
    assert load_catenary(path).contact_wire == load_catenary("re250").contact_wire


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("a = 1\nmass = 1,35\n", "1.35"),
        ("mass = 1,35", "1.35"),
        ("a = 1\r\nmass = 1,35 # kg/m\r\n", "1.35"),
        ("[wire]\nmass = { value = 1,35, source = 'x' }\n", "1.35"),
        ("sag = [0,024, 0,041]\n", "0.024"),
    ],
)
def test_a_decimal_comma_in_a_toml_file_is_named(text, number, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(text.encode())
    with pytest.raises(InputError, match=f"decimals need a point, not a comma, as in {number}"):
        read_toml(path)


def test_other_errors_do_not_speak_of_commas(tmp_path):
    path = tmp_path / "mine.toml"
    for text in ("a = [", "a = 1 2 # 1,5\n", "a\nb = 1,5\n"):
        path.write_text(text)
        with pytest.raises(InputError, match="correct the file"):
            read_toml(path)


def test_a_list_that_a_decimal_comma_made_twice_as_long_is_noticed(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text_of("dsa250").replace("[7.51, 5.855, 4.645]", "[7,5, 5,8, 4,6]"))
    with pytest.raises(InputError, match=r"but 3 stiffnesses \(decimals need a point: a comma"):
        load_pantograph(path)
    path.write_text(text_of("en50318-2002").replace(FLAT, ", ".join(9 * ["0,0"])))
    with pytest.raises(InputError, match=r"9 positions are given, but 18 sags \(decimals need a point"):
        load_catenary(path)
    path.write_text(text_of("en50318-2002").replace(FLAT, "0.0, 0.0"))
    with pytest.raises(InputError, match="9 positions are given, but 2 sags") as caught:
        load_catenary(path)
    assert "decimals" not in str(caught.value)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_between_semicolons_are_read(separator, tmp_path):
    path = tmp_path / "record.csv"
    rows = ["time (s);head (mm)", "0;1,5", "0,001;-2,25", "0,002;3e1", "0,003;4"]
    path.write_text("\n".join(rows).replace(";", separator), encoding="utf-8-sig")
    found = read_columns(path, COLUMNS)
    assert found["time"] == pytest.approx([0, 1e-3, 2e-3, 3e-3], abs=1e-15)
    assert found["head"] == pytest.approx(1e-3 * np.array([1.5, -2.25, 30, 4]))


@pytest.mark.parametrize(
    ("rows", "line", "shown"),
    [
        (["time (s);head (mm)", "0.0;1.5", "0.001;2,25"], 3, "2,25"),  # which of the two is meant?
        (["time (s);head (mm)", "0,0;1.234,5"], 2, "0,0"),
        (["time (s);head (mm)", "0,0;1,234,5"], 2, "1,234,5"),
    ],
)
def test_both_signs_in_a_file_are_refused(rows, line, shown, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("\n".join(rows))
    with pytest.raises(InputError, match=f"Line {line} of .* holds '{shown}', which is not a finite number"):
        read_columns(path, COLUMNS)


@pytest.mark.parametrize(
    ("rows", "line", "cells"),
    [
        (["0,0,1,5"], 2, 4),  # decimal commas in both columns
        (["1,2", "# a remark", "", "2,1,5"], 5, 3),
        (["0.0,1.5", "0.1,1,234.5"], 3, 3),  # a comma between thousands
        (["0.0;1.5;2"], 2, 3),
        (["1,5,"], 2, 3),  # without a point anywhere, the comma may be decimal
    ],
)
def test_more_cells_than_headings_are_refused(rows, line, cells, tmp_path):
    path = tmp_path / "record.csv"
    header = "time (s);head (mm)" if ";" in rows[0] else "time (s),head (mm)"
    path.write_text("\n".join([header, *rows]))
    with pytest.raises(
        InputError, match=f"Line {line} of .* has {cells} cells under 2 headings; where commas"
    ):
        read_columns(path, COLUMNS)


@pytest.mark.parametrize(
    "text", ["time (s),head (mm)\n0.5,1,\n1,2 , ,\n", "time (s);head (mm)\n0,5;1;\n1;2\n"]
)
def test_a_separator_at_the_end_of_a_line_is_no_cell(text, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(text)
    found = read_columns(path, COLUMNS)
    assert found["time"] == pytest.approx([0.5, 1])
    assert found["head"] == pytest.approx([1e-3, 2e-3])


def test_a_point_in_a_column_that_is_not_read_does_not_count(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("time (s);note;head (mm)\n0,5;no. 1;2,5\n")
    assert read_columns(path, COLUMNS)["head"] == pytest.approx([2.5e-3])
