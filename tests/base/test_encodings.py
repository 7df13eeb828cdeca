"""Whatever an output can show, a command's result gets there: characters degrade, and nothing fails."""

import io
import json
import os
import subprocess
import sys
import unicodedata
import warnings

import pytest

from panto_env import terminal as plain_characters
from panto_env.cli import main
from panto_env.terminal import plain, print_json

from ..documents import ROOT
from ..fuzz.lines import SHORT

ENCODINGS = {
    "Latin-1": {"PYTHONIOENCODING": "latin-1"},
    "cp1252": {"PYTHONIOENCODING": "cp1252"},
    "the C locale": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
}
RUN = ("simulate", *SHORT)
COMMANDS = {
    "help": ["--help"],
    "help of a command": ["oracle", "--help"],
    "all that can be named": ["list"],
    "one of it": ["list", "h-infinity"],
    "a file of the catalogue": ["list", "en50318-2002", "--toml"],
    "a run": RUN,
    "a table with Greek letters": ["oracle", "--stored"],
    "a result for a document": ["report", "--markdown", str(ROOT / "docs" / "benchmark" / "head.json")],
    "bad input": ["simulate", "--catenary", "σ≤−µ"],
}


def environment(**changes):
    kept = {key: each for key, each in os.environ.items() if not key.startswith(("LC_", "LANG", "PYTHON"))}
    return kept | changes


def panto(*arguments, **changes):
    """The command in a process of its own."""
    command = [sys.executable, "-c", "from panto_env.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, env=environment(**changes))


def command(*arguments, encoding, monkeypatch):
    """The same here: exit status, standard output and error, as bytes."""
    streams = {name: io.TextIOWrapper(io.BytesIO(), encoding=encoding) for name in ("stdout", "stderr")}
    for name, stream in streams.items():
        monkeypatch.setattr(sys, name, stream)
    monkeypatch.setattr(sys, "argv", ["panto", *arguments])
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    with pytest.raises(SystemExit) as ended:
        main()
    told = []
    for stream in streams.values():
        stream.flush()
        told.append(stream.buffer.getvalue())
    return ended.value.code, *told


def check(name, status, out, error):
    expected = 2 if name == "bad input" else 0
    assert status == expected, error[-2000:]
    assert b"Traceback" not in error
    told = error if expected else out
    assert told
    assert told.count(b"?") < 10  # questions of the texts
    return told


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "cp437", "ascii", "utf-8"])
def test_a_command_says_the_same_in_every_encoding(encoding, name, monkeypatch):
    told = check(name, *command(*COMMANDS[name], encoding=encoding, monkeypatch=monkeypatch))
    assert encoding != "ascii" or told.isascii()


@pytest.mark.parametrize(
    ("encoding", "name"),
    [("Latin-1", "a run"), ("cp1252", "help"), ("the C locale", "a table with Greek letters")],
)
def test_so_does_a_process_of_its_own(encoding, name):
    done = panto(*COMMANDS[name], **ENCODINGS[encoding])
    told = check(name, done.returncode, done.stdout, done.stderr)
    assert encoding != "the C locale" or told.isascii()


def test_figures_are_those_of_an_output_that_shows_all(monkeypatch):
    _, whole, _ = command(*RUN, encoding="utf-8", monkeypatch=monkeypatch)
    _, latin, _ = command(*RUN, encoding="latin-1", monkeypatch=monkeypatch)
    whole, latin = whole.decode(), latin.decode("latin-1")
    words = [word for word in whole.split() if word.isascii() and any(map(str.isalnum, word))]
    assert len(words) > 50
    assert set(words) <= set(latin.split())


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_json_is_exact_in_every_encoding(encoding, monkeypatch):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    table = {"σ ≤ 3": [1 / 3, "−µ┃é", None]}
    print_json(table)
    sys.stdout.flush()
    assert json.loads(raw.getvalue().decode(encoding)) == table


def test_all_characters_of_the_sources_have_a_plain_form():
    """But for those of tables of words in other scripts: none is lost as a question mark."""
    found = set()
    for folder in ("panto_env", "baselines", "agents"):
        for path in (ROOT / folder).rglob("*.py"):
            found |= {each for each in path.read_text(encoding="utf-8") if not each.isascii()}
    shown = {each: plain(each) for each in found}
    assert len(found) > 20
    assert all(each.isascii() for each in shown.values())
    assert {each: unicodedata.name(each) for each, form in shown.items() if form == "?"} == {}


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("σ ≤ −3 µm", "sigma <= -3 um"),
        ("m² – k₁", "m2 - k1"),
        ("é ü ø Å", "e u o A"),
        ("┏━┓┃│├┼", "+-+||++"),
        ("█▌", "##"),
        ("─╿▀▟■", "-+##?"),  # both ends of boxes and blocks, and what stands behind them
        ("漢", "?"),
        ("\udcff", "?"),
    ],
)
def test_what_a_character_becomes(text, shown):
    assert "".join(each if each.isascii() else plain(each) for each in text) == shown


def test_a_name_that_is_no_text_is_shown(monkeypatch):
    """Of a file whose name was written in another encoding."""
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="utf-8"))
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(io.BytesIO(), encoding="ascii"))
    plain_characters.show_always()
    print("\udcffσ")
    sys.stdout.flush()
    assert raw.getvalue().decode() == "?σ\n"
