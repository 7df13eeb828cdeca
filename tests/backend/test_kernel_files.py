"""Compiled kernels on disk: damaged ones are compiled anew, another user's are not looked at."""

import os
import platform
import resource
import shutil
import stat
import subprocess
import sys

import pytest

from panto_env.backend import JIT, cache, compile, kept_kernels

pytestmark = pytest.mark.skipif(not JIT, reason="nothing is compiled")

MODULE = """
from panto_env.backend import kernel

@kernel
def thrice(x):
    return 3.0 * x
"""
CALL = "from module import thrice; print(thrice(1.5), sum(thrice.stats.cache_hits.values()))"


@pytest.fixture
def start(tmp_path):
    """Starts a process that may compile a kernel; those that are left at the end are ended."""
    (tmp_path / "module.py").write_text(MODULE)
    (tmp_path / "tmp").mkdir()
    started = []

    def start(code, cache="cache", variables=None, **options):
        own = {"PANTO_CACHE_DIR": str(tmp_path / cache), "TMPDIR": str(tmp_path / "tmp")}
        options |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": tmp_path}
        environment = os.environ | own | (variables or {})
        started.append(subprocess.Popen([sys.executable, "-c", code], env=environment, **options))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def call(start):
    """Calls a kernel in a process of its own; what it prints, and on standard error."""

    def call(cache="cache", code=CALL, variables=None, **options):
        process = start(code, cache, variables, **options)
        told, said = process.communicate(timeout=120)
        assert process.returncode == 0, said
        return told.split(), said

    return call


START = "from pathlib import Path; import time\nwhile not Path('go').exists(): time.sleep(0.01)\n"


@pytest.mark.slow
def test_processes_that_compile_at_once_never_run_one_another_s_kernel(start, tmp_path):
    """Each for other types first: Numba may keep one form under both names."""
    code = START + "from module import thrice; print(thrice(%s), thrice(%s))"
    started = [start(code % order) for order in (("1.5", "2"), ("2", "1.5"))]
    (tmp_path / "go").touch()
    told = [process.communicate(timeout=120) for process in started]
    assert told == [("4.5 6.0\n", ""), ("6.0 4.5\n", "")]
    assert start(code % ("1.5", "2")).communicate(timeout=120) == ("4.5 6.0\n", "")


@pytest.mark.slow
def test_of_processes_that_need_the_same_one_only_one_compiles(start, tmp_path):
    """The others wait for it, and have it from the disk."""
    started = [start(START + CALL) for _ in range(4)]
    (tmp_path / "go").touch()
    told = [process.communicate(timeout=120)[0].split() for process in started]
    assert [value for value, _ in told] == ["4.5"] * 4
    assert sorted(hits for _, hits in told) == ["0", "1", "1", "1"]


@pytest.mark.slow
def test_a_process_that_stands_still_while_it_compiles_blocks_nobody_for_long(start, tmp_path):
    compiling = "module.thrice._compiler.compile = lambda *_: print(flush=True) or time.sleep(600)"
    still = start(f"import module, time; {compiling}; module.thrice(1.5)")
    assert still.stdout.readline() == "\n"
    assert list((tmp_path / "cache").rglob("*.lock"))
    brief = "from panto_env.backend import kept_kernels; kept_kernels.LONGEST_WAIT = 0.5\n"
    assert start(brief + CALL).communicate(timeout=120) == ("4.5 0\n", "")


@pytest.mark.slow
def test_a_process_that_dies_while_it_compiles_blocks_nobody(call, tmp_path):
    slow = "import module, os; module.thrice._compiler.compile = lambda *_: os._exit(3); module.thrice(1.5)"
    with pytest.raises(AssertionError):
        call(code=slow)
    assert call() == (["4.5", "0"], "")


@pytest.mark.slow
def test_a_compilation_is_announced_where_somebody_sees_it(call):
    shown = "import sys; sys.stderr.isatty = lambda: True\n" + CALL
    told, said = call(code=shown)
    assert told == ["4.5", "0"]
    assert said.startswith("Compiling kernels, 10 to 30 s, ")
    assert said.count("\n") == 1
    assert call(code=shown) == (["4.5", "1"], "")


OWN = """
import numpy as np
from panto_env.identification.response import recur
recur(np.eye(2), np.ones((3, 2)), np.zeros((4, 2)))
print(sum(recur.stats.cache_hits.values()))
"""
"""Calls a kernel of the package."""
ON_X86 = platform.machine() == "x86_64"


@pytest.mark.skipif(not ON_X86, reason="the wheel's kernels are for another kind of processor")
@pytest.mark.slow
def test_a_kernel_that_the_wheel_brought_is_used_where_none_is_kept(call, tmp_path):
    """Not one of other sources, nor a damaged one; nor where the processor is of another class."""
    lesser = {"NUMBA_CPU_NAME": kept_kernels.CLASS, "NUMBA_CPU_FEATURES": ""}
    assert call("built", OWN, lesser) == (["0"], "")
    built = str(tmp_path / "built")
    use = f"from panto_env.backend import kept_kernels as k; k.BROUGHT = k.Path({built!r})\n"
    assert call("first", use + OWN) == (["1"], "")
    assert not files(tmp_path / "first", ".nbc")
    assert call("class", use + "k.FEATURES = ('none',)\n" + OWN) == (["0"], "")
    (kernel,) = files(tmp_path / "built", ".nbc")
    kernel.write_bytes(DAMAGES["bit"](kernel.read_bytes()))
    assert call("second", use + OWN) == (["0"], "")
    (folder,) = {each.parent for each in files(tmp_path / "built", ".nbi")}
    folder.rename(folder.with_name("0" * 16))
    assert call("third", use + OWN) == (["0"], "")


def files(folder, suffix):
    return [path for path in folder.rglob("*") if path.suffix == suffix]


DAMAGES = {
    "empty": lambda data: b"",
    "half": lambda data: data[: len(data) // 2],
    "bit": lambda data: (
        data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 4]) + data[len(data) // 2 + 1 :]
    ),
}


IN_TURN = """
import importlib, os, sys
from panto_env.backend import cache
for folder in sys.argv[1:]:
    os.environ["PANTO_CACHE_DIR"] = folder
    cache.cache_folder.cache_clear()
    sys.modules.pop("module", None)
    module = importlib.import_module("module")
    print(module.thrice(1.5), sum(module.thrice.stats.cache_hits.values()))
"""
"""Calls the kernel with one cache after the other."""


@pytest.mark.slow
def test_a_damaged_kernel_is_compiled_anew(call, tmp_path):
    assert call() == (["4.5", "0"], "")
    copies = []
    for suffix in (".nbi", ".nbc"):
        for name, damaged in DAMAGES.items():
            copies.append(tmp_path / f"{name}{suffix}")
            shutil.copytree(tmp_path / "cache", copies[-1])
            (file,) = files(copies[-1], suffix)
            file.write_bytes(damaged(file.read_bytes()))
    told, said = call(code=f"import sys; sys.argv = ['', *{list(map(str, copies))}]" + IN_TURN)
    assert (told, said) == (["4.5", "0"] * 6, "")
    assert call(copies[-1].name) == (["4.5", "1"], "")  # and is kept again
    assert call() == (["4.5", "1"], "")


@pytest.mark.slow
def test_where_the_disk_is_full_it_runs_and_says_that_nothing_is_kept(call):
    def no_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    told, said = call(preexec_fn=no_room)
    assert told == ["4.5", "0"]
    assert "Compiled kernels cannot be stored in" in said
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
def test_a_folder_that_others_can_write_to_is_left_alone(folder, tmp_path, how, monkeypatch):
    """The wanted one first, then the one in the temporary folder, whose name is known, and its parent."""
    wanted = tmp_path / "cache" / cache.kernel_hash()
    common = tmp_path / "tmp" / f"panto_env-{cache._user()}"
    assert folder() == wanted
    assert stat.S_IMODE(wanted.stat().st_mode) == 0o700
    with monkeypatch.context() as other:
        other.setattr(cache, "_user", lambda: wanted.stat().st_uid + 1)
        assert folder().parent == tmp_path / "tmp"
    wanted.rmdir()
    plant(wanted, how, tmp_path)
    assert folder() == common / cache.kernel_hash()
    shutil.rmtree(common / cache.kernel_hash())
    shutil.rmtree(common)
    plant(common, how, tmp_path)
    alone = folder()
    assert alone.parent == tmp_path / "tmp"
    assert alone != common
    assert stat.S_IMODE(alone.stat().st_mode) == 0o700
    assert folder() != alone  # as fresh each time as the process that asks


def test_where_no_folder_can_be_made_kernels_run_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PANTO_CACHE_DIR", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(cache.tempfile, "tempdir", str(tmp_path / "file" / "tmp"))
    found = cache.cache_folder.__wrapped__()
    assert found is None
    monkeypatch.setattr(compile, "cache_folder", lambda: found)
    assert compile.kernel(lambda x: 5.0 * x)(2.0) == 10.0
