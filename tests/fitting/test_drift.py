"""Fits in files: what has changed between two, against least squares on both records; where one goes on."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.fitting.drift import SMALLER, drift
from panto_env.fitting.misfit import State
from panto_env.fitting.stored import Stored, identity_of, keep, kept, store, stored, turned
from panto_env.fitting.values import WAVES, Value
from panto_env.records.record import Piece, Record

from ..command import panto
from ..documents import ROOT
from .coverage import diagnosed, table

COUNT, TOLERANCE = 12, 5e-3


def dropper(number):
    return Value("droppers", f"dropper {number}", "mm", 1e3, TOLERANCE, 600.0 + 6.0 * number, (number,))


def made_up(seed, change, forces=40, deviation=0.5):
    """Two fits to forces that depend on droppers linearly, and hardly on a shift of all of them; and both
    records: (derivatives, force) of each."""
    random = np.random.default_rng(seed)
    true = TOLERANCE * random.standard_normal(COUNT)
    fits, records = [], []
    for month, x in enumerate((true, true + change)):
        slopes = 1e3 * random.standard_normal((forces, COUNT))
        slopes -= 0.999 * slopes.mean(axis=1, keepdims=True)
        force = slopes @ x + deviation * random.standard_normal(forces)
        covariance = np.linalg.inv(slopes.T @ slopes / deviation**2 + np.eye(COUNT) / TOLERANCE**2)
        difference = covariance @ slopes.T @ force / deviation**2
        values = tuple(dropper(number) for number in range(COUNT))
        fits.append(
            Stored(
                f"month {month}",
                "a line",
                "a pantograph",
                values,
                difference,
                covariance,
                (500.0, 900.0),
                np.ones(6),
                (),
            )
        )
        records.append((slopes / deviation, force / deviation))
    return fits, records


def test_it_is_least_squares_on_both_records():
    """Values and changes found together, with their tolerances as rows of their own."""
    fits, ((one, first), (two, second)) = made_up(0, np.zeros(COUNT))
    none, change = np.zeros((COUNT, COUNT)), SMALLER * TOLERANCE
    rows = np.block(
        [
            [one, np.zeros_like(one)],
            [two, two],
            [np.eye(COUNT) / TOLERANCE, none],
            [none, np.eye(COUNT) / change],
        ]
    )
    both = np.linalg.lstsq(rows, np.concatenate([first, second, np.zeros(2 * COUNT)]), rcond=None)[0][COUNT:]
    deviation = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows))[COUNT:])
    found = drift(*fits).found
    np.testing.assert_allclose([each.difference for each in found], both, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose([each.deviation for each in found], deviation, rtol=1e-6)


def test_intervals_hold_changes_as_often_as_they_say():
    random, shares = np.random.default_rng(1), []
    for seed in range(60):
        change = SMALLER * TOLERANCE * random.standard_normal(COUNT)
        found = drift(*made_up(seed, change)[0]).found
        shares += [(each.difference - by) / each.deviation for each, by in zip(found, change, strict=True)]
    assert np.std(shares) == pytest.approx(1.0, abs=0.12)


def test_a_change_is_known_better_than_the_line():
    """A shift of all droppers, which the forces hardly tell, is in both fits."""
    fits, _ = made_up(2, np.eye(COUNT)[4] * 6e-3)
    found = drift(*fits)
    (changed,) = found.changed
    assert changed.value.name == "dropper 4"
    assert changed.difference == pytest.approx(6e-3, abs=2 * changed.deviation)
    line = np.sqrt(fits[0].covariance[4, 4])
    assert changed.deviation < 0.6 * line


def test_few_changes_are_named_where_there_are_none():
    named = [drift(*made_up(seed, np.zeros(COUNT))[0]).changed for seed in range(100)]
    assert sum(map(bool, named)) <= 5


def test_values_of_one_fit_only_are_no_changes():
    (earlier, later), _ = made_up(3, np.zeros(COUNT))
    keep = np.arange(2, COUNT)
    shorter = replace(
        later,
        values=later.values[2:],
        difference=later.difference[2:],
        covariance=later.covariance[np.ix_(keep, keep)],
    )
    names = [each.value.name for each in drift(earlier, shorter).found]
    assert names == [f"dropper {number}" for number in range(2, COUNT)]
    there = replace(shorter, compared=(630.0, 900.0))
    assert [each.value.name for each in drift(earlier, there).found] == names[3:]


def test_fits_that_cannot_be_compared_are_refused(tmp_path):
    (earlier, later), _ = made_up(4, np.zeros(COUNT))
    with pytest.raises(InputError, match="count from different lines or pantographs"):
        drift(earlier, replace(later, line="another line"))
    looser = tuple(replace(value, tolerance=0.01) for value in later.values)
    with pytest.raises(InputError, match="free different values, or with different tolerances"):
        drift(earlier, replace(later, values=looser))
    with pytest.raises(InputError, match="give fits of one stretch"):
        drift(earlier, replace(later, compared=(900.0, 1000.0)))
    with pytest.raises(InputError, match=r"none\.safetensors could not be read: No such file"):
        stored(tmp_path / "none.safetensors")
    (tmp_path / "text.safetensors").write_text("no arrays", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"does not hold a whole fit: .*; give a file that `panto fit --keep` wrote"
    ):
        stored(tmp_path / "text.safetensors")
    store(replace(earlier, difference=earlier.difference[1:]), tmp_path / "part.safetensors")
    with pytest.raises(InputError, match="does not hold a whole fit: its difference is not"):
        stored(tmp_path / "part.safetensors")


@pytest.fixture
def folder(tmp_path):
    (earlier, later), _ = made_up(2, np.eye(COUNT)[4] * 6e-3)
    store(earlier, tmp_path / "month0.safetensors")
    known = stored(tmp_path / "month0.safetensors")
    assert (known.values, known.name, known.line) == (earlier.values, "month 0", "a line")
    assert known.compared == (500.0, 900.0)
    np.testing.assert_array_equal(known.covariance, earlier.covariance)
    store(replace(later, notes=("The fit to month 1 has not settled.",)), tmp_path / "month1.safetensors")
    return tmp_path


@pytest.mark.longer
def test_the_command(folder):
    done = panto(
        "drift", "month0.safetensors", "month1.safetensors",
        "--values", "changes.csv", "--plot", "drift.png", cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Most surely unlike before, 1 of 1" in done.stdout
    assert "dropper 4" in done.stdout
    assert "has not settled" in done.stdout + done.stderr
    assert (folder / "drift.png").read_bytes().startswith(b"\x89PNG")
    lines = (folder / "changes.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + COUNT
    assert [line.split(",")[1].strip('"') for line in lines if line.lower().endswith("true")] == ["dropper 4"]

    first, second = "month0.safetensors", "month1.safetensors"
    rows = json.loads(panto("drift", first, second, "--json", cwd=folder).stdout)["values"]
    assert [row["name"] for row in rows if row["changed"]] == ["dropper 4"]
    assert (
        "Nothing has changed that these records would tell."
        in panto("drift", first, first, cwd=folder).stdout
    )
    loose = panto("drift", first, second, "--tolerance", "dropper=0.01", cwd=folder)
    assert (loose.returncode, "--tolerance of unknown 'dropper'" in loose.stderr) == (2, True)


def test_waves_of_spans_that_begin_elsewhere_are_the_same_waves():
    """As cosine and sine from the line's start on, and from 137 m on."""
    values = [
        Value("unevenness", f"{part} {k}", "mm", 1e3, 1e-3, None, (k, part))
        for k in range(len(WAVES))
        for part in (0, 1)
    ]
    values.insert(0, dropper(3))
    parts = np.random.default_rng(0).standard_normal(len(values))
    seen, _ = turned(values, 137.0, parts, np.eye(len(values)))
    assert seen[0] == parts[0]
    x = np.linspace(0.0, 50.0, 7)
    for k, (length, _) in enumerate(WAVES):

        def height(of, at, k=k, length=length):
            angle = 2 * np.pi * at / length
            return of[2 * k + 1] * np.cos(angle) + of[2 * k + 2] * np.sin(angle)

        np.testing.assert_allclose(height(seen, x), height(parts, x + 137.0), atol=1e-12)


SETTINGS = {"free": ["droppers"], "tolerances": {"droppers": 0.01}, "line": "{}"}


@pytest.fixture
def record():
    x = np.arange(100.0)
    return Record("a", (Piece("", 0.002, 0.0, x, 120 + np.sin(x)), Piece("", 0.002, 1.0, x + 200, 120 - x)))


@pytest.fixture
def state():
    random = np.random.default_rng(0)
    return State(random.standard_normal(30), np.array([70.0, 71.0]), random.uniform(size=(2, 6)), 7)


def test_a_state_is_read_back_and_another_fit_s_is_not_taken(tmp_path, record, state):
    path, identity = tmp_path / "a.fit", identity_of([record], SETTINGS)
    keep(path, state, identity)
    keep(path, replace(state, steps=8), identity)
    found = kept(path, identity)
    assert found.steps == 8
    for name in ("x", "static_forces", "noise"):
        np.testing.assert_array_equal(getattr(found, name), getattr(state, name))
    one, two = record.pieces
    force = two.force.copy()
    force[50] += 1e-9
    for pieces in ((one, replace(two, force=force)), (one, replace(two, position=two.position + 1)), (one,)):
        assert kept(path, identity_of([replace(record, pieces=pieces)], SETTINGS)) is None
    for other in ({"tolerances": {}}, {"free": ["droppers", "tensions"]}):
        assert kept(path, identity_of([record], SETTINGS | other)) is None
    assert kept(path, identity_of([replace(record, name="b")], SETTINGS)) is not None  # the same samples


def test_a_damaged_file_is_not_taken(tmp_path, record, state):
    path, identity = tmp_path / "a.fit", identity_of([record], SETTINGS)
    assert kept(path, identity) is None
    keep(path, state, identity)
    whole = path.read_bytes()
    for content in (whole[:-9], b"", whole[:-5] + bytes([whole[-5] ^ 1]) + whole[-4:]):
        path.write_bytes(content)
        assert kept(path, identity) is None


STORED = ROOT / "docs" / "records-coverage"


@pytest.mark.longer
def test_the_documents_have_the_table_of_the_stored_lines():
    """Each row of the page is one of the stored lines', and every kind of line and of model is there."""
    text = (ROOT / "docs" / "records-fit.md").read_text(encoding="utf-8")
    for rows in (list(table(STORED)), list(diagnosed(STORED))):
        headings, rule, *stored = rows
        above = re.escape(f"{headings}\n{rule}\n")
        (block,) = re.findall(rf"^{above}((?:\|.*\n)+)", text, re.MULTILINE)
        shown = block.splitlines()
        assert [row for row in shown if row not in stored] == []
        kinds = {tuple(row.split(" | ")[:2]) for row in stored if "settled" not in row}
        assert {tuple(row.split(" | ")[:2]) for row in shown} == kinds
