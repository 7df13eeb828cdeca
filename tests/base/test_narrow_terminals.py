"""In a terminal of any width every number is whole: a table that does not fit becomes a list."""

import io
import re
from collections import Counter
from unittest import mock

import pytest
import rich.table
from rich.console import Group

from panto_env import terminal
from panto_env.base.table import Alarm, Table
from panto_env.terminal import PlainConsole, print_table

from ..command import panto
from ..fuzz.lines import SHORT

WIDTHS = (20, 27, 40, 60, 80)
NUMBER = re.compile(r"(?<![\w.])[+−-]?\d[\d,.]*\d|(?<![\w.])\d")
WORDS = ("mean force F_m (N)", "EN 50367, recalled", "102.3 to 157.3", "-0.707", "1,234,567.89", "broken", "")
COMMANDS = {
    "list": ["list"],
    "list of one": ["list", "en50318-2002"],
    "simulate": ["simulate", *SHORT],
    "sweep": ["sweep", "speed_kmh=200,250", "catenary.mean_stiffness=3000,4000", *SHORT],
    "list of a preset": ["list", "realistic"],
}


@pytest.fixture(autouse=True)
def console_without_a_width(monkeypatch):
    """A worker of pytest has COLUMNS from its start, which the console would keep."""
    monkeypatch.setattr("panto_env.terminal.console._width", None)


def printed(table, width):
    console = PlainConsole(width=width)
    with console.capture() as text:
        console.print(table)
    return text.get()


def numbers_of(text):
    """The numbers that are printed, but for those within long words such as a DOI."""
    words = (part for word in words_of(text) for part in word.split("=") if len(part) <= 18)
    return Counter(number for word in words for number in NUMBER.findall(word))


def words_of(text):
    """The words of what is printed, without the lines of a table."""
    return re.sub("[┃│━─┏┓┗┛┡┩┢┪├┤┼╇┳┻└┘┴╭╮╰╯]", " ", text).split()


@pytest.mark.parametrize("width", WIDTHS)
def test_every_word_of_a_table_is_whole_and_no_line_is_wider_than_the_terminal(width):
    for count in range(1, len(WORDS) + 1):
        table = rich.table.Table(title="Requirements at 300 km/h")
        for k in range(count):
            table.add_column(f"heading {k}", justify="left" if k == 0 else "right")
        for shift in range(3):
            table.add_row(*(WORDS[(k + shift) % len(WORDS)] for k in range(count)))
        text = printed(Group(table), width)
        assert max(map(len, text.splitlines())) <= width
        assert "…" not in text
        wanted = Counter(word for column in table.columns for cell in column.cells for word in cell.split())
        assert not wanted - Counter(words_of(text))


def test_a_row_of_a_list_is_its_name_and_one_value_per_line(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    rows = [("static force", 54.0, Alarm("broken")), ("uplift", 12.5, "")]
    print_table(Table("Forces", ("figure", "value (N)", "verdict of it"), rows))
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == [
        "Forces",
        "",
        "static force",
        "  value (N): 54",
        "  verdict of it:",
        "broken",
        "",
        "uplift",
        "  value (N): 12.5",
        "",
    ]


def test_a_long_name_is_folded_and_not_cut():
    table = rich.table.Table("model file", "step")
    path = "runs/" + "very-long-name-" * 5 + ".zip"
    table.add_row(path, "20000")
    for width in (20, 40, 60):
        text = printed(table, width)
        assert path in "".join(words_of(text.replace("20000", ""))), text
        assert "20000" in words_of(text)


@pytest.mark.parametrize("width", [20, 40])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_narrow_terminal_shows_every_number_that_a_wide_one_shows(name, width, monkeypatch):
    shown = {}
    for columns in (width, 400):
        monkeypatch.setenv("COLUMNS", str(columns))
        done = panto(*COMMANDS[name])
        assert done.returncode == 0, done.stderr
        shown[columns] = numbers_of(done.stdout)
    missing = shown[400] - shown[width]
    assert not missing
    assert sum(shown[400].values()) > 10


def test_a_heading_breaks_before_a_row_does():
    """At 120 columns, as where a span has its mast's name."""
    headings = ("where", *(f"statistical minimum {k} of all (N)" for k in range(8)))
    row = ("12 (17-23, 12+980.0): 680 to 745 m", *["100.0"] * 8)
    console = PlainConsole(width=120, file=io.StringIO())
    with mock.patch.object(terminal, "console", console):
        terminal.print_table(Table("", headings, [row]))
    lines = console.file.getvalue().splitlines()
    assert any(row[0] in line for line in lines)
    assert max(map(len, lines)) <= 120


def test_a_pipe_without_a_terminal_takes_wide_tables(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr("os.isatty", lambda file: False)
    assert PlainConsole().width >= 200


@pytest.mark.parametrize("width", [20, 40])
def test_help_in_a_narrow_terminal_cuts_no_option(width, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    text = panto("simulate", "--help").stdout
    assert "…" not in text
    assert "--line-condition" in text.split()
