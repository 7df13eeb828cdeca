"""What commands print, write and return of results that are made up: tables cell by cell, and exit status."""

import json
import re
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from panto_env import InputError, studies
from panto_env.analysis import line_check as lines_of
from panto_env.base.table import Table
from panto_env.catalog import load_catenary, load_drawn
from panto_env.cli import diagnose
from panto_env.studies import Comparison, Outcome

from ..command import panto

FAMILY = load_drawn("high-speed")


def cells(text):
    """Cells of the rows of all tables in a text."""
    rows = (re.split("[│┃|]", line)[1:-1] for line in text.splitlines())
    return [[cell.strip() for cell in row] for row in rows if row]


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    """Whole cells in one line, whatever the terminal."""
    monkeypatch.setattr("panto_env.terminal.console._width", 200)


@pytest.fixture
def made(monkeypatch):
    """Lets a command find lines in the middle of their family's bands; lists what it asked for."""
    asked = []

    def of(change):
        def drawn(seed):
            bands = FAMILY.plausible.model_dump(exclude={"pantograph"})
            values = dict.fromkeys(lines_of.LABELS, 10.0 + seed)
            values |= {name: 0.5 * (low + high) for name, (low, high) in bands.items()}
            return lines_of.DrawnLine(seed=seed, ending="", **values | change(seed))

        def drawn_lines(lines, seeds, progress):
            asked.append((lines.name, seeds))
            return [drawn(seed) for seed in list(seeds)[:20]]

        monkeypatch.setattr("panto_env.cli.lines.drawn_lines", drawn_lines)
        return asked

    return of


@pytest.mark.longer
def test_a_family_of_plausible_lines(made):
    asked = made(lambda seed: {})
    done = panto("family", "--seeds", 4, "--first", 7)
    assert (done.returncode, asked) == (0, [("high-speed", range(7, 11))])
    assert "4 lines of family high-speed" in done.stdout
    assert "All 4 lines hang, run and are plausible." in done.stdout
    rows = {row[0]: row[1:] for row in cells(done.stdout)}
    assert rows["value"] == ["minimum", "median", "maximum", "plausible", "lines outside"]
    draws = rows["draws until a line is taken"]
    assert ([float(cell) for cell in draws[:3]], draws[3:]) == ([17.0, 18.5, 20.0], ["", ""])
    low, high = FAMILY.plausible.force_deviation
    assert rows["σ / F_m at that speed"][3:] == [f"{low:g} to {high:g}", "0"]
    assert "length of the line (m)" not in rows
    markdown = panto("family", "--seeds", 4, "--markdown").stdout
    assert markdown.startswith("| value | minimum | median | maximum | plausible | lines outside |")
    assert "plausible." not in markdown
    assert panto("family", "--seeds", 100_000).returncode == 0
    for wrong in (("--seeds", 100_001), ("--seeds", 0), ("--first", -1)):
        assert f"Invalid value for '{wrong[0]}'" in panto("family", *wrong).stderr
    assert len(asked) == 3


@pytest.mark.longer
def test_a_family_with_lines_that_are_not_plausible(made):
    name, (_, high) = next(iter(FAMILY.plausible.model_dump(exclude={"pantograph"}).items()))
    made(lambda seed: {name: 2 * high + 1} if seed % 10 in (3, 5) else {})
    done = panto("family", "--seeds", 20)
    assert done.returncode == 1
    assert "4 of 20 lines are not plausible. First seeds: 3, 5, 13, 15." in " ".join(done.stdout.split())
    assert "are plausible" not in done.stdout
    plain = panto("family", "--seeds", 20, "--json")
    told = json.loads(plain.stdout)
    assert (plain.returncode, [one["seed"] for one in told]) == (1, list(range(20)))
    assert [one["seed"] for one in told if one["outside"]] == [3, 5, 13, 15]
    assert panto("family", "--seeds", 20, "--markdown").returncode == 1
    made(lambda seed: {name: 2 * high + 1})
    assert "First seeds: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9." in " ".join(panto("family").stdout.split())


@pytest.fixture
def study(monkeypatch):
    compared = (
        Comparison("one", "N", 12.3456, 12.0, 11.5, 12.5, "a note"),
        Comparison("two", "m", 0.5, "smaller", 0.0, float("inf")),
        Comparison("three", "m", 0.5, "smaller", 0.0, 0.4),
    )

    def run(report):
        report("half", 0.5)
        figures = {name: Figure(figsize=(1, 1)) for name in "ab"}
        return Outcome("a study", compared, (Table("its table", ("x", "y"), (("1", "2"),)),), figures, {})

    monkeypatch.setattr(studies, "find_study", lambda name: run)


def test_a_study_is_printed_cell_by_cell_and_written(study, tmp_path):
    done = panto("reproduce", "paper2", "--output", tmp_path / "out")
    assert done.returncode == 0
    folder = tmp_path / "out" / "paper2"
    assert sorted(path.name for path in folder.iterdir()) == ["a.png", "b.png", "numbers.json"]
    told = "".join(done.stdout.split())
    assert f"2figuresandnumbers.jsonarein{folder}." in told
    assert told.index("itstable") < told.index("astudy")
    rows = cells(done.stdout)
    assert ["quantity", "unit", "ours", "paper", "agrees within", "note"] in rows
    assert ["one", "N", "12.35", "12", "11.500 to 12.500", "a note"] in rows
    assert ["three", "m", "0.5 differs", "smaller", "0.000 to 0.400", ""] in rows


def test_all_studies_as_json_and_one_that_cannot_be_written(study, tmp_path, monkeypatch):
    told = json.loads(panto("reproduce", "--json", "--output", tmp_path).stdout)
    assert list(told) == list(studies.STUDIES)
    compared = told["paper2"]["comparisons"]
    assert [each["agrees"] for each in compared] == [True, True, False]
    assert compared[1]["high"] is None
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(studies.STUDIES)

    def write(outcome, folder):
        if folder.name == "paper2":
            raise InputError("The disk is full.")
        return [1, 2]

    monkeypatch.setattr(studies, "write", write)
    done = panto("reproduce", "--output", tmp_path)
    assert (done.returncode, done.stderr.count("The disk is full.")) == (2, 1)
    assert "".join(done.stdout.split()).count("1figuresandnumbers.jsonarein") == len(studies.STUDIES) - 1
    assert done.stdout.count("its table") == len(studies.STUDIES)


def masts(heights):
    rows = [f"{60 * k},{height}" for k, height in enumerate(heights)]
    return "\n".join(["position (m),contact_height (m)", *rows, ""])


@pytest.mark.longer
def test_a_line_from_masts_is_shown_and_written_where_a_file_is_named(tmp_path):
    (tmp_path / "masts.csv").write_text(masts([5.3] * 8))
    given = ("line", "en50318-2002", "--masts", "masts.csv")
    shown = panto(*given, cwd=tmp_path)
    assert (shown.returncode, shown.stderr) == (0, "")
    assert [path.name for path in tmp_path.iterdir()] == ["masts.csv"]
    assert panto(*given, "--output", "mine.toml", cwd=tmp_path).returncode == 0
    line = load_catenary(str(tmp_path / "mine.toml"))
    assert list(line.alignment().lengths) == [60.0] * 7
    told = json.loads(panto("line", "mine.toml", "--json", cwd=tmp_path).stdout)
    assert [each["length"] for each in told["spans"]] == [60.0]  # all alike
    assert told["line"]["name"] == line.name
    alone = panto("line", "en50318-2002", "--output", "other.toml", cwd=tmp_path)
    assert (alone.returncode, "Give --masts with --output" in alone.stderr) == (2, True)


@pytest.mark.longer
def test_a_limit_that_is_broken_is_said_and_ends_with_1(tmp_path):
    """A wire that rises by 10 cm in a span of 60 m, 1.7 ‰: too steep for fast trains alone."""
    (tmp_path / "masts.csv").write_text(masts([5.3] * 4 + [5.4] * 4))
    given = ("line", "en50318-2002", "--masts", "masts.csv", "--speed")
    slow, fast = (panto(*given, speed, cwd=tmp_path) for speed in (80, 250))
    assert (slow.returncode, slow.stderr, slow.stdout.count("is not kept")) == (0, "", 0)
    assert (fast.returncode, fast.stdout.count("is not kept.")) == (1, 2)  # the gradient, and its change
    assert "Elasticity is left out in the first and the last span" in " ".join(slow.stdout.split())
    assert panto(*given, 250, "--json", cwd=tmp_path).returncode == 1


def test_trainings_have_a_row_each(monkeypatch, tmp_path):
    trainings = pytest.importorskip("panto_agents.trainings")
    found = {"best": "a.safetensors", "best_steps": 4000, "ratio": 0.75, "qualified": True}
    outcomes = [
        found,
        found | {"best": "b.safetensors", "ratio": 1.1, "qualified": False},
        found | {"ratio": None},
    ]
    monkeypatch.setattr(trainings, "train_all", lambda planned, **_: outcomes)
    shown = panto("trainings", "ppo", "--output", tmp_path / "all")
    assert cells(shown.stdout)[1:4] == [
        ["a.safetensors", "4000", "-25.0 %", ""],
        ["b.safetensors", "4000", "+10.0 %", "F_m out of range"],
        ["a.safetensors", "4000", "ended early", ""],
    ]


@pytest.mark.longer
def test_a_healthy_and_an_unhealthy_line(monkeypatch, tmp_path):
    load = lambda path: SimpleNamespace(catenary="a", speed_kmh=250.0, path=path)  # noqa: E731
    monkeypatch.setattr(diagnose, "Trajectory", SimpleNamespace(load=load))
    facts = {"healthy": True, "changed": False, "level": 1.0, "begin": 10.0, "end": 90.0, "false_alarms": 0.1}
    notes, evidence = ("first note", "second note"), SimpleNamespace(threshold=2.5)
    found = SimpleNamespace(**facts, findings=(), evidence=evidence, notes=notes)
    called = {}

    def judge(judged, reference, **given):
        runs = {"judged": judged, "reference": reference}
        called.update(given, **{name: [run.path.name for run in each] for name, each in runs.items()})
        return found

    monkeypatch.setattr(diagnose, "judge", judge)
    monkeypatch.setattr(diagnose, "verdict", lambda found: ["It is healthy.", "So."])
    words = ("diagnose", "run", "--healthy", "a", "b", "c", "--again", "d", "--seed", 4)
    done = panto(*words)
    assert done.stdout.splitlines()[:2] == ["It is healthy.", "So."]
    assert all(f"Degraded: {note}" in done.stdout for note in notes)
    given = {"seed": 4, "pantograph": None, "false_alarms": 0.1}
    assert called == given | {"judged": ["run", "d"], "reference": ["a", "b", "c"]}
    told = json.loads(panto(*words, "--json", "--false-alarms", 20).stdout)
    assert called["false_alarms"] == 20
    assert told == facts | {"threshold": 2.5, "notes": list(notes), "findings": []}
    for wrong, sentence in (
        (("--false-alarms", 0), "--false-alarms must lie between 1e-06 and 20 per km, not 0."),
        (("--false-alarms", 20.1), "--false-alarms must lie between 1e-06 and 20 per km, not 20.1."),
        (("--seed", -1), "--seed must be a whole number from 0 up, not -1."),
    ):
        refused = panto("diagnose", "run", "--healthy", "a", *wrong)
        assert (refused.returncode, sentence in refused.stderr) == (2, True)
    titles, table = [], Table("where", ("m",), (("93",),))
    monkeypatch.setattr(diagnose, "findings_table", lambda found: table)
    monkeypatch.setattr(diagnose, "plot_diagnosis", lambda found, title: titles.append(title))
    monkeypatch.setattr(diagnose, "save", lambda plot, path: None)
    assert "where" not in done.stdout
    found.findings = (SimpleNamespace(begin=93.0),)
    alone = panto("diagnose", "run", "--healthy", "a", "b", "--plot", tmp_path / "it.png")
    assert ["93"] in cells(alone.stdout)
    assert titles == ["run: a at 250 km/h, 2 healthy runs"]


@pytest.mark.parametrize(
    ("options", "lines"), [((), ["re250", "it"]), (("--reference", "re330"), ["re330"] * 2)]
)
def test_a_rig_is_compared_with_its_own_line_or_the_one_that_is_named(monkeypatch, options, lines):
    asked, own = [], SimpleNamespace(kind="flexible", name="it")
    rigs = {"one": SimpleNamespace(kind="stiffness"), "two": own}

    def compare(data, line, pantograph, speed_kmh, spans, policy, seed):
        asked.append((data.name, line.name, pantograph.name, speed_kmh, spans, policy, seed))
        return data.name

    for name, replaced in {
        "REFERENCE": "re250",
        "load_rig": lambda name: SimpleNamespace(name=name, line=rigs[name]),
        "load_catenary": lambda name: name if name is own else SimpleNamespace(name=name),
        "compare": compare,
        "report.pair_facts": lambda pair: {"rig": pair},
        "report.pair_table": lambda pair: Table("", ("x",), ((pair,),)),
        "report.followed_sentence": lambda pair: f"It follows {pair}.",
    }.items():
        monkeypatch.setattr(f"panto_env.cli.studies.{name}", replaced)
    done = panto("rig", "one", "two", "--seed", 3, *options)
    assert done.returncode == 0
    rest = ("own-two-mass", 250.0, None, None, 3)
    assert asked == [("one", lines[0], *rest), ("two", lines[1], *rest)]
    assert done.stdout.startswith("own-two-mass at 250 km/h, policy passive\n")
    assert done.stdout.endswith("It follows one.\nIt follows two.\n")
    assert [row for row in cells(done.stdout) if row != ["x"]] == [["one"], ["two"]]
    assert json.loads(panto("rig", "one", "--json", *options).stdout) == [{"rig": "one"}]
