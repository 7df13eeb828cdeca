"""Names that no file can have: refused with a clear message before the system fails in its own ways."""

from __future__ import annotations

import math
import os
import re
import stat
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from .errors import InputError, shown

LONGEST_NAME = 200
"""Maximum bytes of a file's or folder's name; systems allow 255, but a temporary file's name is longer."""
LONGEST_PATH = 3000
"""Maximum bytes of a whole path; Linux allows 4096."""


def check_path(path: str | Path) -> None:
    """Raise InputError for a path that no file or folder can have."""
    text = os.fspath(path)
    if "\0" in text:
        raise InputError(f"{shown(text)} cannot be a file: its name contains a null byte.")
    try:
        sizes = [len(part.encode()) for part in Path(text).parts]
    except UnicodeEncodeError as error:
        raise InputError(f"{shown(text)} cannot be a file: its name is not text in UTF-8.") from error
    if max(sizes, default=0) > LONGEST_NAME or sum(sizes) > LONGEST_PATH:
        raise InputError(
            f"{text[:40]}... cannot be a file: the maximum is {LONGEST_NAME} bytes for a name, "
            f"{LONGEST_PATH} for a path."
        )


@contextmanager
def alone_in(folder: Path, doing: str) -> Iterator[None]:
    """Within the body no other process is in the folder, as far as files can be locked there.

    doing: what a process does there, such as "trains into". The folder is made if necessary; the system
    releases the lock of a killed process. Raises InputError where another process holds the lock.
    """
    make_folder(folder)
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise InputError(f"Another process {doing} {folder}; wait until it has ended, or end it.") from error
    except (OSError, NotImplementedError):
        pass  # files cannot be locked here
    try:
        yield
    finally:
        lock.release()


TRIAL = 4096
"""Bytes written to test whether a folder is writable: the smallest unit that a disk stores."""


@contextmanager
def write_whole(path: str | Path) -> Iterator[Path]:
    """A temporary path to write to, which replaces ``path`` at the end.

    If the body raises, ``path`` is unchanged. A symbolic link stays: its target is replaced. Raises
    InputError where the file cannot be written, the body's OSError included, or is not a regular file.
    """
    check_path(path)
    target = regular_file(path)
    temporary = None
    try:
        try:
            temporary = _beside(target, Path(path).suffix)
            yield temporary
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
            _reach_the_disk(temporary)
            temporary.replace(target)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {_reason(error)}.") from error
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def _reach_the_disk(path: Path) -> None:
    """Wait until a file is on the disk: otherwise a power failure may leave its name without its content."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def regular_file(path: str | Path) -> Path:
    """Path of a regular file, existing or not, with symbolic links resolved.

    Raises InputError where something else has this name: a folder, a device, a pipe or a socket.
    """
    try:
        target = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
        mode = os.lstat(target).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return target
    except OSError as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}.") from error
    if stat.S_ISDIR(mode):
        raise InputError(f"{path} cannot be written: it is a folder.")
    if stat.S_ISLNK(mode):
        raise InputError(f"{path} cannot be written: its symbolic links lead round in a circle.")
    if not stat.S_ISREG(mode):
        raise InputError(
            f"{path} cannot be written: it is not a regular file, but a device, a pipe or a socket."
        )
    return target


def _beside(target: Path, suffix: str) -> Path:
    """A new and empty file in the folder of another one; suffix: of the new file, which sets its format."""
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-", suffix=suffix)
    os.close(handle)
    return Path(name)


def _reason(error: OSError) -> str:
    """The system's own description of an error."""
    return os.strerror(error.errno) if error.errno else str(error).rstrip(".")


PICTURES = (".png", ".svg", ".pdf")
"""Suffixes of files for plots."""
PAGES = (".html",)
"""Suffixes of files for pages."""


def check_output(path: str | Path, suffixes: Sequence[str]) -> None:
    """Raise InputError unless a file of this name can be written; to be called before any work begins.

    suffixes: the allowed ones, in lower case. The folder must exist: it is not made.
    """
    check_path(path)
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        which = f"one of {', '.join(suffixes)}" if len(suffixes) > 1 else suffixes[0]
        raise InputError(f"{path} must end in {which}.")
    target = regular_file(path)
    if not os.path.exists(target.parent):
        raise InputError(f"{path} cannot be written: there is no folder {target.parent}, so make it first.")
    if not target.parent.is_dir():
        raise InputError(f"{path} cannot be written: {target.parent} is not a folder.")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{path} cannot be written: the folder {target.parent} is write-protected.")
    _try(target, f"{path} cannot be written")


def _try(target: Path, otherwise: str) -> None:
    """Write a trial file in the folder of another one, and remove it, to find a full or read-only disk."""
    trial = None
    try:
        try:
            trial = _beside(target, target.suffix)
            trial.write_bytes(bytes(TRIAL))
        finally:
            if trial is not None:
                trial.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{otherwise}: {_reason(error)}.") from error


def make_folder(path: str | Path) -> None:
    """Make a folder and those above it.

    Raises InputError where it cannot be made, or nothing can be written into it.
    """
    check_path(path)
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"The folder {path} cannot be made: {_reason(error)}.") from error
    _try(Path(path) / "trial", f"Nothing can be written into the folder {path}")


def check_regular(path: str | Path) -> None:
    """Raise InputError where a file to be read is a device, a pipe or a socket: reading might never end."""
    check_path(path)
    try:
        mode = os.stat(path).st_mode
    except OSError:  # reading it says why
        return
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise InputError(
            f"{path} could not be read: it is not a regular file, but a device, a pipe or a socket."
        )


LARGEST = 20_000_000
"""Maximum bytes of a TOML file; those of people have some thousands."""
DEEPEST = 32
"""Maximum levels of tables and lists within each other; settings have five."""
MOST_KEYS = 20_000
"""Maximum keys in all tables of a TOML file: a line of a thousand spans has some thousands."""
# A key of more parts; possessive, so that no text makes it slow.
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:{_PART}){{{DEEPEST}}}", re.ASCII)


def read_toml(path: str | Path) -> dict[str, Any]:
    """The table of a TOML file in UTF-8. Raises InputError, naming the file, where it cannot be read."""
    check_regular(path)
    text = ""
    try:
        if os.stat(path).st_size > LARGEST:
            raise ValueError(f"it has more than {LARGEST / 1e6:g} MB")
        text = Path(path).read_text(encoding="utf-8-sig")  # editors of Windows begin a file with U+FEFF
        if _DEEP_KEY.search(text):
            raise RecursionError
        table = tomllib.loads(text)
        check_nesting(table, MOST_KEYS)
        return table
    except FileNotFoundError as error:
        raise InputError(f"{path} could not be read: there is no such file; check the path.") from error
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} could not be read: it is not text in UTF-8.") from error
    except RecursionError as error:
        raise InputError(f"{path} is not valid TOML: it is nested too deeply; correct the file.") from error
    except ValueError as error:  # TOML's own, and for whole numbers with thousands of digits
        comma = _decimal_comma(text, str(error))
        raise InputError(f"{path} is not valid TOML: {error}; {comma or 'correct the file'}.") from error


def _decimal_comma(text: str, error: str) -> str:
    """Advice where the line that an error names holds a number with a decimal comma, else nothing."""
    line = re.search(r"at line (\d+)", error)
    number = re.search(r"\d+,\d+", text.split("\n")[int(line[1]) - 1].partition("#")[0]) if line else None
    return f"decimals need a point, not a comma, as in {number[0].replace(',', '.')}" if number else ""


def check_nesting(table: Any, most_keys: float = math.inf) -> None:
    """Raise RecursionError for tables nested too deeply, ValueError for more keys than ``most_keys``.

    What is read of a file goes through functions that call themselves for each level.
    """
    level, keys = [table], 0
    for _ in range(DEEPEST + 1):
        below: list[Any] = []
        for value in level:
            if isinstance(value, Mapping):
                keys += len(value)
                below += value.values()
            elif isinstance(value, list):
                below += value
        level = [value for value in below if isinstance(value, Mapping | list)]
        if keys > most_keys:
            raise ValueError(f"it has more than {most_keys:,} keys")
        if not level:
            return
    raise RecursionError


def finite(value: Any) -> Any:
    """Plain data for JSON: arrays as lists, and null for numbers that are not finite."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
