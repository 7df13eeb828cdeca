"""A run shown in the terminal: it shows the run, changes nothing of it, and leaves the terminal as it was."""

import fcntl
import os
import pty
import signal
import struct
import sys
import termios
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from panto_env import Trajectory, simulate
from panto_env.metrics.low_pass import low_pass
from panto_env.render import strip as live_module
from panto_env.render.moment import felt
from panto_env.render.strip import EMPTY, FORCE_ROWS, Strip, chart, live

from ..cli.test_cli import panto
from .test_render import driven

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
HIDE, SHOW = b"\x1b[?25l", b"\x1b[?25h"


def text(thing, width=80):
    console = Console(file=StringIO(), width=width)
    console.print(thing)
    return console.file.getvalue()


def dots(rows):
    """Heights of the dots of a chart from below, by column of dots, as (level, column)."""
    found = set()
    for row, line in enumerate(rows):
        for column, character in enumerate(line.plain.partition("│")[2]):
            code = ord(character) - ord(EMPTY)
            for bit, (y, x) in enumerate([(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (3, 0), (3, 1)]):
                if code >> bit & 1:
                    found.add((4 * len(rows) - 1 - 4 * row - y, 2 * column + x))
    return found


def test_a_curve_is_where_its_values_are():
    level = chart(np.arange(10) + 0.1, np.full(10, 30.0), (0.0, 39.0), 10, 10)
    assert dots(level) == {(30, 2 * k) for k in range(10)}
    steep = chart(np.array([0.0, 3.6]), np.array([0.0, 39.0]), (0.0, 39.0), 10, 10)
    assert dots(steep) == {(0, 0), *((k, 7) for k in range(40))}
    beyond = chart(np.array([0.0, 5.0]), np.array([-500.0, -500.0]), (0.0, 39.0), 10, 10)
    assert dots(beyond) == {(0, 0), (0, 10)}


def test_a_level_line_does_not_hide_the_curve():
    rows = chart(np.arange(5.0), np.full(5, 20.0), (0.0, 20.0), 3, 10, 20.0)
    told = rows[0].plain.partition("│")[2]
    assert set(told[:5]) != {"╌"}
    assert told[5:] == "╌" * 5
    assert rows[0].plain.startswith("     20")


def test_what_is_shown_is_what_the_run_has():
    task, run = driven(450), simulate(distance=380.0)
    contact = felt(task, 0, 3.0)
    shown = (run.position > 4.5 * 300 / 3.6 - 180) & (run.position < 4.5 * 300 / 3.6)
    for name in ("force", "head"):
        whole = run.contact_force if name == "force" else run.head
        np.testing.assert_allclose(getattr(contact, name), whole[shown], rtol=1e-4, atol=1e-6)
    filtered = low_pass(run.contact_force, run.time_step)[shown]
    np.testing.assert_allclose(contact.filtered, filtered, atol=0.1)  # that starts half a second before
    told = text(Strip(task, "passive"))
    assert "en50318-2002 on en50318-2002 at 300 km/h, policy passive" in told
    assert f"4.50 s  375 m, span 7  force {contact.filtered[-1]:.0f} N" in told
    assert f"mean {contact.filtered.mean():.0f} N, σ {contact.filtered.std():.0f} N" in told
    assert "195 m" in told
    assert "375 m" in told


def test_lost_contact_is_marked():
    task = driven(200, catenary="shinkansen-simple", line_condition="new", speed_kmh=300.0)
    calm = text(Strip(task, "passive")).splitlines()[3 + FORCE_ROWS]
    view = Strip(task, "passive")
    view._felt.force[len(view._felt.force) // 2] = 0.0
    assert calm.strip() == ""
    assert text(view).splitlines()[3 + FORCE_ROWS].strip() == "x"


@pytest.mark.parametrize("width", [20, 60, 300])
def test_no_line_is_wider_than_the_terminal_or_too_wide_to_read(width):
    lines = text(Strip(driven(30, **STIFFNESS), "passive"), width).splitlines()
    assert max(map(len, lines)) <= min(width, 120)


@pytest.mark.parametrize(
    ("policy", "settings"),
    [
        (None, {"distance": 200.0}),
        ("pd", STIFFNESS | {"distance": 200.0, "sensors": "realistic", "pantograph_scatter": 0.1}),
    ],
)
def test_a_run_that_is_watched_is_the_same_bit_for_bit(policy, settings):
    plain = simulate(policy=policy, seed=3, **settings)
    terminal = Console(file=StringIO(), force_terminal=True, width=100)
    with live(terminal, "its name") as watch:
        shown = simulate(policy=policy, seed=3, watch=watch, **settings)
    for name in ("contact_force", "head", "frame_force", "uplift", "dropper_force"):
        np.testing.assert_array_equal(getattr(shown, name), getattr(plain, name))
    assert shown.settings == plain.settings
    assert f"{plain.distance:.0f} m" in terminal.file.getvalue()  # the end is drawn


def on_terminal(*arguments, interrupt=b""):
    """Output and exit status of a command on a terminal, interrupted once it has written something."""
    process, terminal = pty.fork()
    if process == 0:
        os.environ["TERM"] = "xterm-256color"
        os.environ.pop("COLUMNS", None)  # the terminal's own width counts
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # tests started in the background ignore it
        os.execv(Path(sys.executable).with_name("panto"), ["panto", *map(str, arguments)])
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 60, 100, 0, 0))
    written = b""
    while True:
        try:
            new = os.read(terminal, 65536)
        except OSError:  # it has ended
            break
        if not new:
            break
        written += new
        if interrupt and interrupt in written:
            os.write(terminal, b"\x03")
            interrupt = b""
    os.close(terminal)
    return written, os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


@pytest.mark.slow
def test_the_command_draws_on_a_terminal_and_tells_the_same_figures(tmp_path):
    settings = ["--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--speed", 200]
    written, status = on_terminal("simulate", "--live", *settings, "--output", tmp_path / "live.parquet")
    assert status == 0
    assert b"height of the head (mm)" in written
    assert written.count(HIDE) == written.count(SHOW) == 1
    plain = panto("simulate", *settings, "--output", tmp_path / "plain.parquet")
    assert plain.returncode == 0
    runs = [Trajectory.load(tmp_path / f"{name}.parquet") for name in ("live", "plain")]
    np.testing.assert_array_equal(*(run.contact_force for run in runs))


@pytest.mark.slow
def test_an_interrupted_run_gives_the_cursor_back(tmp_path):
    (tmp_path / "slow.py").write_text(
        "import time\nclass Slow:\n    def reset(self, context): pass\n"
        "    def act(self, seen):\n        time.sleep(0.02)\n        return [0.0]\n"
    )
    policy = f"{tmp_path / 'slow.py'}:Slow"
    words = b"height of the head"
    written, status = on_terminal("simulate", "--live", "--policy", policy, interrupt=words)
    assert status != 0
    assert words in written
    assert written.rfind(SHOW) > written.rfind(HIDE) >= 0
    assert b"Traceback" not in written


def test_without_a_terminal_it_says_so_and_goes_on():
    told = panto("simulate", "--live", "--catenary", "periodic-stiffness", "--pantograph", "three-mass")
    assert told.returncode == 0
    message = "--live needs a terminal of 40 columns to draw in; the run continues without."
    assert told.stderr == f"panto: {message}\n"
    assert "standard deviation" in told.stdout
    assert "height of the head" not in told.stdout


def test_the_labels_of_a_chart_stand_at_their_rows():
    def labels(*given):
        return [line.plain.partition("│")[0] for line in chart(np.arange(3.0), np.zeros(3), *given)]

    assert labels((10.0, 50.0), 5, 20) == ["     50 ", "        ", "        ", "        ", "     10 "]
    ends = ["        "] * 2
    assert labels((0.0, 100.0), 6, 20, 62.0) == ["    100 ", ends[0], "     62 ", *ends, "      0 "]
    assert [len(line.plain) for line in chart(np.arange(3.0), np.zeros(3), (0.0, 1.0), 2, 20)] == [29, 29]


def test_a_live_picture_is_drawn_ten_times_a_second_and_at_the_end(monkeypatch):
    clock, drawn = iter([100.0, 100.05, 100.11, 100.2, 100.22]), []
    monkeypatch.setattr(live_module, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setattr(live_module, "Strip", lambda task, policy: drawn.append((task, policy)) or "it")
    with live_module.live(Console(file=StringIO(), width=80), "mine") as watch:
        for task in "abcde":
            watch(task)
    assert drawn == [("a", "mine"), ("c", "mine"), ("e", "mine"), ("e", "mine")]
    drawn.clear()
    with live_module.live(Console(file=StringIO(), width=80), "mine"):
        pass
    assert drawn == []
