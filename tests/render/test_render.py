"""Pictures show what the plant does: where things are, which way a force points, what is slack or lost."""

import itertools
import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.plotting import ORANGE, VERMILION
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.envs import IDS, PantographEnv
from panto_env.plant.state import Place, Row

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.metrics.figures import LABELS
from panto_env.render.canvas import rgb
from panto_env.render.moment import Layout, force_axis, moment_of
from panto_env.render.picture import Picture
from panto_env.render.viewer import figures_so_far

from ..marks import some_at_once

SIZE = (640, 360)
STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
ROUND = [1, 2, 5, 10, 15, 20, 30, 50, 100, 200]
"""Exaggerations of heights that are easy to remember."""


def driven(steps=150, action=0.0, **settings):
    """A task in the midst of a run."""
    task = Task(run_settings(settings))
    task.reset(0, np.random.default_rng(0))
    for _ in range(steps):
        task.step(np.full((1, len(task.actuator.places)), action))
    return task


def moment(task):
    return moment_of(task, 0, "title", {})


def calm(task):
    """The same, but for contact that is lost and droppers that are slack."""
    now = moment(task)
    line = now.line._replace(slack=np.zeros_like(now.line.slack))
    return replace(now, line=line, force=np.maximum(now.force, 50.0))


def count(frame, colour):
    """Pixels of about a colour."""
    return int((np.abs(frame.astype(int) - rgb(colour)).max(axis=2) < 12).sum())


LINES = {
    "flexible": {"catenary": "en50318-2002"},
    "as built": {"catenary": "shinkansen-simple", "line_condition": "as-built"},
    "three spans": {"catenary": "ohl-three-span", "pantograph": "own-two-mass"},
    "rig": {"catenary": "rig-flexible"},
}


@pytest.mark.parametrize("name", some_at_once(LINES, ("flexible", "three spans")))
def test_the_wire_that_is_drawn_is_the_one_that_the_pantograph_touches(name):
    task = driven(**LINES[name])
    view = moment(task).line
    position = task.plant.of(0, Row.STEP) * task.plant.of(0, Row.STRIDE)
    felt = task.plant.of(0, Row.HEAD_HEIGHT) - task.plant.of(0, Row.CONTACT_FORCE) / 50e3
    tolerance = 1e-3 if name != "rig" else 5e-3  # a cylinder follows the line that is drawn, late
    assert np.interp(position, view.x, view.contact) == pytest.approx(felt, abs=tolerance)
    assert view.x.min() <= position - task.plant.catenary.span_length
    assert np.all(np.diff(view.x) > 0)


def test_slack_droppers_are_those_without_tension():
    run = simulate("en50318-2002", speed_kmh=300.0, distance=200.0)
    task = Task(run_settings({"speed_kmh": 300.0, "distance": 200.0}), record_droppers=True)
    task.reset(0, np.random.default_rng(0))
    seen = 0
    for _ in range(200):
        task.step(np.zeros((1, 1)))
        view, step = moment(task).line, int(task.plant.of(0, Row.STEP)) - 1
        which = np.searchsorted(run.dropper_position, view.droppers)
        np.testing.assert_array_equal(view.slack, run.dropper_force[step, which] <= 0)
        seen += view.slack.sum()
    assert seen > 0


def test_an_arrow_points_as_the_force_does():
    task, picture = driven(), Picture(*SIZE)
    now = moment(task)
    layout = Layout.of(now, *SIZE)
    frame = layout.chain(now.heights)[-1]
    for force in (80.0, -80.0):
        drawn = picture.draw(replace(now, actuators={Place.FRAME: force}))
        rows, columns = np.nonzero(np.abs(drawn.astype(int) - rgb(ORANGE)).max(axis=2) < 30)
        middle = rows[columns > layout.pantograph - 50].mean()
        assert (middle < frame) == (force > 0)
    assert layout.arrow(50.0, 100.0) == -layout.arrow(-50.0, 100.0)
    assert layout.arrow(100.0, 100.0) == layout.arrow(300.0, 100.0)


def test_lost_contact_is_marked():
    task, picture = driven(), Picture(*SIZE)
    now = calm(task)
    lost = replace(now, force=np.where(np.arange(len(now.force)) > len(now.force) - 20, 0.0, now.force))
    legend = count(picture.draw(now), VERMILION)
    assert legend < 60
    assert count(picture.draw(lost), VERMILION) > legend + 20


def test_the_force_shown_is_the_one_of_the_run_where_it_was_felt():
    run = simulate("en50318-2002", speed_kmh=250.0, distance=220.0)
    now = moment(driven(steps=300, speed_kmh=250.0))
    felt = np.interp(now.places, run.position, run.contact_force)
    np.testing.assert_allclose(now.force, felt, rtol=1e-4)
    filtered = now.filtered[len(now.filtered) // 2 :]
    assert filtered.std() < now.force[len(now.force) // 2 :].std()


def test_the_exaggeration_is_the_largest_round_one_at_which_the_line_fits_in():
    """Below the title and above the roof, with the pantograph's share of the height between."""
    now, seen = moment(driven()), set()
    for height, width in itertools.product(np.geomspace(0.4, 60, 100), (1280, 200, 64)):
        tall = replace(now, line=now.line._replace(messenger=now.line.messenger * 0 + height))
        layout = Layout.of(tall, width, 720)
        assert float(layout.up(height)) >= 0.075 * 720 or layout.exaggeration == 1
        for larger in ROUND[ROUND.index(layout.exaggeration) + 1 :][:1]:
            assert float(replace(layout, exaggeration=larger).up(height)) < 0.075 * 720
        seen.add(layout.exaggeration)
    assert seen == set(ROUND)


@pytest.mark.parametrize(
    ("name", "mode"), [*((name, "rgb_array") for name in IDS), ("Pantograph-v0", "rgb_array_list")]
)
def test_every_id_draws_itself(name, mode):
    env = gymnasium.make(name, render_mode=mode, render_size=SIZE)
    env.reset(seed=0)
    shown = [env.render()]
    for _ in range(30):
        env.step(env.action_space.sample())
    shown.append(env.render())
    if mode == "rgb_array_list":
        assert len(shown[1]) == 30
        shown = [shown[0][0], shown[1][-1]]
    for frame in shown:
        assert frame.shape == (360, 640, 3)
        assert frame.dtype == np.uint8
    assert np.any(shown[0] != shown[1])
    env.close()


def test_drawing_changes_no_number():
    name = "Pantograph-v0"
    plain, drawn = gymnasium.make(name), gymnasium.make(name, render_mode="rgb_array", render_size=SIZE)
    for env in (plain, drawn):
        env.reset(seed=3)
    for _ in range(20):
        results = [env.step(np.full(1, 0.3, dtype=np.float32)) for env in (plain, drawn)]
        drawn.render()
        np.testing.assert_array_equal(results[0][0], results[1][0])
        assert results[0][1:4] == results[1][1:4]


def test_a_lane_draws_what_a_single_environment_draws():
    arguments = {"render_mode": "rgb_array", "render_size": SIZE}
    envs = gymnasium.make_vec("Pantograph-v0", num_envs=3, render_lanes=(2, 0), **arguments)
    env = gymnasium.make("Pantograph-v0", **arguments)
    envs.reset(seed=5)
    env.reset(seed=7)
    for _ in range(25):
        envs.step(np.full((3, 1), 0.2, dtype=np.float32))
        env.step(np.full(1, 0.2, dtype=np.float32))
    second, first = envs.render()
    single = env.render()
    title = slice(None, int(0.075 * 360))  # tells the lane
    second[title] = single[title] = 0
    np.testing.assert_array_equal(second, single)
    assert np.any(first != second)


def test_a_window_shows_each_step_and_closes(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make("Pantograph-v0", render_mode="human", render_size=SIZE, slow_motion=0.01)
    env.reset(seed=0)
    for _ in range(3):
        env.step(env.action_space.sample())
    screen = pygame.surfarray.array3d(pygame.display.get_surface())
    assert screen.shape == (640, 360, 3)
    assert len(np.unique(screen.reshape(-1, 3), axis=0)) > 10
    copy = pickle.loads(pickle.dumps(env.unwrapped))
    copy.step(np.zeros(1, dtype=np.float32))
    env.close()
    copy.close()
    assert not pygame.display.get_init()


def read(path):
    """What a film says of itself, and its frames counted."""
    import imageio_ffmpeg

    reader = imageio_ffmpeg.read_frames(str(path))
    return next(reader), sum(1 for _ in reader)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [({"render_size": (1, 1)}, "from 64 to 4,096"), ({"slow_motion": 0.0}, "from 0.01 to 1,000")],
)
def test_wrong_arguments_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        PantographEnv(**arguments)


def test_the_axis_fits_the_force_and_the_limit_is_named_where_it_is_far_above():
    for highest, nominal, axis in (
        (80, 54, 120),
        (0, 120, 240),
        (230, 120, 240),
        (260, 120, 350),
        (400, 120, 400),
    ):
        assert force_axis(highest, nominal, 350.0) == axis
    for highest in (10.0, 80.0, 260.0, 1234.0):
        assert force_axis(highest, 54.0, 350.0) >= highest


def test_the_axis_never_shrinks_within_an_episode_and_is_one_for_all_passes_of_a_film():
    now, picture = calm(driven()), Picture(*SIZE)
    picture.draw(now)
    before = picture._highest
    picture.draw(replace(now, force=np.full_like(now.force, 300.0)))
    picture.draw(now)
    assert picture._highest == 300.0 > before
    assert Picture(*SIZE, highest=500.0)._highest == 500.0
    picture.draw(replace(now, time=0.0))
    assert picture._highest == pytest.approx(now.force.max())


def test_the_figures_so_far_are_those_of_the_episode(monkeypatch):
    task = driven(0, **STIFFNESS)
    assert figures_so_far(task, 0) == {}
    task = driven(120, **STIFFNESS)
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
    task = driven(90, **STIFFNESS)
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
    later = moment(driven(300, **STIFFNESS))  # at 167 m, of which the last 65 m are shown
    assert later.position - 65.0 <= later.places.min() < later.position - 65.0 + gaps[0]
    assert len(later.places) == len(later.force) == len(later.filtered)


@pytest.mark.slow
def test_record_video_writes_an_episode(tmp_path):
    pytest.importorskip("moviepy")
    env = gymnasium.make(
        "Pantograph-v0", render_mode="rgb_array", render_size=SIZE, distance=60.0, run_in=0.0, settle=0.0
    )
    env = gymnasium.wrappers.RecordVideo(env, str(tmp_path), disable_logger=True)
    env.reset(seed=0)
    steps, ended = 0, False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        steps, ended = steps + 1, terminated or truncated
    env.close()
    (film,) = tmp_path.glob("*.mp4")
    meta, number = read(film)
    assert meta["fps"] == 100
    assert number == steps + 1
