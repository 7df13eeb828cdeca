"""What a terminal, a window and an environment show, and the canvas behind pictures, worked out by hand."""

import errno
import os
import signal
import unicodedata
from dataclasses import replace
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env import InputError
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.metrics.labels import LABELS
from panto_env.plant.state import Row
from panto_env.render import live as live_module
from panto_env.render.canvas import Canvas, rgb, zigzag
from panto_env.render.film import Excerpt, frames
from panto_env.render.filmed import alike, policy_pass
from panto_env.render.layout import Layout
from panto_env.render.moment import Felt, felt, moment_of
from panto_env.render.strip import Strip, _characters, _round, chart
from panto_env.render.video import _failure
from panto_env.render.viewer import Viewer, figures_so_far

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


def test_the_figures_so_far_are_those_of_the_episode(monkeypatch):
    task = driven(0)
    assert figures_so_far(task, 0) == {}
    for _ in range(120):
        task.step(np.zeros((1, 1)))
    values = task.figures(0).as_dict()
    assert figures_so_far(task, 0) == {
        "F_m so far": f"{values['mean']:.1f} N",
        "σ so far": f"{values['std']:.1f} N",
        f"{LABELS['contact_loss'].short} so far": f"{values['contact_loss']:.1f} %",
    }

    def diverged(lane):
        raise InputError("The run has no figures.")

    monkeypatch.setattr(task, "figures", diverged)
    assert figures_so_far(task, 0) == {}


def test_what_a_moment_says_of_its_task():
    task = driven(90)
    now = moment_of(task, 0, "a title", {"more": "text"})
    assert (now.title, now.figures, now.time) == ("a title", {"more": "text"}, pytest.approx(0.9))
    assert now.position == pytest.approx(0.9 * 200 / 3.6)
    assert now.speed == pytest.approx(200 / 3.6)
    assert list(now.masses) == list(task.plant.pantograph.masses)
    assert list(now.heights) == [task.plant.of(0, Row.STATE + k) for k in range(len(now.heights))]
    assert list(now.actuators.values()) == [0.0] * len(now.actuators)
    assert np.all(now.places < now.position)
    assert now.places.min() >= now.position - 1.3 * now.alignment.mean_length
    gaps = np.diff(now.places)
    np.testing.assert_allclose(gaps, 200 / 3.6 * task.plant.time_step, rtol=1e-6)
    assert now.places[-1] == pytest.approx(now.position - gaps[0] / 2)
    later = moment_of(driven(300), 0, "", {})  # at 167 m, of which the last 65 m are shown
    assert later.position - 65.0 <= later.places.min() < later.position - 65.0 + gaps[0]
    assert len(later.places) == len(later.force) == len(later.filtered)


def test_a_window_shows_every_pixel_where_it_is(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    from panto_env.render.window import Window

    frame = np.random.default_rng(0).integers(0, 256, (72, 96, 3)).astype(np.uint8)
    window = Window((96, 72), "a title")
    ticks = []
    monkeypatch.setattr(window, "_clock", SimpleNamespace(tick=ticks.append))
    window.show(frame, 40.0)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, frame)
    assert (pygame.display.get_caption()[0], ticks) == ("a title", [40.0])
    window.close()


def test_runs_are_alike_whatever_the_order_of_their_settings():
    facts = {"design": {"a": 1, "b": float("nan")}, "seed": 3, "speed_kmh": 250.0, "nominal_force": 120.0}
    one = SimpleNamespace(settings={"spans": 14, "wind": 0.0, "actuator": "x"}, **facts)
    turned = facts | {"design": {"b": float("nan"), "a": 1}}
    assert alike(one, SimpleNamespace(settings={"sensors": "y", "wind": 0.0, "spans": 14}, **turned))
    others = [("design", {"a": 2, "b": 0}), ("seed", 4), ("speed_kmh", 251.0), ("nominal_force", 121.0)]
    for name, value in others:
        assert not alike(one, SimpleNamespace(settings=one.settings, **facts | {name: value}))
    assert not alike(one, SimpleNamespace(settings={"spans": 15, "wind": 0.0}, **facts))


def test_why_a_film_was_not_written():
    large = _failure(-signal.SIGXFSZ, "")
    assert (large.errno, large.strerror) == (errno.EFBIG, os.strerror(errno.EFBIG))
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO):
        for status in (0, 1, -9):
            assert _failure(status, f"av_interleaved: {os.strerror(number)}\n").errno == number
    assert str(_failure(-9, "something\n")) == "FFmpeg was killed by SIGKILL"
    assert str(_failure(1, "one\ntwo\n")) == "FFmpeg ended too early, with status 1: two"
    assert str(_failure(0, " \n")) == "FFmpeg ended too early, with status 0"


def test_a_box_a_dot_and_words_cover_the_pixels_they_should():
    canvas = Canvas(40, 30)
    canvas.fill((9, 8, 7))
    assert (canvas.pixels == (9, 8, 7)).all()
    canvas.box(3.4, 5.6, 10.0, 4.0, (255, 0, 1))
    inside = np.zeros((30, 40), dtype=bool)
    inside[6:10, 3:13] = True
    assert ((canvas.pixels == (255, 0, 1)).all(axis=2) == inside).all()
    canvas = Canvas(41, 41)
    canvas.dot(20, 20, 8, (0, 200, 0), (200, 0, 0))
    away = np.hypot(*(np.indices((41, 41)) - 20))
    assert (canvas.pixels[away < 7] == (0, 200, 0)).all()
    assert (canvas.pixels[(away > 8.6) & (away < 8.9)][:, 0] > 100).all()
    assert not canvas.pixels[away > 11.8].any()
    for anchor, x in (("left", 5.0), ("middle", 60.0), ("right", 115.0)):
        canvas = Canvas(120, 40)
        width = canvas.words(x, 20, "HHH", (255, 255, 255), 16, anchor=anchor)
        rows, columns = np.nonzero(canvas.pixels[..., 0] > 60)
        left = x - {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * width
        assert left <= columns.min() <= left + 4
        assert left + width - 4 <= columns.max() <= left + width
        assert rows.mean() == pytest.approx(20, abs=1.0)
        assert np.ptp(rows) == pytest.approx(0.73 * 16, abs=1.5)  # the height of a capital
    bold, thin = Canvas(120, 40), Canvas(120, 40)
    assert bold.words(5, 20, "HHH", (255, 255, 255), 16, bold=True) > thin.words(5, 20, "HHH", (255,) * 3, 16)
    assert rgb("#01fe80") == (1, 254, 128)


def test_a_wire_is_as_broad_as_its_thin_lines():
    for width, rows in ((1, [20]), (2, [19, 20]), (3, [19, 20, 21])):
        canvas = Canvas(60, 40)
        canvas.wire([(0, 20), (60, 20)], (255, 255, 255), width)
        lit = canvas.pixels[:, 30, 0].astype(float)
        assert (lit @ np.arange(40)) / lit.sum() == pytest.approx(20.0, abs=0.25)
        assert set(np.nonzero(lit > 200)[0]) <= set(rows) | {20, 21}
        assert lit[20] > 150


def test_a_spring_s_turns():
    points = zigzag(10.0, 100.0, 200.0, 3.0, 2)
    np.testing.assert_allclose(points[:, 0], [10, 10, 13, 7, 13, 7, 10, 10])
    np.testing.assert_allclose(points[:, 1], [100, 110, 115, 115 + 70 / 3, 115 + 140 / 3, 185, 190, 200])


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


def test_the_exaggeration_is_of_the_messenger_or_of_the_contact_wire_where_there_is_none():
    now = moment_of(driven(0), 0, "", {})
    of = {}
    for name in ("contact", "messenger"):
        line = now.line._replace(contact=np.zeros(2), messenger=np.zeros(0))._replace(
            **{name: np.array([9.0, 1.0])}
        )
        of[name] = Layout.of(replace(now, line=line), 640, 360).exaggeration
    assert of["contact"] == of["messenger"] < Layout.of(now, 640, 360).exaggeration


def test_a_viewer_opens_one_window_until_it_is_closed(monkeypatch):
    events = []

    class Window:
        def __init__(self, size, title):
            events.append(("opened", size, title))

        def show(self, frame, rate):
            events.append((frame, rate))

        def close(self):
            events.append("closed")

    monkeypatch.setattr("panto_env.render.window.Window", Window)
    viewer = Viewer((64, 48))
    viewer.close()
    for number in (1, 2):
        viewer.show(number, "a title", 25.0)
    viewer.close()
    viewer.close()
    viewer.show(3, "another", 50.0)
    assert events == [
        ("opened", (64, 48), "a title"), (1, 25.0), (2, 25.0), "closed",
        ("opened", (64, 48), "another"), (3, 50.0),
    ]  # fmt: skip


def test_each_lane_keeps_its_picture_and_shows_the_reward():
    task, viewer = driven(5), Viewer((320, 180))
    first = viewer.frame(task, 0, "a title", 1.234).copy()
    kept = viewer._pictures[0]
    assert first.shape == (180, 320, 3)
    assert np.any(viewer.frame(task, 0, "a title", -7.0) != first)
    assert viewer._pictures == {0: kept}


def test_the_frames_of_a_film_and_the_share_that_is_drawn():
    """A fifth of the way is the run up to where it begins, the rest its frames: every second step."""
    filmed, shares = policy_pass("p", STIFFNESS | {"distance": 510.0}, 0), []
    what = Excerpt(begin=0.5, end=0.6, every=2, rate=25.0)
    seen = list(frames([filmed], what, (64, 64), shares.append))
    before, during = shares[: -len(seen)], shares[-len(seen) :]
    assert (len(before), len(seen)) == (49, 6)
    assert before == pytest.approx([0.2 * k / 50 for k in range(1, 50)])
    assert during == pytest.approx([0.2 + 0.8 * k / 5 for k in range(6)])
    above = list(frames([filmed, filmed], what, (64, 128)))
    assert [frame.shape for frame in above] == [(128, 64, 3)] * 6
