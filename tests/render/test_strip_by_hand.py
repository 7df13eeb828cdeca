"""A run in the terminal, line by line and dot by dot, worked out by hand."""

import unicodedata
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.render import strip as live_module
from panto_env.render.moment import Felt, felt
from panto_env.render.strip import Strip, _characters, _round, chart

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}


def driven(steps, **settings):
    task = Task(run_settings(STIFFNESS | settings))
    task.reset(0, np.random.default_rng(0))
    for _ in range(steps):
        task.step(np.zeros((1, 1)))
    return task


def test_each_dot_of_a_character_has_the_name_that_unicode_gives_it():
    """Dots 1, 2, 3 and 7 stand on the left from above, 4, 5, 6 and 8 on the right."""
    for (y, x), number in zip(np.ndindex(4, 2), "14253678", strict=True):
        dots = np.zeros((8, 6), dtype=bool)
        dots[4 + y, 2 + x] = True
        cells = _characters(dots)
        assert unicodedata.name(str(cells[1, 1])) == f"BRAILLE PATTERN DOTS-{number}"
        assert (cells == "\u2800").sum() == 5
    assert unicodedata.name(str(_characters(np.ones((4, 2), dtype=bool))[0, 0])).endswith("DOTS-12345678")


def test_the_labels_of_a_chart_stand_at_their_rows():
    def labels(*given):
        return [line.plain.partition("│")[0] for line in chart(np.arange(3.0), np.zeros(3), *given)]

    assert labels((10.0, 50.0), 5, 20) == ["     50 ", "        ", "        ", "        ", "     10 "]
    assert labels((0.0, 100.0), 6, 20, 62.0) == [
        *(["    100 ", "        ", "     62 "]),
        *["        "] * 2,
        "      0 ",
    ]
    assert [len(line.plain) for line in chart(np.arange(3.0), np.zeros(3), (0.0, 1.0), 2, 20)] == [29, 29]


def test_heights_are_shown_in_tens_of_millimetres():
    for heights, extent in (
        ([12.0, 58.0], (10, 60)), ([20.0, 40.0], (20, 40)), ([-3.0, 4.0], (-10, 10)),
        ([30.0, 30.0], (30, 40)), ([31.0, 32.0], (30, 40)), ([], (0, 10)),
    ):  # fmt: skip
        assert _round(np.array(heights)) == extent


def told(view, width=69):
    console = Console(file=StringIO(), width=width)
    console.print(view)
    return console.file.getvalue().splitlines()


def test_a_strip_line_by_line():
    """60 columns show 3 spans: the last 150 m of a run that is at 200 m, a force of 100 N and a loss."""
    task = driven(0)
    view, length = Strip(task, "mine"), 3 * task.plant.alignment.mean_length
    places = 200.0 - length + length * np.arange(0.25, 60) / 60
    force = np.full(60, 90.0)
    force[[20, 41]] = 0.0, -1.0
    filtered = np.full(60, 100.0)
    filtered[-30:] = 140.0
    heights = np.linspace(0.04, 0.2, 60)
    view._felt, view._position, view._time = Felt(places, force, filtered, heights), 200.0, 3.6
    view._share = 1 / 3
    lines = told(view)
    assert "at 200 km/h, policy mine" in lines[0] or lines[0].endswith("…")
    assert lines[1] == "━" * 69
    (done,) = [
        text for text in view.__rich_console__(None, SimpleNamespace(max_width=69)) if "━" in text.plain
    ]
    assert [(span.start, span.end, str(span.style)) for span in done.spans] == [
        (0, 23, "bright_blue"), (23, 69, "dim")
    ]  # fmt: skip
    assert lines[2].startswith("contact force (N), low-passed at 20 Hz; ╌ limit of")
    top = next(k for k, line in enumerate(lines) if line.startswith(f"{1.1 * view._limit:7.0f} │"))
    marks = lines[top + 10]
    assert [k - 9 for k, mark in enumerate(marks) if mark == "x"] == [20, 41]
    (level,) = [line for line in lines[top : top + 10] if "╌" in line]
    assert level.startswith(f"{view._limit:7.0f} │")
    assert lines[top + 11] == "height of the head (mm); 0: contact wire without sag"
    assert lines[top + 12].startswith("    200 │")
    assert lines[top + 17].startswith("     40 │")
    assert lines[top + 12].rstrip("\u2800")[-1] != "│"
    ends = f"{200 - length:.0f} m", "200 m"
    assert lines[top + 18] == " " * 9 + ends[0] + ends[1].rjust(60 - len(ends[0]))
    span = task.plant.alignment.span_of(float(places[-1]))
    assert " ".join(lines[top + 19 :]).split() == (
        f"3.60 s 200 m, span {span} force 140 N shown part: mean 120 N, σ 20 N".split()
    )
    view._felt = felt(task, 0, 3.0)
    assert view._in_words() == "3.60 s  200 m"


def test_a_curve_runs_from_the_left_to_the_right_of_its_chart():
    view = Strip(driven(0), "mine")
    length = 3 * view._alignment.mean_length
    places = 200.0 - length + length * np.arange(0.25, 60) / 60
    values = np.full(60, 100.0)
    view._felt, view._position = Felt(places, values, values, np.linspace(0.04, 0.2, 60)), 200.0
    lines = told(view)
    begin = next(k for k, line in enumerate(lines) if line.startswith("height of the head")) + 1
    cells = np.array([list(line[9:].ljust(60, "\u2800")) for line in lines[begin : begin + 6]]) != "\u2800"
    assert cells[5, 0]
    assert cells[0, 59]
    assert cells.any(axis=0).all()
    assert np.all(np.diff(cells.argmax(axis=0)) <= 0)  # a height that grows


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
