"""Pictures of trains: the controlled pantograph is large, all are in the strip below, where they are."""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env import InputError, simulate
from panto_env.analysis.simulation import check_made_anew, load_with_settings
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.state import Row
from panto_env.render.canvas import FORCE, OTHERS
from panto_env.render.film import excerpt, figures_in_words, frames, saved_passes
from panto_env.render.moment import AHEAD, moment_of
from panto_env.render.picture import SHARE, Picture, colour_of
from panto_env.render.strip import Strip

from .test_live import text

SIZE = (800, 600)
TRAIN = {"pantographs": ["en50318-2002", "dsa250"], "distances": [100.0], "speed_kmh": 250.0, "spans": 14}


def driven(steps, **settings):
    task = Task(run_settings(TRAIN | settings))
    task.reset(0, np.random.default_rng(0))
    for _ in range(steps):
        task.step(np.zeros((task.agents, len(task.actuator.places))))
    return task


@pytest.fixture(scope="module")
def task():
    return driven(300, controlled=[2])  # its episode begins where it comes onto the line


def columns_of(frame, colour):
    below = frame[round((1 - SHARE) * SIZE[1]) :].astype(int)
    return np.flatnonzero((np.abs(below - colour).max(axis=2) < 12).any(axis=0))


def test_the_controlled_pantograph_is_the_one_shown(task):
    now, record = moment_of(task, 0, "title", {}), task.trajectory(0).followers[0]
    assert now.position == pytest.approx(300 * 0.01 * 250 / 3.6, abs=0.2)
    assert now.force[-1] == record.contact_force[-1]
    assert now.places[-1] == pytest.approx(record.position[-1])
    assert now.masses.tolist() == list(task.settings.riding[1].masses)
    assert now.wire == pytest.approx(record.wire[-1])
    assert now.nominal_force == record.nominal_force
    assert now.train.shown == 1
    assert [rider.name for rider in now.train.riders] == ["en50318-2002", "dsa250"]
    assert [rider.position for rider in now.train.riders] == pytest.approx([now.position + 100, now.position])
    first = moment_of(driven(50), 0, "title", {})
    assert first.train.shown == 0
    assert first.position == first.train.riders[0].position


def test_the_strip_has_each_where_it_is(task):
    now = moment_of(task, 0, "title", {})
    frame = Picture(*SIZE).draw(now)
    left, right = 0.075 * SIZE[0], 0.985 * SIZE[0]
    length = 100.0 + (1 + AHEAD) * 60.0
    for number, behind in ((0, 0.0), (1, 100.0)):
        x = left + (right - left) * (length - AHEAD * 60.0 - behind) / length
        marked = columns_of(frame, colour_of(number, 1))
        assert x - 8 < marked[marked < x + 8].max() < x + 8
        assert marked[marked > x + 8].size == 0 or number == 1  # names stand at the left
    assert (colour_of(0, 1), colour_of(1, 1), colour_of(2, 1)) == (OTHERS[0], FORCE, OTHERS[1])


def test_forces_of_all_reach_as_far_as_the_strip(task):
    train = moment_of(task, 0, "title", {}).train
    begin = train.riders[-1].position - 60.0
    for rider in train.riders:
        assert begin <= rider.places[0] < begin + 1
        assert rider.places[-1] == pytest.approx(rider.position, abs=0.5)
    assert train.line.x[0] <= begin + 1
    assert train.line.x[-1] >= train.riders[0].position + 0.7 * 60


def test_one_that_is_not_on_the_line_yet_has_no_force():
    now = moment_of(driven(50), 0, "title", {})
    assert now.position > 0 > now.train.riders[1].position
    assert not now.train.riders[1].filtered.size
    marked = columns_of(Picture(*SIZE).draw(now), OTHERS[0])
    assert marked.size  # it stands there nevertheless


def test_a_terminal_shows_the_controlled_one_and_names_all(task):
    told = text(Strip(task, "pd"))
    assert "pantograph 2 of en50318-2002 and dsa250 on en50318-2002" in told
    assert f"{task.plant.of(0, Row.STEP) * task.plant.time_step:.2f} s  208 m" in told
    assert "1 en50318-2002: 308 m" in told
    assert "2 dsa250: 208 m" in told


@pytest.mark.longer
def test_a_film_of_a_saved_train_repeats_it(tmp_path):
    path = tmp_path / "train.parquet"
    run = simulate(**TRAIN | {"spans": 20}, controlled=[2], policy="p", distance=600.0)
    run.save(path)
    (filmed,) = saved_passes([str(path)]).values()
    filmed.check()
    what = excerpt(filmed, 2, 0.05, 4.0)
    assert what.begin == pytest.approx((60.0 + 100.0) / run.speed, abs=0.01)
    drawn = list(frames([filmed], what, SIZE))
    assert drawn[0].shape == (600, 800, 3)
    spans = run.followers[0].spans()
    told = figures_in_words(filmed, filmed)
    assert f"{run.followers[0].summary(spans).std:.1f} N" in told.values()
    _, settings = load_with_settings(path)
    with pytest.raises(InputError, match="comes out differently"):
        check_made_anew(run, settings | {"distances": [101.0]}, path)
