"""Files damaged at random: each is refused in one sentence, or says what it said before.

A file without a checksum may also say something else that is valid: a number that is still a number.

python -m tests.fuzz.mutations --count 10000   # tells each bad end, then how many there were of each kind
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from panto_env import InputError
from panto_env.base.errors import LONGEST_LINE

from ..said import said
from .processes import run_all
from .subjects import Subject, subjects

Generator = np.random.Generator
AT_ONCE = 25
"""Cases that share a process."""
LIMIT = 120.0
"""Seconds that they may take together."""
BAD = "BAD"
ODD = (
    *b"nan inf -inf -1 0 1e400 -1e308 5e-324 true null 0x1F 1_000 2026-11-23 '' [] {} x [1,2] ,".split(),
    *(b"9" * 400, b"[" * 5000, b"{'a':" * 500, b"\xff\xfe", b"\0", b'"', b"\r\n\r\n", b" " * 20_000),
)
TOKEN = re.compile(rb"-?\d+\.?\d*(?:e[+-]?\d+)?|\"[^\"\n]*\"|[A-Za-z_]+")


def _span(data: bytes, random: Generator) -> tuple[int, int]:
    """Begin and end of a piece: mostly short, seldom a large part."""
    begin = int(random.integers(len(data) + 1))
    longest = len(data) ** random.random()
    return begin, min(len(data), begin + 1 + int(longest * random.random()))


def flip(data: bytes, random: Generator) -> bytes:
    """Some single bits turned."""
    changed = bytearray(data)
    for _ in range(random.choice([1, 1, 1, 10])):
        bit = int(random.integers(8 * len(data)))
        changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def cut_out(data: bytes, random: Generator) -> bytes:
    """A piece is missing."""
    begin, end = _span(data, random)
    return data[:begin] + data[end:]


def cut_off(data: bytes, random: Generator) -> bytes:
    """The end is missing, as of a download that broke off."""
    return data[: int(random.integers(len(data)))]


def overwrite(data: bytes, random: Generator) -> bytes:
    """A piece is zeros, or noise."""
    begin, end = _span(data, random)
    return (
        data[:begin]
        + (bytes(end - begin) if random.random() < 0.5 else random.bytes(end - begin))
        + data[end:]
    )


def insert(data: bytes, random: Generator) -> bytes:
    """Noise, or something odd, stands in between."""
    place = int(random.integers(len(data) + 1))
    more = random.bytes(int(random.integers(1, 9))) if random.random() < 0.5 else _odd(random)
    return data[:place] + more + data[place:]


def repeat(data: bytes, random: Generator) -> bytes:
    """A piece stands there twice."""
    begin, end = _span(data, random)
    return data[:end] + data[begin:]


def exchange(data: bytes, random: Generator) -> bytes:
    """Two pieces have changed their places."""
    (a, b), (c, d) = sorted((_span(data, random), _span(data, random)))
    b = min(b, c)
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def replace_token(data: bytes, random: Generator) -> bytes:
    """A number, a word or a text is something odd, or another one of the file."""
    tokens = list(TOKEN.finditer(data))
    if not tokens:
        return flip(data, random)
    token, other = (tokens[int(random.integers(len(tokens)))] for _ in range(2))
    return (
        data[: token.start()]
        + (_odd(random) if random.random() < 0.5 else other.group())
        + data[token.end() :]
    )


def change_lines(data: bytes, random: Generator) -> bytes:
    """A line is missing, stands there twice, or elsewhere."""
    lines = data.splitlines(keepends=True)
    line = lines.pop(int(random.integers(len(lines)))) if len(lines) > 1 else b""
    for _ in range(int(random.integers(3))):
        lines.insert(int(random.integers(len(lines) + 1)), line)
    return b"".join(lines)


MUTATIONS: tuple[Callable[[bytes, Generator], bytes], ...] = (
    flip,
    cut_out,
    cut_off,
    overwrite,
    insert,
    repeat,
    exchange,
    replace_token,
    change_lines,
)


def _odd(random: Generator) -> bytes:
    return ODD[int(random.integers(len(ODD)))]


def judged(subject: Subject, path: Path, whole: str) -> str:
    """How reading a damaged file ends; what begins with BAD must not be."""
    try:
        with warnings.catch_warnings(action="ignore"):
            now = said(subject.read(path))
    except InputError as error:
        text = str(error)
        good = text.endswith((".", "?", "!")) and "\n" not in text and len(text) <= LONGEST_LINE + 10
        return "refused" if good else f"{BAD}: not one sentence: {text[:2000]!r}"
    if now == whole:
        return "unchanged"
    return f"{BAD}: changed in silence" if subject.checked else "valid otherwise"


def run_cases(subject: Subject, seeds: range, folder: Path) -> None:
    """Damage the file under each seed; prints as JSON how often each end came, and each bad one's seed."""
    data, ends = subject.file.read_bytes(), Counter[str]()
    whole = said(subject.read(subject.file))
    for seed in seeds:
        random = np.random.default_rng(seed)
        mutation = MUTATIONS[seed % len(MUTATIONS)]
        changed = mutation(data, random)
        if changed == data:
            continue
        path = Path(tempfile.mkdtemp(dir=folder)) / subject.file.name
        path.write_bytes(changed)
        print(json.dumps({"trying": seed}), flush=True)
        kind = judged(subject, path, whole)
        if kind.startswith(BAD):
            print(json.dumps({"bad": f"seed {seed}, {mutation.__name__}: {kind}"}))
            kind = BAD
        ends[kind] += 1
        path.unlink()
    print(json.dumps({"ends": ends}), flush=True)


def tried(
    count: int, folder: Path, tell: Any = print, first: int = 0, only: str = ""
) -> dict[str, Counter[str]]:
    """How many damaged files ended in each way, by their kind; each bad one is told.

    count: of all together, evenly over the files.
    """
    files = folder / "files"
    files.mkdir()
    chosen = {name: each for name, each in subjects(files).items() if only in name}
    each = -(-count // len(chosen))
    work = [
        (name, range(begin, min(begin + AT_ONCE, first + each)))
        for name in chosen
        for begin in range(first, first + each, AT_ONCE)
    ]
    cases = [partial(run_cases, chosen[name], seeds, folder) for name, seeds in work]
    ends: dict[str, Counter[str]] = {subject.kind: Counter() for subject in chosen.values()}
    for number, end in run_all(cases, folder, LIMIT):
        name = work[number][0]
        lines = [json.loads(line) for line in end.output.splitlines()]
        for line in lines:
            if "bad" in line:
                tell(f"{name}, {line['bad']}")
            ends[chosen[name].kind].update(line.get("ends", {}))
        if end.status != 0:
            last = next((line["trying"] for line in lines[::-1] if "trying" in line), None)
            tell(f"{name}, seed {last}: status {end.status} after {end.seconds:.0f} s\n{end.errors[-1500:]}")
            ends[chosen[name].kind][BAD] += 1
    return ends


def main() -> None:
    """Try as many as asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="files alone that have this in their name")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ends = tried(given.count, Path(folder), first=given.first, only=given.only)
    print(json.dumps(ends))
    sys.exit(any(BAD in counts for counts in ends.values()))


if __name__ == "__main__":
    main()
