"""What a window, an environment and a film show, worked out by hand."""

import errno
import os
import signal
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env import InputError
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.metrics.figures import LABELS
from panto_env.plant.state import Row
from panto_env.render.film import Excerpt, alike, frames, policy_pass
from panto_env.render.moment import Layout, moment_of
from panto_env.render.video import _failure
from panto_env.render.viewer import Viewer, figures_so_far

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}


def driven(steps, **settings):
    task = Task(run_settings(STIFFNESS | settings))
    task.reset(0, np.random.default_rng(0))
    for _ in range(steps):
        task.step(np.zeros((1, 1)))
    return task


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
    from panto_env.render.viewer import Window

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

    monkeypatch.setattr("panto_env.render.viewer.Window", Window)
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
