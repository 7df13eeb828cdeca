"""Names in files that may be anyone's: what would tell a terminal to do something is escaped."""

import io
import json
import sys
import unicodedata

import pytest
import rich.table

from panto_baselines.report.page import report
from panto_env.base.checksums import read_checked, with_checksum
from panto_env.base.errors import harmless, one_line
from panto_env.terminal import PlainConsole, alert, say

from ..documents import ROOT

HOSTILE = "\x1b]0;owned\x07\x1b[2J\u202efast\r\x9b31m\x7f"
ESCAPED = r"\x1b]0;owned\x07\x1b[2J\u202efast\r\x9b31m\x7f"
HEAD = ROOT / "docs" / "benchmark" / "head.json"


def test_controls_are_escaped_and_line_ends_stay():
    assert harmless(f"a\n{HOSTILE}\nσ – 列") == f"a\n{ESCAPED}\nσ – 列"


def test_every_control_and_every_turn_of_the_writing_is_escaped():
    """Those of Unicode's categories, but for the line end, and of its property Bidi_Control."""
    letters = map(chr, range(sys.maxunicode))
    controls = {letter for letter in letters if unicodedata.category(letter) == "Cc"}
    turning = {
        chr(int(code, 16)) for code in ["061C", "200E", "200F", "202A", "202B", "202C", "202D", "202E"]
    }
    turning |= {chr(code) for code in range(0x2066, 0x206A)}
    for letter in sorted(controls - {"\n"} | turning):
        assert harmless(f"a{letter}b") == f"a{ascii(letter)[1:-1]}b"
        assert one_line(f"a{letter}b") == f"a{ascii(letter)[1:-1]}b"
    assert harmless("\n") == "\n"


@pytest.mark.parametrize("terminal", [True, False])
def test_a_console_prints_none_of_them(terminal):
    table = rich.table.Table(HOSTILE, title=HOSTILE, caption=HOSTILE)
    table.add_row(HOSTILE)
    said = io.StringIO()
    console = PlainConsole(file=said, width=200, force_terminal=terminal, color_system=None)
    console.print(HOSTILE, table)
    alert(HOSTILE, HOSTILE, console)
    assert said.getvalue().count(ESCAPED) == 5
    text = ESCAPED.replace(r"\x07", "").replace(r"\r", "")  # Rich takes these out of its texts by itself
    assert said.getvalue().count(text) == 2
    assert all(letter.isprintable() for letter in said.getvalue().replace("\n", ""))


def test_what_is_said_has_none_of_them(capsys):
    say(HOSTILE)
    assert capsys.readouterr().err == f"panto: {ESCAPED}\n"


def test_a_hostile_result_of_a_benchmark(tmp_path, capsys):
    named = json.dumps(read_checked(HEAD)).replace('"tuned-pd"', json.dumps(HOSTILE))
    path = tmp_path / "result.json"
    path.write_text(json.dumps(with_checksum(json.loads(named))))
    report([path], markdown=True)
    said = capsys.readouterr().out
    assert ESCAPED in said
    assert "\x1b" not in said
