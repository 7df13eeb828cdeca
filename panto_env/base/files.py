"""Files: written whole or not at all, checked before any work begins, and TOML files read."""

from __future__ import annotations

import gzip
import math
import os
import re
import tomllib
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import Any

from filelock import FileLock, Timeout

from .errors import InputError
from .extras import require

TRIAL = 4096
"""Bytes written to test whether a folder is writable: the smallest unit that a disk stores."""
COMPRESSED = ".gz"
JSON = (".json", ".json" + COMPRESSED)
"""Suffixes of files for plain data, of which the second is compressed."""
PARQUET = ".parquet"
PICTURES = (".png", ".svg", ".pdf")
"""Suffixes of files for plots."""
PAGES = (".html",)
"""Suffixes of files for pages."""


@contextmanager
def alone_in(folder: Path, doing: str) -> Iterator[None]:
    """Within the body no other process is in the folder, which is made, as far as files can be locked there.

    doing: what a process does there, such as "trains into". The system releases the lock of a killed
    process. Raises InputError where another process holds it.
    """
    make_folder(folder)
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise InputError(f"Another process {doing} {folder}; wait until it has ended, or end it.") from error
    except (OSError, NotImplementedError):
        pass  # network drives without locks
    try:
        yield
    finally:
        lock.release()


@contextmanager
def write_whole(path: str | Path) -> Iterator[Path]:
    """A temporary path to write to, which replaces ``path`` at the end.

    If the body raises, ``path`` is unchanged. A symbolic link stays: its target is replaced. Raises
    InputError where the file cannot be written, the body's OSError included.
    """
    temporary = _beside(path)
    try:
        try:
            temporary.touch(exist_ok=False)
            yield temporary
            with temporary.open("rb+") as file:  # else a power failure may leave the name without its content
                os.fsync(file.fileno())
            temporary.replace(os.path.realpath(path))
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {_reason(error)}.") from error


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8, whole or not at all. Raises InputError where it cannot be written."""
    with write_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _beside(path: str | Path) -> Path:
    """A new name in the folder of a file, through links, with the same suffix, which sets its format."""
    target = Path(os.path.realpath(path))
    return target.with_name(f".{target.stem}-{token_hex(4)}{Path(path).suffix}")


def suffix_of(path: str | Path) -> str:
    """Suffix of a file's name in lower case, that of a compressed file with both parts: ".json.gz"."""
    suffixes = [suffix.lower() for suffix in Path(path).suffixes]
    return "".join(suffixes[-2:] if suffixes[-1:] == [COMPRESSED] else suffixes[-1:])


def with_suffix(path: str | Path, suffix: str) -> Path:
    """The path with another suffix in the place of its own."""
    target = Path(path)
    return target.with_name(target.name[: len(target.name) - len(suffix_of(target))] + suffix)


def _reason(error: OSError) -> str:
    """The system's own description of an error."""
    return os.strerror(error.errno) if error.errno else str(error).rstrip(".")


def check_output(path: str | Path, suffixes: Sequence[str]) -> None:
    """Raise InputError unless a file of this name can be written; to be called before any work begins.

    suffixes: the allowed ones, in lower case. The folder must exist: it is not made.
    """
    target = Path(path)
    if suffix_of(target) not in suffixes:
        which = f"one of {', '.join(suffixes)}" if len(suffixes) > 1 else suffixes[0]
        raise InputError(f"{path} must end in {which}.")
    if suffix_of(target) == PARQUET:
        others = [suffix for suffix in suffixes if suffix != PARQUET]
        require(str(path), "parquet", "pyarrow", otherwise=f"or end it in {' or '.join(others)}")
    if os.path.isdir(target):
        raise InputError(f"{path} cannot be written: it is a folder.")
    if not os.path.isdir(target.parent):
        raise InputError(f"{path} cannot be written: there is no folder {target.parent}, so make it first.")
    _try(target, f"{path} cannot be written")


def _try(target: Path, otherwise: str) -> None:
    """Write a trial file in the folder of another one, and remove it, to find a full or read-only disk."""
    trial = _beside(target)
    try:
        try:
            trial.write_bytes(bytes(TRIAL))
        finally:
            trial.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{otherwise}: {_reason(error)}.") from error


def make_folder(path: str | Path) -> None:
    """Make a folder and those above it.

    Raises InputError where it cannot be made, or nothing can be written into it.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"The folder {path} cannot be made: {_reason(error)}.") from error
    _try(Path(path) / "trial", f"Nothing can be written into the folder {path}")


def read_text(path: str | Path) -> str:
    """The text of a file in UTF-8, compressed by gzip if it is named so.

    Raises InputError, naming the file, where it cannot be read.
    """
    try:
        opened = gzip.open if suffix_of(path).endswith(COMPRESSED) else open
        with opened(path, "rt", encoding="utf-8-sig") as file:  # editors of Windows begin a file with U+FEFF
            text: str = file.read()
        return text
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"{path} could not be read: it is not compressed by gzip, or is damaged.") from error
    except FileNotFoundError as error:
        raise InputError(f"{path} could not be read: there is no such file; check the path.") from error
    except OSError as error:
        raise InputError(f"{path} could not be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} could not be read: it is not text in UTF-8.") from error


def read_toml(path: str | Path) -> dict[str, Any]:
    """The table of a TOML file in UTF-8. Raises InputError, naming the file, where it cannot be read."""
    text = read_text(path)
    try:
        return tomllib.loads(text)
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
