import pytest

from panto_env.base.errors import listed
from panto_env.base.table import Alarm, Table
from panto_env.terminal import console, number, print_table


def test_a_number_that_is_rounded_to_0_has_no_sign():
    rows = [
        (Alarm("-0.0"), -0.0, f"{-0.04:+.1f} to {-0.01:.0f} %", "-0.04", "M-0", "5-0", "1e-0"),
        ("−0", 1.0, *5 * ("",)),
    ]
    shown = Table("", ("a",) * 7, rows).cells
    assert shown[0] == ("0.0", "0", "0.0 to 0 %", "-0.04", "M-0", "5-0", "1e-0")
    assert isinstance(shown[0][0], Alarm)
    assert shown[1][0] == "0"
    assert (number(-0.04), number(-0.4, 0), number(-0.06)) == ("0.0", "0", "-0.1")


@pytest.mark.parametrize(
    ("names", "text"),
    [(["a"], "a, which is"), (["a", "b"], "a and b, which are"), ("abc", "a, b and c, which are")],
)
def test_names_as_a_clause(names, text):
    assert listed(names) == text


def test_a_table_is_markdown_with_numbers_to_four_digits():
    table = Table("Forces", ("case", "F (N)"), [("slow", 123.456), ("fast", "–")])
    assert table.markdown.splitlines() == [
        "| case | F (N) |",
        "| --- | ---: |",
        "| slow | 123.5 |",
        "| fast | – |",
    ]


def test_a_printed_table_aligns_text_left_and_figures_right(capsys, monkeypatch):
    monkeypatch.setattr(console, "_width", 60)
    print_table(
        Table("Forces", ("case", "unit", "F"), [("slow", "N", 1.5), ("b", "kN", 12.0)], text_columns=2)
    )
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].strip() == "Forces"
    assert "│ slow │ N    │ 1.5 │" in lines
    assert "│ b    │ kN   │  12 │" in lines
