"""Compiled kernels on disk: what is damaged is compiled anew, what is another user's is not looked at."""

import os
import resource
import shutil
import stat
import subprocess
import sys

import pytest

from panto_env.backend import JIT, cache, compile

pytestmark = pytest.mark.skipif(not JIT, reason="nothing is compiled")

MODULE = """
from panto_env.backend import kernel

@kernel
def thrice(x):
    return 3.0 * x
"""
CALL = "from module import thrice; print(thrice(1.5), sum(thrice.stats.cache_hits.values()))"


@pytest.fixture
def call(tmp_path):
    """Calls a kernel in a process of its own; what it prints, and on standard error."""
    (tmp_path / "module.py").write_text(MODULE)
    (tmp_path / "tmp").mkdir()

    def call(cache="cache", **options):
        environment = os.environ | {"PANTO_CACHE_DIR": str(tmp_path / cache), "TMPDIR": str(tmp_path / "tmp")}
        told = subprocess.run(
            [sys.executable, "-c", CALL],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            **options,
        )
        assert told.returncode == 0, told.stderr
        return told.stdout.split(), told.stderr

    return call


def files(folder, suffix):
    return [path for path in folder.rglob("*") if path.suffix == suffix]


DAMAGES = {
    "empty": lambda data: b"",
    "half": lambda data: data[: len(data) // 2],
    "garbage": lambda data: os.urandom(len(data)),
    "bit": lambda data: (
        data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 4]) + data[len(data) // 2 + 1 :]
    ),
    "check": lambda data: bytes([data[0] ^ 1]) + data[1:],
}


def test_a_damaged_kernel_is_compiled_anew(call, tmp_path):
    assert call() == (["4.5", "0"], "")
    assert call() == (["4.5", "1"], "")
    for suffix in (".nbi", ".nbc"):
        for name, damaged in DAMAGES.items():
            copy = tmp_path / f"{name}{suffix}"
            shutil.copytree(tmp_path / "cache", copy)
            (file,) = files(copy, suffix)
            file.write_bytes(damaged(file.read_bytes()))
            assert call(copy.name) == (["4.5", "0"], ""), copy.name
    assert call(copy.name) == (["4.5", "1"], "")  # and is kept again


def test_where_the_disk_is_full_it_runs_and_says_that_nothing_is_kept(call):
    def no_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    told, said = call(preexec_fn=no_room)
    assert told == ["4.5", "0"]
    assert "Compiled kernels cannot be kept in" in said
    assert "Traceback" not in said
    assert call()[0] == ["4.5", "0"]
    assert call()[0] == ["4.5", "1"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where this process would keep kernels, asked anew."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("PANTO_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(cache.tempfile, "tempdir", str(tmp_path / "tmp"))
    return cache.cache_folder.__wrapped__


def test_it_is_the_user_s_alone(folder, tmp_path):
    found = folder()
    assert found == tmp_path / "cache" / cache.source_hash()
    assert stat.S_IMODE(found.stat().st_mode) == 0o700
    assert folder() == found


def plant(place, how, tmp_path):
    """What another user may have put where kernels are looked for."""
    place.parent.mkdir(parents=True, exist_ok=True)
    if how == "link":
        (tmp_path / "elsewhere").mkdir(exist_ok=True)
        place.symlink_to(tmp_path / "elsewhere")
    else:
        place.mkdir()
        place.chmod(0o777)


@pytest.mark.parametrize("how", ["link", "open"])
def test_a_folder_that_others_can_write_to_is_left_alone(folder, tmp_path, how):
    """The wanted one first, then the one in the temporary folder, whose name is known, and its parent."""
    wanted = tmp_path / "cache" / cache.source_hash()
    common = tmp_path / "tmp" / f"panto_env-{cache._user()}"
    plant(wanted, how, tmp_path)
    assert folder() == common / cache.source_hash()
    (common / cache.source_hash()).rmdir()
    common.rmdir()
    plant(common, how, tmp_path)
    alone = folder()
    assert alone.parent == tmp_path / "tmp"
    assert alone != common
    assert stat.S_IMODE(alone.stat().st_mode) == 0o700
    assert folder() != alone  # as fresh each time as the process that asks


def test_another_user_s_folder_is_left_alone(folder, tmp_path, monkeypatch):
    own = folder()
    monkeypatch.setattr(cache, "_user", lambda: own.stat().st_uid + 1)
    assert folder().parent == tmp_path / "tmp"


def test_where_no_folder_can_be_made_kernels_run_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PANTO_CACHE_DIR", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(cache.tempfile, "tempdir", str(tmp_path / "file" / "tmp"))
    found = cache.cache_folder.__wrapped__()
    assert found is None
    monkeypatch.setattr(compile, "cache_folder", lambda: found)
    assert compile.kernel(lambda x: 5.0 * x)(2.0) == 10.0
