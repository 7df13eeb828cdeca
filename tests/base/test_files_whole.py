"""Files are written whole or not at all, into regular files alone, and through links to what they lead to."""

import errno
import os
import re
import socket
import stat
import sys
from pathlib import Path

import pytest

from panto_env import InputError
from panto_env.base import files
from panto_env.base.checksums import read_checked
from panto_env.base.files import check_output, make_folder, read_toml, write_whole

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes, sockets and links of Unix")


def write(path, text="new"):
    with write_whole(path) as temporary:
        temporary.write_text(text)


def special(folder, kind):
    """Something of a name that ends in .json and is no regular file."""
    path = folder / "out.json"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as one:
            before = os.getcwd()
            os.chdir(folder)  # the name of a socket has to be short
            one.bind("out.json")
            os.chdir(before)
    elif kind == "link to a pipe":
        os.mkfifo(folder / "pipe")
        path.symlink_to("pipe")
    elif kind == "link to itself":
        path.symlink_to("out.json")
    elif kind == "links in a circle":
        (folder / "other.json").symlink_to("out.json")
        path.symlink_to("other.json")
    elif kind == "device":
        path.symlink_to(os.devnull)  # checked, and never opened
    return path


KINDS = ["pipe", "folder", "socket", "link to a pipe", "link to itself", "links in a circle"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_regular_file_is_refused_and_stays(kind, tmp_path):
    path = special(tmp_path, kind)
    before = stat.S_IFMT(os.lstat(path).st_mode)
    for attempt in (write, lambda path: check_output(path, (".json",))):
        with pytest.raises(InputError, match=r"out\.json cannot be written: it") as caught:
            attempt(path)
        assert "\n" not in str(caught.value)
        assert stat.S_IFMT(os.lstat(path).st_mode) == before
    assert not [each for each in os.listdir(tmp_path) if each.startswith(".")]


def test_a_device_is_refused_by_the_check(tmp_path):
    with pytest.raises(InputError, match="not a regular file"):
        check_output(special(tmp_path, "device"), (".json",))


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    real, link, second = tmp_path / "elsewhere" / "real.bin", tmp_path / "link.json", tmp_path / "second.json"
    real.write_text("old")
    link.symlink_to("elsewhere/real.bin")
    second.symlink_to("link.json")
    check_output(second, (".json",))
    with write_whole(second) as temporary:
        assert temporary.suffix == ".json"  # by which it is written
        temporary.write_text("new")
    assert real.read_text() == "new"
    assert link.is_symlink()
    assert second.is_symlink()
    assert not real.is_symlink()
    assert sorted(os.listdir(tmp_path / "elsewhere")) == ["real.bin"]


def test_a_link_that_leads_to_nothing_yet_is_followed(tmp_path):
    link = tmp_path / "link.json"
    link.symlink_to("later.json")
    write(link)
    assert (tmp_path / "later.json").read_text() == "new"
    assert link.is_symlink()
    lost = tmp_path / "lost.json"
    lost.symlink_to("nowhere/later.json")
    with pytest.raises(InputError, match="there is no folder"):
        check_output(lost, (".json",))


@pytest.mark.parametrize("reason", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO])
@pytest.mark.parametrize("where", ["the body", "os.replace", "os.chmod"])
def test_a_disk_that_fails_leaves_the_old_file_and_nothing_else(where, reason, tmp_path, monkeypatch):
    path = tmp_path / "out.json"
    path.write_text("old")

    def fail(*_, **__):
        raise OSError(reason, os.strerror(reason))

    if where != "the body":
        monkeypatch.setattr(where, fail)
    with pytest.raises(InputError) as caught, write_whole(path) as temporary:  # noqa: PT012 - a body that fails
        temporary.write_text("half")
        if where == "the body":
            fail()
    assert str(caught.value) == f"{path} cannot be written: {os.strerror(reason)}."
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.json"]


CALLS = {
    "write": (write, ["os.path.islink", "os.lstat", "os.open", "os.fsync", "os.chmod", "os.replace"]),
    "check": (lambda path: check_output(path, (".json",)), ["os.path.islink", "os.lstat", "os.open"]),
    "make": (make_folder, ["os.mkdir"]),
    "read": (read_toml, ["os.open"]),
    "read JSON": (read_checked, ["os.open"]),
}


@pytest.mark.parametrize(("name", "call"), [(name, call) for name in CALLS for call in CALLS[name][1]])
def test_whatever_the_system_refuses_is_said_with_its_reason(name, call, tmp_path, monkeypatch):
    """And nothing has changed, and nothing is left behind."""
    path, attempt = tmp_path / "out.json", CALLS[name][0]
    if name != "make":
        path.write_text("a = 1")
    refused = []

    def refuse(*arguments, **_):
        refused.append(arguments)
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    with monkeypatch.context() as patch:
        patch.setattr(call, refuse)
        if call == "os.open":
            patch.setattr(Path, "open", refuse)
            patch.setattr("io.open", refuse)
        with pytest.raises(InputError) as caught:
            attempt(path)
    assert refused
    message = str(caught.value)
    assert "out.json" in message
    assert message.endswith(": Permission denied.")
    assert os.listdir(tmp_path) == ["out.json"] * (name != "make")
    assert name == "make" or path.read_text() == "a = 1"


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002, 0])
def test_a_file_may_be_read_and_written_by_whom_the_user_wants(mask, tmp_path):
    """As one that a program opens; a temporary file's own mode would keep it from everybody else."""
    before = os.umask(mask)
    try:
        write(tmp_path / "ours")
        (tmp_path / "plain").write_text("as any other")
        assert os.umask(mask) == mask, "of the user, as it was"
    finally:
        os.umask(before)
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("count", [1, 2, 3])
def test_all_suffixes_that_a_file_may_have_are_named(count, tmp_path):
    suffixes = (".png", ".svg", ".pdf")[:count]
    for suffix in suffixes:
        check_output(tmp_path / f"out{suffix.upper()}", suffixes)
    wanted = f"must end in {'one of ' * (count > 1)}{', '.join(suffixes)}."
    with pytest.raises(InputError, match=f"{re.escape(wanted)}$"):
        check_output(tmp_path / "out.doc", suffixes)


def test_a_full_disk_is_found_before_the_work(tmp_path, monkeypatch):
    real = files.Path.write_bytes

    def full(self, data):
        real(self, data[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.Path, "write_bytes", full)
    with pytest.raises(InputError, match=r"out\.json cannot be written: No space left on device\.$"):
        check_output(tmp_path / "out.json", (".json",))
    with pytest.raises(InputError, match=r"^Nothing can be written into the folder .*: No space left"):
        make_folder(tmp_path / "folder")
    assert os.listdir(tmp_path) == ["folder"]
    assert not os.listdir(tmp_path / "folder")


@pytest.mark.parametrize("name", ["a" * 5000 + ".json", "a\0b.json", "file/out.json"])
def test_names_that_no_file_can_have_are_refused(name, tmp_path):
    (tmp_path / "file").write_text("old")
    for attempt in (write, lambda path: check_output(path, (".json",))):
        with pytest.raises(InputError):
            attempt(tmp_path / name)
    assert os.listdir(tmp_path) == ["file"]


def test_an_interrupted_body_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), write_whole(tmp_path / "out.json") as temporary:  # noqa: PT012
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert not os.listdir(tmp_path)


def test_a_file_is_on_the_disk_before_it_takes_the_old_one_s_place(tmp_path, monkeypatch):
    path, done = tmp_path / "result.json", []
    path.write_text("old")
    monkeypatch.setattr(os, "fsync", lambda number: done.append(os.fstat(number).st_ino))
    with write_whole(path) as temporary:
        temporary.write_text("new")
        written = temporary.stat().st_ino
    assert done == [written] == [path.stat().st_ino]
    assert path.read_text() == "new"


def test_a_file_that_does_not_reach_the_disk_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "result.json"
    path.write_text("old")

    def fail(number):
        raise OSError(errno.EIO, "no")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match="cannot be written"), write_whole(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
