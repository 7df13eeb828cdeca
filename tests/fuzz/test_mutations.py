"""Files damaged at random: each is refused in one sentence, or says what it said before.

A file without a checksum may also say something else that is valid: a number that is still a number.
FILES=3000 is how many are damaged, evenly over the kinds.
"""

import os
import re
import warnings
from collections import Counter, defaultdict

import numpy as np
import pytest

from panto_env import InputError
from panto_env.backend import JIT
from panto_env.base.errors import LONGEST_LINE

from ..said import said
from .subjects import Subject, subjects

pytestmark = pytest.mark.skipif(not JIT, reason="plain Python takes too long")

Generator = np.random.Generator
ODD = (
    *b"nan inf -inf -1 0 1e400 -1e308 5e-324 true null 0x1F 1_000 2026-11-23 '' [] {} x [1,2] ,".split(),
    *(b"9" * 400, b"[" * 5000, b"\xff\xfe", b"\0", b'"', b"\r\n\r\n", b" " * 20_000),
)
TOKEN = re.compile(rb"-?\d+\.?\d*(?:e[+-]?\d+)?|\"[^\"\n]*\"|[A-Za-z_]+")


def flip(data: bytes, random: Generator) -> bytes:
    """Some single bits turned."""
    changed = bytearray(data)
    for _ in range(random.choice([1, 1, 1, 10])):
        bit = int(random.integers(8 * len(data)))
        changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def piece(data: bytes, random: Generator) -> bytes:
    """A piece is missing, zeros, noise, something odd, or stands there twice: mostly short, seldom large."""
    begin = int(random.integers(len(data) + 1))
    end = min(len(data), begin + 1 + int(len(data) ** random.random() * random.random()))
    odd = ODD[int(random.integers(len(ODD)))]
    instead = (b"", bytes(end - begin), random.bytes(end - begin), odd, data[begin:end] * 2)
    return data[:begin] + instead[int(random.integers(len(instead)))] + data[end:]


def cut_off(data: bytes, random: Generator) -> bytes:
    """The end is missing, as of a download that broke off."""
    return data[: int(random.integers(len(data)))]


def replace_token(data: bytes, random: Generator) -> bytes:
    """A number, a word or a text is something odd, or another one of the file."""
    tokens = list(TOKEN.finditer(data))
    if not tokens:
        return flip(data, random)
    token, other = (tokens[int(random.integers(len(tokens)))] for _ in range(2))
    new = ODD[int(random.integers(len(ODD)))] if random.random() < 0.5 else other.group()
    return data[: token.start()] + new + data[token.end() :]


def change_lines(data: bytes, random: Generator) -> bytes:
    """A line is missing, stands there twice, or elsewhere."""
    lines = data.splitlines(keepends=True)
    line = lines.pop(int(random.integers(len(lines)))) if len(lines) > 1 else b""
    for _ in range(int(random.integers(3))):
        lines.insert(int(random.integers(len(lines) + 1)), line)
    return b"".join(lines)


MUTATIONS = (flip, piece, cut_off, replace_token, change_lines)


def end_of(subject: Subject, path, whole: str) -> str:
    """How reading a damaged file ends."""
    try:
        with warnings.catch_warnings(action="ignore"):
            now = said(subject.read(path))
    except InputError as error:
        text = str(error)
        good = text.endswith((".", "?", "!")) and "\n" not in text and len(text) <= LONGEST_LINE + 10
        return "refused" if good else f"not one sentence: {text[:2000]!r}"
    except Exception as error:
        return repr(error)[:2000]
    return "unchanged" if now == whole else "changed in silence" if subject.checked else "valid otherwise"


def check(name: str, subject: Subject, seeds: range, folder) -> Counter[str]:
    """How often each end came; asserts that none is bad."""
    data, ends, whole = subject.file.read_bytes(), Counter(), said(subject.read(subject.file))
    path = folder / subject.file.name
    for seed in seeds:
        mutation = MUTATIONS[seed % len(MUTATIONS)]
        changed = mutation(data, np.random.default_rng(seed))
        if changed != data:
            path.write_bytes(changed)
            end = end_of(subject, path, whole)
            assert end in ("refused", "unchanged", "valid otherwise"), (name, seed, mutation.__name__, end)
            ends[end] += 1
    return ends


@pytest.mark.slow
def test_thousands(tmp_path):
    (tmp_path / "files").mkdir()
    found = subjects(tmp_path / "files")
    each, kinds = -(-int(os.environ.get("FILES", "3000")) // len(found)), defaultdict(Counter)
    for name, subject in found.items():
        kinds[subject.kind] += check(name, subject, range(each), tmp_path)
    print(dict(kinds))
    assert set(kinds) == {"TOML", "CSV", "Parquet", "JSON", "model"}
    for kind, counts in kinds.items():
        assert counts["refused"] > 0.3 * counts.total(), kind  # else it is the damage that is none


@pytest.mark.slow
def test_none_of_a_file_with_a_checksum_goes_unnoticed(tmp_path):
    (tmp_path / "files").mkdir()
    for name, subject in subjects(tmp_path / "files").items():
        if subject.checked:
            assert check(name, subject, range(25), tmp_path)["refused"] > 10
