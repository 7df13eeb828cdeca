"""A film is written whole or not at all: on a full disk, and by an encoder that is killed or broken."""

import os
import sys
from subprocess import Popen

import numpy as np
import pytest

from panto_env import InputError

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.render import film, video
from panto_env.render.video import write_film

from ..command import panto
from ..full_disk import largest_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of Unix")

SIZE = (64, 64)
FILM = ["film", "passive", "--line-spans", "14", "--first-span", "2", "--seconds", "0.4", "--output"]
BROKEN = {
    "killed": ("kill -9 $$", "FFmpeg was killed by SIGKILL"),
    "killed at the end": ("cat > /dev/null; kill -9 $$", "FFmpeg was killed by SIGKILL"),
    "refuses": ("echo Unknown encoder >&2; exit 1", "FFmpeg ended too early, with status 1: Unknown encoder"),
    "fails at the end": (
        "cat > /dev/null; echo trailer: No space left on device >&2; exit 228",
        "No space left on device",
    ),
    "writes nothing": ("cat > /dev/null", "FFmpeg ended too early, with status 0"),
    "reads nothing": ("exit 0", "FFmpeg ended too early, with status 0"),
}


def noise(number=60):
    """Frames that fill the pipe to the encoder, so that one that has ended is noticed."""
    random = np.random.default_rng(0)
    return (random.integers(0, 255, (*SIZE, 3), dtype=np.uint8) for _ in range(number))


@pytest.mark.parametrize("size", [5000, 8192])
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_full_disk_is_one_sentence_and_the_film_before_stays(size, suffix, tmp_path, monkeypatch):
    """Full for frames, and for the encoder, which has the limits of the process that starts it."""
    (tmp_path / f"film{suffix}").write_text("old")
    frames = film.frames

    def then_full(*arguments):
        limit(size)
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


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_film_without_frames_is_refused(suffix, tmp_path):
    with pytest.raises(InputError, match="no frame"):
        write_film([], tmp_path / f"film{suffix}", 25, SIZE)
    assert not os.listdir(tmp_path)
