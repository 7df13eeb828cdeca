from panto_env.base.table import Table
from panto_env.terminal import console, print_table


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
