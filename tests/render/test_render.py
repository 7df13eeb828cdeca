"""Pictures show what the plant does: where things are, which way a force points, what is slack or lost."""

import itertools
import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.base.plotting import BLUE, ORANGE, VERMILION
from panto_env.cli import make_app
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.envs import IDS
from panto_env.plant.state import Place, Row

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.render.canvas import QUIET, SUPPORT, Canvas, rgb
from panto_env.render.film import (
    Excerpt,
    _highest,
    check_together,
    excerpt,
    figures_in_words,
    frames,
    policy_pass,
)
from panto_env.render.moment import Layout, force_axis, moment_of
from panto_env.render.picture import Picture
from panto_env.render.video import write_film

SIZE = (640, 360)
ROUND = [1, 2, 5, 10, 15, 20, 30, 50, 100, 200]
"""Exaggerations of heights that are easy to remember."""


def driven(steps=150, action=0.0, **settings):
    """A task in the midst of a run."""
    task = Task(run_settings(settings))
    task.reset(0, np.random.default_rng(0))
    for _ in range(steps):
        task.step(np.full((1, len(task.actuator.places)), action))
    return task


def moment(task, lane=0):
    return moment_of(task, lane, "title", {})


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


@pytest.mark.parametrize("name", LINES)
def test_the_wire_that_is_drawn_is_the_one_that_the_pantograph_touches(name):
    task = driven(**LINES[name])
    view = moment(task).line
    position = task.plant.of(0, Row.STEP) * task.plant.of(0, Row.STRIDE)
    drawn = np.interp(position, view.x, view.contact)
    head, compliance = task.plant.of(0, Row.HEAD_HEIGHT), 1 / 50e3
    felt = head - task.plant.of(0, Row.CONTACT_FORCE) * compliance
    tolerance = 1e-3 if name != "rig" else 5e-3  # a cylinder follows the line that is drawn, late
    assert drawn == pytest.approx(felt, abs=tolerance)
    assert view.x.min() <= position - task.plant.catenary.span_length
    assert np.all(np.diff(view.x) > 0)


def test_the_messenger_is_where_the_static_shape_hangs_it():
    task = driven(steps=60)
    view = moment(task).line
    data = task.plant.catenary
    at_support = np.interp(data.span_length, view.x, view.messenger)
    carried = 9.81 * (data.contact_wire.mass + data.messenger_wire.mass) * data.span_length
    assert at_support == pytest.approx(data.encumbrance - carried / data.support.stiffness, abs=3e-3)


def test_slack_droppers_are_those_without_tension():
    run = simulate("en50318-2002", speed_kmh=300.0)
    task = Task(run_settings({"speed_kmh": 300.0}), record_droppers=True)
    task.reset(0, np.random.default_rng(0))
    seen = 0
    for _ in range(600):
        task.step(np.zeros((1, 1)))
        view, step = moment(task).line, int(task.plant.of(0, Row.STEP)) - 1
        which = np.searchsorted(run.dropper_position, view.droppers)
        np.testing.assert_array_equal(view.slack, run.dropper_force[step, which] <= 0)
        seen += view.slack.sum()
    assert seen > 0


def test_a_slack_dropper_is_drawn_in_another_colour():
    task, picture = driven(), Picture(*SIZE)
    now = calm(task)
    slack = now.line._replace(slack=np.ones_like(now.line.slack))
    drawn = [count(picture.draw(replace(now, line=line)), VERMILION) for line in (now.line, slack)]
    assert drawn[1] > drawn[0] + 100  # the first has the mark of the legend


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
    run = simulate("en50318-2002", speed_kmh=250.0)
    now = moment(driven(steps=300, speed_kmh=250.0))
    felt = np.interp(now.places, run.position, run.contact_force)
    np.testing.assert_allclose(now.force, felt, rtol=1e-4)
    filtered = now.filtered[len(now.filtered) // 2 :]
    assert filtered.std() < now.force[len(now.force) // 2 :].std()


def test_heights_are_exaggerated_by_what_is_said():
    now = moment(driven())
    layout = Layout.of(now, *SIZE)
    places = layout.across(np.array([0.0, 1.0]), 0.0)
    heights = layout.up(np.array([0.0, 1.0]))
    assert (heights[0] - heights[1]) / (places[1] - places[0]) == pytest.approx(layout.exaggeration)
    assert layout.up(now.line.messenger).min() > 0
    assert layout.forces(np.array([0.0, 350.0]), 350.0)[0] > layout.forces(350.0, 350.0)


def test_the_exaggeration_is_the_largest_round_one_at_which_the_line_fits_in():
    """Below the title and above the roof, with the pantograph's share of the height between."""
    now, seen = moment(driven()), set()
    for height, width in itertools.product(np.geomspace(0.4, 60, 100), (1280, 200, 64)):
        wire = now.line.messenger * 0 + height
        tall = replace(now, line=now.line._replace(messenger=wire))
        layout = Layout.of(tall, width, 720)
        step = ROUND[ROUND.index(layout.exaggeration) + 1 :][:1]
        top = 0.075 * 720
        assert float(layout.up(height)) >= top or layout.exaggeration == 1
        for larger in step:
            assert float(replace(layout, exaggeration=larger).up(height)) < top
        seen.add(layout.exaggeration)
    assert seen == set(ROUND)


def test_the_axis_of_a_film_fits_what_the_film_shows():
    """What a pass had long before and has afterwards does not count."""
    run = simulate("periodic-stiffness", "three-mass", 180.0, distance=400.0)
    for peak in (40.0, 60.0, 99.0, 101.0, 149.0, 151.0, 200.0, 399.0):
        force = np.where(np.abs(run.position - peak) < 0.2, 9000.0, 100.0)
        what = Excerpt(begin=165.0 / 50, end=150.0 / 50 + 1, every=1, rate=25.0)  # 165 to 200 m, at 50 m/s
        shown = 165 - 1.3 * 50 <= peak <= 200
        assert _highest(replace(run, contact_force=force), what) == (9000.0 if shown else 100.0), peak


@pytest.mark.parametrize(("name", "mode"), list(itertools.product(IDS, ("rgb_array", "rgb_array_list"))))
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


@pytest.mark.parametrize("name", IDS)
def test_drawing_changes_no_number(name):
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


def test_frames_per_second_tell_true_time():
    assert gymnasium.make("Pantograph-v0").metadata["render_fps"] == 100
    slow = gymnasium.make("Pantograph-v0", slow_motion=4.0)
    assert slow.metadata["render_fps"] == 25
    quick = gymnasium.make("Pantograph-v0", control_interval=0.02)
    assert quick.metadata["render_fps"] == 50
    assert gymnasium.make_vec("Pantograph-v0", num_envs=1, slow_motion=10).metadata["render_fps"] == 10


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


def read(path):
    """What a film says of itself, and its frames counted."""
    import imageio_ffmpeg

    reader = imageio_ffmpeg.read_frames(str(path))
    return next(reader), sum(1 for _ in reader)


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_two_policies_are_filmed_above_each_other(tmp_path, suffix):
    path = tmp_path / f"film{suffix}"
    command = ["film", "passive", "pd", "--output", str(path), "--size", "640", "480", "--seconds", "0.3"]
    result = CliRunner().invoke(make_app(), [*command, "--line-spans", "14", "--slow-motion", "5"])
    assert result.exit_code == 0, result.output
    assert "20 frames per second, 5 times slower than real" in result.output
    if suffix == ".mp4":
        meta, number = read(path)
        assert meta["size"] == (640, 480)
        assert meta["fps"] == 20
        assert number == pytest.approx(30, abs=1)
        assert meta["pix_fmt"].startswith("yuv420p")  # what every browser plays
    else:
        from PIL import Image

        film = Image.open(path)
        assert film.size == (640, 480)
        assert film.n_frames == pytest.approx(30, abs=1)


def test_a_film_shows_the_pass_that_simulate_makes():
    settings = {"speed_kmh": 300.0, "spans": 14}
    filmed = policy_pass("pd", settings, 2)
    what = excerpt(filmed, 10, 0.2, 4.0)
    assert what.begin == pytest.approx(9 * 60 / (300 / 3.6))
    (first, *_) = frames([filmed], what, SIZE)
    task = Task(run_settings(settings))
    assert first.shape == (360, 640, 3)
    assert task.plant.time_step == filmed.run.time_step


def test_a_film_has_every_so_many_control_steps_that_no_frame_comes_too_fast():
    """25 frames per second at most: every fourth step of 10 ms, each one in a film slowed down by four."""
    filmed = policy_pass("pd", {"catenary": "periodic-stiffness", "pantograph": "three-mass"}, 0)
    for slow_motion, every, rate in ((1.0, 4, 25.0), (4.0, 1, 25.0), (10.0, 1, 10.0)):
        what = excerpt(filmed, 2, 0.2, slow_motion)
        assert (what.every, what.rate) == (every, pytest.approx(rate))


def test_passes_of_other_speeds_or_control_intervals_are_not_filmed_above_each_other():
    line = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 100.0}
    first, same, fast, rare = (
        policy_pass("p", line | more, 0)
        for more in ({}, {"sensors": "realistic"}, {"speed_kmh": 250.0}, {"control_interval": 0.02})
    )
    check_together([first, same])
    for other, name in ((fast, "speed"), (rare, "control_interval")):
        with pytest.raises(InputError, match=f"must have the same {name}"):
            check_together([first, other])


def test_a_change_of_spread_is_given_only_between_passes_that_differ_in_their_control():
    first, same, other = (
        policy_pass(name, {"distance": 800.0, "pantograph": pantograph}, 0)
        for name, pantograph in (("passive", "dsa380"), ("pd", "dsa380"), ("pd", "dsa250"))
    )
    of_first, of_same, of_other = (figures_in_words(each, first) for each in (first, same, other))
    assert "σ relative to passive" in of_same
    assert not any("relative" in text for text in [*of_first, *of_other])
    early = first._replace(run=replace(first.run, terminated=True))
    assert not any("relative" in text for text in figures_in_words(same, early))


def test_what_cannot_be_filmed_is_refused_in_a_sentence(tmp_path):
    short = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 200.0}
    with pytest.raises(InputError, match="before span 10; begin in an earlier one"):
        excerpt(policy_pass("passive", short, 0), 10, 1.0, 1.0)
    with pytest.raises(InputError, match=r"must end in one of \.mp4, \.gif"):
        write_film([], tmp_path / "film.avi", 25, SIZE)
    for arguments, words in (
        (["passive"] * 5, "up to 4 passes, not 5"),
        (["passive", "--size", "641", "480"], "even numbers of pixels"),
        (["passive", "pd", "--size", "640", "362"], "the height for each pass's part"),
    ):
        result = CliRunner().invoke(make_app(), ["film", *arguments, "--output", str(tmp_path / "film.mp4")])
        assert isinstance(result.exception, InputError)
        assert words in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_words_at_an_edge_are_cut_and_far_lines_too():
    canvas = Canvas(64, 64)
    canvas.words(-20, 2, "cut", (255, 255, 255), 16)
    canvas.words(60, 63, "cut", (255, 255, 255), 16)
    canvas.line([(-1e9, 5.0), (1e9, 5.0)], (255, 0, 0))
    canvas.box(-5, -5, 8, 8, (0, 255, 0))
    assert canvas.pixels[:3, :3, 1].min() == 255
    assert canvas.pixels.any(axis=2).sum() > 64


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"render_mode": "ansi"}, "render_mode must be None, 'human' or 'rgb_array', not 'ansi'"),
        ({"render_size": (1, 1)}, "from 64 to 4,096"),
        ({"slow_motion": 0.0}, "from 0.01 to 1,000"),
    ],
)
def test_wrong_arguments_are_refused(arguments, words):
    from panto_env.envs import PantographEnv

    with pytest.raises(InputError, match=words):
        PantographEnv(**arguments)


def test_a_lane_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="render_lanes has lane 4, but lanes are 0 to 3"):
        gymnasium.make_vec("Pantograph-v0", num_envs=4, render_lanes=(0, 4))


def test_the_axis_fits_the_force_and_the_limit_is_named_where_it_is_far_above():
    assert force_axis(80.0, 54.0, 350.0) == 120.0
    assert force_axis(0.0, 120.0, 350.0) == 240.0
    assert force_axis(230.0, 120.0, 350.0) == 240.0
    assert force_axis(260.0, 120.0, 350.0) == 350.0
    assert force_axis(400.0, 120.0, 350.0) == 400.0
    for highest in (10.0, 80.0, 260.0, 1234.0):
        assert force_axis(highest, 54.0, 350.0) >= highest


def test_a_light_force_fills_the_chart():
    """A nominal force of 54 N had used a third of an axis up to the limit of 350 N."""
    task = driven(catenary="shinkansen-simple", pantograph="identified-2dof")
    now = calm(task)
    drawn = Picture(*SIZE).draw(now)
    layout = Layout.of(now, *SIZE)
    top, bottom = layout.chart
    curve = np.abs(drawn.astype(int) - rgb(BLUE)).max(axis=2) < 40
    rows = np.nonzero(curve[:, int(layout.margin) : int(layout.pantograph) - 8].any(axis=1))[0]
    rows = rows[rows > top + 2]  # below the legend
    assert (bottom - rows.min()) / (bottom - top) > 0.45


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


def test_what_names_lines_and_forces_lies_outside_the_chart():
    """Labels had been drawn over the curves."""
    now, picture = calm(driven()), Picture(*SIZE)
    picture.draw(now)
    layout = Layout.of(now, *SIZE)
    top, bottom = (round(each) for each in layout.chart)
    chart = picture._still.pixels[top + 1 : bottom, round(layout.margin) + 1 : round(layout.pantograph) - 1]
    words = np.abs(chart.astype(int) - QUIET).max(axis=2) < 30
    assert words.sum(axis=1)[words.any(axis=1)].min() > 50  # only the dashes of the nominal force
    beside = picture._still.pixels[top:bottom, : round(layout.margin)]
    assert (np.abs(beside.astype(int) - QUIET).max(axis=2) < 60).sum() > 20


def test_supports_are_dashed_and_lost_contact_is_in_the_legend():
    now, picture = calm(driven(steps=200)), Picture(*SIZE)
    drawn = picture.draw(now)
    layout = Layout.of(now, *SIZE)
    (number,) = now.alignment.supports_within(now.position - 0.8 * now.alignment.mean_length, now.position)
    column = round(float(layout.across(np.array(now.alignment.support(number)), now.position)))
    top, bottom = (round(each) for each in layout.chart)
    marked = np.abs(drawn[top:bottom, column].astype(int) - SUPPORT).max(axis=1) < 60
    assert 0.3 < marked.mean() < 0.8
    assert (np.diff(marked.astype(int)) == 1).sum() > 3  # dashes
    legend = drawn[top - 14 : top - 1, : round(layout.pantograph)]
    assert count(legend, VERMILION) >= 4
