"""Films: which passes, how often a frame, and a file whole or not at all."""

import os
import sys
from dataclasses import replace
from subprocess import Popen
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env import InputError, simulate
from panto_env.cli import make_app
from panto_env.plant.alignment import Alignment
from panto_env.render import film, video
from panto_env.render.film import (
    FASTEST,
    Excerpt,
    _highest,
    excerpt,
    figures_in_words,
    frames,
    policy_pass,
    saved_passes,
)
from panto_env.render.video import write_film

from ..command import panto
from ..full_disk import largest_file
from .test_render import read

unix = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of Unix")

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
SHORT = STIFFNESS | {"distance": 100.0}
SIZE = (64, 64)
RUN = SimpleNamespace(
    alignment=Alignment.equal(50.0, 4),
    time=np.linspace(0.0, 4.0, 401),
    distance=200.0,
    time_at=lambda position: position / 50.0,
)


def passed(interval):
    return SimpleNamespace(run=SimpleNamespace(controlled=RUN), control_interval=interval)


@pytest.mark.parametrize(
    ("interval", "slow_motion", "every"),
    [(0.04, 1.0, 1), (0.0399, 1.0, 2), (0.01, 1.0, 4), (0.01, 4.0, 1), (0.01, 3.9, 2), (0.01, 0.5, 8)],
)
def test_a_frame_comes_at_most_25_times_a_second_and_as_often_as_it_may(interval, slow_motion, every):
    """An interval of 0.04 s gives 25 frames per second exactly."""
    what = excerpt(passed(interval), 2, 1.5, slow_motion)
    assert what.every == every
    assert what.rate == pytest.approx(1 / (every * interval * slow_motion))
    assert what.rate < FASTEST + 1e-9 == 25.0 + 1e-9
    assert (what.begin, what.end) == (1.0, 2.5)


def test_a_film_ends_with_its_run_and_begins_within_it():
    assert excerpt(passed(0.01), 4, 10.0, 1.0).end == 4.0
    assert excerpt(passed(0.01), 1, 10.0, 1.0).begin == 0.0
    with pytest.raises(
        InputError, match=r"^The run ends at 200 m, before span 5; begin in an earlier one\.$"
    ):
        excerpt(passed(0.01), 5, 1.0, 1.0)


def test_each_source_that_is_a_file_is_a_saved_pass(tmp_path):
    files = [tmp_path / "a.parquet", tmp_path / "b.PARQUET"]
    runs = [simulate(**SHORT, policy=policy, seed=3) for policy in ("p", None)]
    runs[0].save(files[0])
    runs[1].save(tmp_path / "b.parquet")
    (tmp_path / "b.parquet").rename(files[1])
    found = saved_passes(["pd", str(files[0]), "agent.safetensors", str(files[1])])
    assert list(found) == [str(files[0]), str(files[1])]
    assert [(each.title, each.policy, each.seed, each.file) for each in found.values()] == [
        ("p (a.parquet)", "p", 3, str(files[0])),
        ("passive (b.PARQUET)", "passive", 3, str(files[1])),
    ]
    for each, run in zip(found.values(), runs, strict=True):
        np.testing.assert_array_equal(each.run.contact_force, run.contact_force)
        assert each.control_interval == 0.01
    assert saved_passes([]) == {}


def test_a_pass_of_a_policy_has_the_run_that_simulate_makes_and_no_file():
    made = policy_pass("pd", SHORT | {"control_interval": 0.02}, 4)
    assert (made.title, made.policy, made.seed, made.file, made.control_interval) == ("pd", "pd", 4, "", 0.02)
    expected = simulate(**SHORT, control_interval=0.02, policy="pd", seed=4)
    np.testing.assert_array_equal(made.run.contact_force, expected.contact_force)
    made.check()  # nothing to repeat


@pytest.mark.longer
def test_a_pass_says_what_it_shows():
    alone = film._Pass(policy_pass("pd", SHORT, 0), {}, SIZE, 100.0)
    assert alone._title.startswith("pd: pantograph ")
    train = {"pantographs": ["dsa380"] * 2, "distances": [50.0], "speed_kmh": 200.0, "distance": 200.0}
    behind = film._Pass(policy_pass("passive", train, 0), {}, SIZE, 100.0)
    assert behind._title.startswith("passive: pantographs ")


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


def test_the_axis_of_a_film_fits_what_the_film_shows():
    """What a pass had long before and has afterwards does not count."""
    run = simulate("periodic-stiffness", "three-mass", 180.0, distance=400.0)
    for peak in (40.0, 60.0, 99.0, 101.0, 149.0, 151.0, 200.0, 399.0):
        force = np.where(np.abs(run.position - peak) < 0.2, 9000.0, 100.0)
        what = Excerpt(begin=165.0 / 50, end=150.0 / 50 + 1, every=1, rate=25.0)  # 165 to 200 m, at 50 m/s
        shown = 165 - 1.3 * 50 <= peak <= 200
        assert _highest(replace(run, contact_force=force), what) == (9000.0 if shown else 100.0), peak


@pytest.mark.longer
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_two_policies_are_filmed_above_each_other(tmp_path, suffix):
    path = tmp_path / f"film{suffix}"
    command = ["film", "passive", "pd", "--output", str(path), "--size", "640", "480", "--seconds", "0.1"]
    line = ["--catenary", "periodic-stiffness", "--pantograph", "three-mass", "--first-span", "2"]
    result = CliRunner().invoke(make_app(), [*command, *line, "--slow-motion", "5"])
    assert result.exit_code == 0, result.output
    assert "20 frames per second, 5 times slower than real" in result.output
    if suffix == ".mp4":
        meta, number = read(path)
        assert meta["size"] == (640, 480)
        assert meta["fps"] == 20
        assert number == pytest.approx(10, abs=1)
        assert meta["pix_fmt"].startswith("yuv420p")  # what every browser plays
    else:
        from PIL import Image

        film = Image.open(path)
        assert film.size == (640, 480)
        assert film.n_frames == pytest.approx(10, abs=1)


def test_a_change_of_spread_is_given_only_between_passes_that_differ_in_their_control():
    first, same, other = (
        policy_pass(name, STIFFNESS | {"distance": 600.0, "pantograph": pantograph}, 0)
        for name, pantograph in (("passive", "three-mass"), ("pd", "three-mass"), ("pd", "own-two-mass"))
    )
    of_first, of_same, of_other = (figures_in_words(each, first) for each in (first, same, other))
    assert "σ relative to passive" in of_same
    assert not any("relative" in text for text in [*of_first, *of_other])
    early = first._replace(run=replace(first.run, terminated=True))
    assert not any("relative" in text for text in figures_in_words(same, early))


def test_what_cannot_be_filmed_is_refused_in_a_sentence(tmp_path):
    for suffix, words in (
        (".avi", r"must end in one of \.mp4, \.gif"),
        (".mp4", "no frame"),
        (".gif", "no frame"),
    ):
        with pytest.raises(InputError, match=words):
            write_film([], tmp_path / f"film{suffix}", 25, SIZE)
    for arguments, words in (
        (["passive"] * 5, "up to 4 passes, not 5"),
        (["passive", "--size", "641", "480"], "even numbers of pixels"),
        (["passive", "pd", "--size", "640", "362"], "the height for each pass's part"),
    ):
        result = CliRunner().invoke(make_app(), ["film", *arguments, "--output", str(tmp_path / "film.mp4")])
        assert isinstance(result.exception, InputError)
        assert words in str(result.exception)
    assert list(tmp_path.iterdir()) == []


FILM = ["film", "passive", "--line-spans", "14", "--first-span", "2", "--seconds", "0.4", "--output"]
BROKEN = {
    "killed": ("kill -9 $$", "FFmpeg was killed by SIGKILL"),
    "refuses": ("echo Unknown encoder >&2; exit 1", "FFmpeg ended too early, with status 1: Unknown encoder"),
    "fails at the end": (
        "cat > /dev/null; echo trailer: No space left on device >&2; exit 228",
        "No space left on device",
    ),
    "writes nothing": ("cat > /dev/null", "FFmpeg ended too early, with status 0"),
}


def noise(number=60):
    """Frames that fill the pipe to the encoder, so that one that has ended is noticed."""
    random = np.random.default_rng(0)
    return (random.integers(0, 255, (*SIZE, 3), dtype=np.uint8) for _ in range(number))


@pytest.mark.slow
@unix
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_full_disk_is_one_sentence_and_the_film_before_stays(suffix, tmp_path, monkeypatch):
    """Full for frames, and for the encoder, which has the limits of the process that starts it."""
    (tmp_path / f"film{suffix}").write_text("old")
    frames = film.frames

    def then_full(*arguments):
        limit(5000)
        return frames(*arguments)

    monkeypatch.setattr(film, "frames", then_full)
    with largest_file() as limit:
        done = panto(*FILM, f"film{suffix}", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    announced, said = done.stderr.splitlines()
    assert announced == f"panto: warning: film{suffix} exists already and will be overwritten."
    assert said == f"panto: film{suffix} cannot be written: File too large."
    assert "The film is" not in done.stdout
    assert (tmp_path / f"film{suffix}").read_text() == "old"
    assert os.listdir(tmp_path) == [f"film{suffix}"]


@unix
@pytest.mark.parametrize("name", BROKEN)
def test_an_encoder_that_fails_is_one_sentence_and_the_film_before_stays(name, tmp_path, monkeypatch, capfd):
    script, words = BROKEN[name]
    encoder, path = tmp_path / "encoder", tmp_path / "out" / "film.mp4"
    encoder.write_text(f"#!/bin/sh\n{script}\n")
    encoder.chmod(0o755)
    path.parent.mkdir()
    path.write_text("old")
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
    with pytest.raises(InputError) as caught:
        write_film(noise(), path, 25, SIZE)
    assert str(caught.value) == f"{path} cannot be written: {words}."
    assert path.read_text() == "old"
    assert os.listdir(path.parent) == ["film.mp4"]
    assert capfd.readouterr() == ("", "")


def test_without_an_encoder_a_gif_is_suggested(tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "none"))
    with pytest.raises(InputError, match=r"need FFmpeg, and none was found; install it, or write a \.gif"):
        write_film(noise(), tmp_path / "film.mp4", 25, SIZE)
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_an_error_between_frames_leaves_neither_film_nor_encoder(suffix, tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(video, "Popen", lambda *a, **b: started.append(Popen(*a, **b)) or started[-1])

    def broken():
        yield from noise(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(broken(), tmp_path / f"film{suffix}", 25, SIZE)
    assert not os.listdir(tmp_path)
    assert len(started) == (suffix == ".mp4")
    assert all(each.returncode for each in started)


@unix
def test_an_interrupt_from_the_keyboard_does_not_reach_the_encoder(tmp_path, monkeypatch):
    sessions = []

    def start(*arguments, **options):
        process = Popen(*arguments, **options)
        sessions.append(os.getsid(process.pid))
        return process

    monkeypatch.setattr(video, "Popen", start)
    write_film(noise(3), tmp_path / "film.mp4", 25, SIZE)
    assert len(sessions) == 1
    assert sessions[0] != os.getsid(0)
