"""What commands print, write and return of results that are made up: tables cell by cell, and exit status."""

import json
import re

import pytest

from panto_env import InputError, studies
from panto_env.analysis import line_check as lines_of
from panto_env.base.table import Table
from panto_env.catalog import load_catenary, load_drawn
from panto_env.studies import Comparison, Outcome
from panto_env.terminal import console

from ..command import panto

FAMILY = load_drawn("high-speed")


def cells(text):
    """Cells of the rows of all tables in a text."""
    rows = (re.split("[│┃|]", line)[1:-1] for line in text.splitlines())
    return [[cell.strip() for cell in row] for row in rows if row]


def drawn(seed, **other):
    """A line in the middle of its family's bands."""
    bands = FAMILY.plausible.model_dump(exclude={"pantograph"})
    values = dict.fromkeys(lines_of.LABELS, 10.0 + seed)
    values |= {name: 0.5 * (low + high) for name, (low, high) in bands.items()}
    return lines_of.DrawnLine(seed=seed, ending="", **values | other)


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    """Whole cells in one line, whatever the terminal."""
    monkeypatch.setattr(console, "_width", 200)


@pytest.fixture
def made(monkeypatch):
    """Lets a command find lines that are made up; what it asked for is in the list that is returned."""
    asked = []

    def of(change):
        def drawn_lines(lines, seeds, progress):
            asked.append((lines.name, seeds))
            return [drawn(seed, **change(seed)) for seed in list(seeds)[:20]]

        monkeypatch.setattr(lines_of, "drawn_lines", drawn_lines)
        return asked

    return of


def test_a_family_of_plausible_lines(made):
    asked = made(lambda seed: {})
    done = panto("family", "--seeds", 4, "--first", 7)
    assert (done.returncode, asked) == (0, [("high-speed", range(7, 11))])
    assert "4 lines of family high-speed" in done.stdout
    assert "All 4 lines hang, run and are plausible." in done.stdout
    rows = {row[0]: row[1:] for row in cells(done.stdout)}
    assert rows["value"] == ["minimum", "median", "maximum", "plausible", "lines outside"]
    assert [float(cell) for cell in rows["draws until a line is taken"][:3]] == [17.0, 18.5, 20.0]
    assert rows["draws until a line is taken"][3:] == ["", ""]
    low, high = FAMILY.plausible.force_deviation
    assert rows["σ / F_m at that speed"][3:] == [f"{low:g} to {high:g}", "0"]
    assert "length of the line (m)" not in rows
    markdown = panto("family", "--seeds", 4, "--markdown")
    assert markdown.returncode == 0
    assert markdown.stdout.startswith("| value | minimum | median | maximum | plausible | lines outside |")
    assert "plausible." not in markdown.stdout


def test_a_family_with_lines_that_are_not_plausible(made):
    name, (_, high) = next(iter(FAMILY.plausible.model_dump(exclude={"pantograph"}).items()))
    made(lambda seed: {name: 2 * high + 1} if seed % 10 in (3, 5) else {})
    done = panto("family", "--seeds", 20)
    assert done.returncode == 1
    assert "4 of 20 lines are not plausible. First seeds: 3, 5, 13, 15." in " ".join(done.stdout.split())
    assert "are plausible" not in done.stdout
    plain = panto("family", "--seeds", 20, "--json")
    assert plain.returncode == 1
    told = json.loads(plain.stdout)
    assert [one["seed"] for one in told] == list(range(20))
    assert [one["seed"] for one in told if one["outside"]] == [3, 5, 13, 15]
    assert panto("family", "--seeds", 20, "--markdown").returncode == 1
    made(lambda seed: {name: 2 * high + 1})
    assert "First seeds: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9." in " ".join(panto("family").stdout.split())


def test_how_many_lines_may_be_drawn(made):
    asked = made(lambda seed: {})
    assert panto("family", "--seeds", 100_000).returncode == 0
    assert panto("family", "--seeds", 1, "--json").returncode == 0
    assert [len(seeds) for _, seeds in asked] == [100_000, 1]
    for seeds in (100_001, 0):
        refused = panto("family", "--seeds", seeds)
        assert (refused.returncode, len(asked)) == (2, 2)
        assert "Invalid value for '--seeds'" in refused.stderr
    assert panto("family", "--first", -1).returncode == 2


def figure():
    from matplotlib.figure import Figure

    return Figure(figsize=(1, 1))


OUTCOME = Outcome(
    "a study",
    (
        Comparison("one", "N", 12.3456, 12.0, 11.5, 12.5, "a note"),
        Comparison("two", "m", 0.5, "smaller", 0.0, 0.4),
    ),
    (Table("its table", ("x", "y"), (("1", "2"),)),),
    {},
    {"more": 3.0},
)


@pytest.fixture
def study(monkeypatch):
    def run(report):
        report("half", 0.5)
        return Outcome(OUTCOME.title, OUTCOME.comparisons, OUTCOME.tables, {"a": figure(), "b": figure()}, {})

    monkeypatch.setattr(studies, "find_study", lambda name: run)


def test_a_study_is_printed_cell_by_cell_and_written(study, tmp_path):
    done = panto("reproduce", "paper2", "--output", tmp_path / "out")
    assert done.returncode == 0
    folder = tmp_path / "out" / "paper2"
    assert sorted(path.name for path in folder.iterdir()) == ["a.png", "b.png", "numbers.json"]
    told = " ".join(done.stdout.split())
    assert f"2 figures and numbers.json are in {folder}.".replace(" ", "") in told.replace(" ", "")
    assert told.index("its table") < told.index("a study")
    rows = cells(done.stdout)
    assert ["quantity", "unit", "ours", "paper", "agrees within", "note"] in rows
    assert ["one", "N", "12.35", "12", "11.500 to 12.500", "a note"] in rows
    assert ["two", "m", "0.5 differs", "smaller", "0.000 to 0.400", ""] in rows


def test_all_studies_as_json_and_one_that_cannot_be_written(study, tmp_path, monkeypatch):
    done = panto("reproduce", "--json", "--output", tmp_path)
    told = json.loads(done.stdout)
    assert list(told) == list(studies.STUDIES)
    assert [each["agrees"] for each in told["paper2"]["comparisons"]] == [True, False]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(studies.STUDIES)

    def write(outcome, folder):
        if folder.name == "paper2":
            raise InputError("The disk is full.")
        return [1, 2]

    monkeypatch.setattr(studies, "write", write)
    done = panto("reproduce", "--output", tmp_path)
    assert (done.returncode, done.stderr.count("The disk is full.")) == (2, 1)
    told = done.stdout.replace("\n", "").replace(" ", "")
    assert told.count("1figuresandnumbers.jsonarein") == len(studies.STUDIES) - 1
    assert done.stdout.count("its table") == len(studies.STUDIES)


MASTS = "position (m)\n" + "\n".join(str(60 * k) for k in range(8)) + "\n"


def test_a_line_from_masts_is_shown_and_written_where_a_file_is_named(tmp_path):
    (tmp_path / "masts.csv").write_text(MASTS)
    shown = panto("line", "en50318-2002", "--masts", "masts.csv", cwd=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["masts.csv"]
    written = panto("line", "en50318-2002", "--masts", "masts.csv", "--output", "mine.toml", cwd=tmp_path)
    assert (shown.returncode, shown.stderr, written.returncode) == (0, "", 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["masts.csv", "mine.toml"]
    line = load_catenary(str(tmp_path / "mine.toml"))
    assert list(line.alignment().lengths) == [60.0] * 7
    plain = panto("line", "mine.toml", "--json", cwd=tmp_path)
    told = json.loads(plain.stdout)
    assert [each["length"] for each in told["spans"]] == [60.0]  # all alike
    assert told["line"]["name"] == line.name
    alone = panto("line", "en50318-2002", "--output", "other.toml", cwd=tmp_path)
    assert (alone.returncode, "Give --masts with --output" in alone.stderr) == (2, True)
    assert not (tmp_path / "other.toml").exists()


def test_a_limit_that_is_broken_is_said_and_ends_with_1(tmp_path):
    """A wire that rises by 10 cm in a span of 60 m, 1.7 ‰: too steep for fast trains alone."""
    rows = [f"{60 * k},{5.3 if k < 4 else 5.4}" for k in range(8)]
    (tmp_path / "masts.csv").write_text("position (m),contact_height (m)\n" + "\n".join(rows) + "\n")
    given = ("line", "en50318-2002", "--masts", "masts.csv", "--speed")
    slow, fast = (panto(*given, speed, cwd=tmp_path) for speed in (80, 250))
    assert (slow.returncode, slow.stderr) == (0, "")
    assert "is not kept" not in slow.stdout
    assert fast.returncode == 1
    assert fast.stdout.count("is not kept.") == 2  # the gradient, and its change
    for done in (slow, fast):
        assert "Elasticity is left out in the first and the last span" in " ".join(done.stdout.split())
    assert panto(*given, 250, "--json", cwd=tmp_path).returncode == 1
    assert panto("line", "periodic-stiffness").returncode == 2
