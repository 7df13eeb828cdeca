"""Every limit that a message or a document names: what lies on it is taken, what lies beyond is not."""

import json
import os
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from panto_env import InputError
from panto_env.base import checksums as remember
from panto_env.base import errors as shown
from panto_env.base import files, machine
from panto_env.base import files as paths
from panto_env.base import settings as explanation
from panto_env.base import table as table_file
from panto_env.base.checksums import read_checked, write_checked
from panto_env.base.errors import beside

# As the documents and messages have them.
NAME, PATH, DEPTH, KEYS, BYTES = 200, 3000, 32, 20_000, 20_000_000


def path_of(length):
    """A path whose parts have this many bytes together."""
    parts = ["a" * NAME] * (length // NAME) + ["b" * (length % NAME)] * (length % NAME > 0)
    return str(Path(*parts))


def nested(depth):
    """A table of so many tables within each other."""
    return "[" + ".".join(["a"] * (depth - 1)) + "]\nb = 1"


def tables(depth):
    table = 1
    for _ in range(depth):
        table = {"a": table}
    return table


LIMITS = {
    "a name": (lambda n: paths.check_path("a" * n), NAME),
    "a name in bytes": (lambda n: paths.check_path("\u03c3" * (n // 2) + "a" * (n % 2)), NAME),
    "a path": (lambda n: paths.check_path(path_of(n)), PATH),
    "levels": (lambda n: files.check_nesting(tables(n)), DEPTH + 1),
    "keys": (lambda n: files.check_nesting(dict.fromkeys(map(str, range(n)), 0), KEYS), KEYS),
}


@pytest.mark.parametrize("name", LIMITS)
def test_what_is_on_a_limit_is_taken_and_one_more_is_not(name):
    check, limit = LIMITS[name]
    check(limit)
    with pytest.raises((InputError, RecursionError, ValueError)):
        check(limit + 1)


def test_a_file_of_settings_has_up_to_twenty_million_bytes(tmp_path, monkeypatch):
    assert files.LARGEST == BYTES
    monkeypatch.setattr(files, "LARGEST", 30)  # the same, in less time
    path = tmp_path / "long.toml"
    path.write_text("a = 1\n#" + "." * 23)
    assert files.read_toml(path) == {"a": 1}
    path.write_text("a = 1\n#" + "." * 24)
    with pytest.raises(InputError, match="is not valid TOML: it has more than"):
        files.read_toml(path)


def test_other_numbers_that_a_user_meets():
    """In messages and in what is shown; whoever changes one changes the documents."""
    assert (shown.LONGEST, shown.LONGEST_LINE, explanation.MOST, remember.KEPT) == (300, 1000, 8, 16)
    assert (table_file.MOST_ROWS, table_file.MOST_COLUMNS) == (1_048_576, 16_384)  # of Excel


@given(
    value=st.decimals("-99", "99", places=6),
    limit=st.decimals("-99", "99", places=1),
    digits=st.integers(0, 2),
)
def test_a_value_beside_a_limit_has_as_few_digits_as_show_its_side(value, limit, digits):
    text = beside(float(value), float(limit), f"+.{digits}f")
    shown_value, fewer = Decimal(text), len(text.partition(".")[2]) - 1
    side = (value > limit) - (value < limit)
    assert (shown_value > limit) - (shown_value < limit) == side
    if fewer >= digits:
        rounded = Decimal(format(float(value), f".{fewer}f"))
        assert (rounded > limit) - (rounded < limit) != side


@pytest.mark.skipif(not machine.CAN_CHOOSE_CORES, reason="cores can be chosen on Linux alone")
def test_within_the_body_there_are_so_many_cores_and_then_all_again():
    before = os.sched_getaffinity(0)
    with pytest.raises(KeyError), machine.on_cores(1):  # noqa: PT012
        assert os.sched_getaffinity(0) == {min(before)}
        assert machine.cores() == 1
        raise KeyError
    assert os.sched_getaffinity(0) == before
    assert machine.cores() == len(before)


def test_a_stored_table_is_read_again_and_has_a_line_for_each_of_its_keys(tmp_path):
    """So that two results can be compared line by line, with the checksum first."""
    path, table = tmp_path / "it.json", {"b": [1, 2.5], "a": {"c": "\u03c3"}}
    write_checked(path, table)
    assert read_checked(path) == table
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line[:2] == ' "'][1:] == [' "b": [', ' "a": {']
    assert lines[1].startswith(' "sha256": "')
    assert json.loads(path.read_text(encoding="utf-8"))["a"] == table["a"]
