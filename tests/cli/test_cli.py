import io
import json
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

from panto_env import Trajectory
from panto_env.base.checksums import read_checked
from panto_env.base.errors import AccuracyWarning, PlugInWarning, UnusualWarning
from panto_env.catalog.loader import text_of
from panto_env.cli import _show_warning
from panto_env.cli.catalogue import PRESETS
from panto_env.cli.identify import pairs
from panto_env.studies.en50318 import reference
from panto_env.terminal import PlainConsole, bars, counting

from .. import documents
from ..command import panto

WITH_AGENTS = pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="needs the extra 'agents'")


def test_validate_prints_the_table_and_passes():
    result = panto("validate", "--json")
    assert result.returncode == 0
    told = json.loads(result.stdout)
    assert told["passed"]
    assert len(told["checks"]) == 2 * len(reference.ACCEPTED)
    assert all(check["lowest"] <= check["value"] <= check["highest"] for check in told["checks"])
    kinds = json.loads(result.stdout)["kinds"]
    assert {each["line_kind"] for each in kinds} == {"AC simple", "AC stitched"}
    stitched = {each["catenary"]: each for each in kinds if each["speed_kmh"] == 300.0}
    assert stitched["re330-stitched"]["max_uplift"] > 1.2 * stitched["re330"]["max_uplift"]  # at supports
    table = panto("validate")
    assert "All figures inside." in table.stdout


def test_validate_prints_every_table_that_it_made(monkeypatch, capsys):
    from panto_env.base.table import Table
    from panto_env.cli import studies as validate

    kind, more = validate.study.Validation, [Table(name, ("x",), (("1",),)) for name in ("lines", "wear")]
    usual = kind.tables.fget
    monkeypatch.setattr(kind, "tables", property(lambda self: [*usual(self), *more]))
    validate.validate()
    printed = capsys.readouterr().out
    assert "lines" in printed
    assert "wear" in printed


def test_validate_fails_where_a_figure_lies_outside(monkeypatch, capsys):
    import typer

    from panto_env.cli import studies as validate

    monkeypatch.setitem(reference.ACCEPTED, "std", ((0, 1), (0, 1)))
    with pytest.raises(typer.Exit) as caught:
        validate.validate()
    assert caught.value.exit_code == 1
    assert "Not all figures are inside." in capsys.readouterr().out


def test_simulate_writes_run_plot_and_figures(tmp_path):
    result = panto(
        "simulate", "--speed", 250, "--distance", 180, "--spans", "2-3", "--json",
        "--output", tmp_path / "run.parquet", "--plot", tmp_path / "run.png",
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    run = Trajectory.load(tmp_path / "run.parquet")
    assert told["figures"]["std"] == run.summary((2, 3)).std
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_simulate_takes_a_policy_and_prints_a_table():
    result = panto("simulate", "--policy", "p", "--distance", 120, "--spans", "all")
    assert result.returncode == 0, result.stderr
    assert "policy p, spans all" in result.stdout
    assert "standard deviation" in result.stdout


def test_list_shows_entries_sources_and_policies():
    result = panto("list", "--json")
    told = json.loads(result.stdout)
    assert {entry["name"] for entry in told["pantograph"]} > {"en50318-2002", "dsa380"}
    assert {"passive", "p", "pd", "fb+ff"} <= set(told["policy"])
    entry = panto("list", "benchmark-2015")
    assert entry.returncode == 0
    assert "droppers" in entry.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simulate", "--speed", "0"], "The speed must lie above 0"),
        (["simulate", "--speed", "500"], "below the wave speed"),
        (["simulate", "--catenary", "nowhere"], "Unknown catenary 'nowhere'"),
        (["simulate", "--catenary", "broken.toml"], "broken.toml is not valid TOML"),
        (["simulate", "--policy", "best"], "Unknown policy 'best'"),
        (["simulate", "--policy", "p:gain=much"], "Policy 'p:gain=much'"),
        (["simulate", "--policy", "half.safetensors"], "half.safetensors"),
        (["simulate", "--spans", "five"], "--spans must read first-last"),
        (["simulate", "--spans", "5-60"], "but the run ends at"),
        (["simulate", "--plot", "run.doc"], "must end in one of"),
        (["list", "unknown"], "Unknown"),
        pytest.param(["train", "missing.toml"], "missing.toml", marks=WITH_AGENTS),
        (["benchmark", "--config", "broken.toml"], "broken.toml"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, tmp_path):
    (tmp_path / "broken.toml").write_text("kind = [")
    (tmp_path / "half.safetensors").write_bytes(b"PK\x03\x04half")
    before = sorted(tmp_path.iterdir())
    result = panto(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stderr.startswith("panto: ")
    assert len(result.stderr.splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


def test_reproduce_prints_what_it_writes_as_json(monkeypatch, capsys, tmp_path):
    from panto_env.cli import studies as reproduce
    from panto_env.studies import Comparison, Outcome

    found = Outcome("A study", (Comparison("mass", "kg", 2.0, 2.1, 1.9, float("inf")),), numbers={"k": 3})
    monkeypatch.setattr(reproduce.studies, "find_study", lambda name: lambda report: found)
    reproduce.reproduce("paper2", tmp_path, json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["paper2"] == read_checked(tmp_path / "paper2" / "numbers.json")
    assert told["paper2"]["comparisons"][0]["agrees"]
    assert told["paper2"]["comparisons"][0]["high"] is None
    reproduce.reproduce("paper2", tmp_path)
    assert "A study" in capsys.readouterr().out


def test_what_is_no_option_is_refused_in_one_line():
    result = panto("simulate", "--nowhere")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith("panto: No such option")
    assert "--nowhere" in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_switch_has_no_opposite():
    """What is off unless it is given needs no option to turn it off."""
    groups = [documents.panto()]
    for group in groups:
        for command in group.commands.values():
            groups += [command] if hasattr(command, "commands") else []
            assert [option for each in command.params for option in each.secondary_opts] == []


OURS = [AccuracyWarning, PlugInWarning, UnusualWarning]


@pytest.mark.parametrize("category", [*OURS, UserWarning, DeprecationWarning])
def test_a_warning_of_ours_is_a_sentence_and_one_of_others_says_where_it_is_from(category, capsys):
    _show_warning("Look out.", category, "file.py", 7)
    said = capsys.readouterr().err
    assert (said == "panto: warning: Look out.\n") == (category in OURS)
    assert said.startswith("panto: ") or said.startswith(f"file.py:7: {category.__name__}: Look out.")


def test_a_list_shows_of_each_preset_what_differs_from_the_usual(monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 2000)
    shown = panto("list").stdout
    for presets in PRESETS.values():
        kind = next(iter(presets.values())).model_dump().get("kind")
        for name, preset in presets.items():
            usual = type(preset)()
            changed = [
                f"{key}={value}" for key, value in preset if value != getattr(usual, key) and key != "kind"
            ]
            if preset.model_dump().get("kind") != kind:
                changed.insert(0, f"kind={preset.kind}")
            assert re.search(rf"│ {re.escape(name)} +│ {re.escape(', '.join(changed) or 'none')} +│", shown)


def test_brackets_in_a_description_of_a_user_s_file_are_shown_as_they_are(tmp_path):
    text = text_of("three-mass")
    text = re.sub(r'^description = ".*"', 'description = "[bold]mine[/bold] [/x]"', text, flags=re.MULTILINE)
    (tmp_path / "mine.toml").write_text(text)
    assert "[bold]mine[/bold] [/x]" in panto("list", "mine.toml", cwd=tmp_path).stdout


@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt, 130), (EOFError, 1)])
def test_a_command_that_is_interrupted_ends_without_a_traceback(error, status, monkeypatch):
    def interrupt(**_):
        raise error

    monkeypatch.setattr("panto_env.analysis.simulation.simulate", interrupt)
    done = panto("simulate")
    assert (done.returncode, done.stdout, done.stderr.strip()) == (status, "", "")  # Typer ends the line


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_is_shown_on_a_terminal_alone(terminal, monkeypatch):
    said = io.StringIO()
    console = PlainConsole(file=said, force_terminal=terminal, width=80)
    monkeypatch.setattr("panto_env.terminal.progress_console", console)
    with bars() as progress:
        progress.update(progress.add_task("simulating", total=1.0), completed=0.25)
        progress.refresh()
    with counting("passes") as count:
        count(3, 4)
    assert [words in said.getvalue() for words in ("simulating", "25%", "passes", "3/4")] == [terminal] * 4


@pytest.mark.parametrize(("count", "size"), [(1, (1280, 720)), (2, (1280, 960)), (4, (1280, 1920))])
def test_a_film_is_as_large_as_its_help_says(count, size, monkeypatch, tmp_path):
    pytest.importorskip("cv2")
    pytest.importorskip("moviepy")
    seen = []
    monkeypatch.setattr("panto_env.cli.simulate.write_film", lambda *given: seen.append(given))
    words = ["film", *["passive"] * count, "--catenary", "periodic-stiffness", "--pantograph", "three-mass"]
    done = panto(*words, "--distance", "550", "--seconds", "0.1", "--output", tmp_path / "it.mp4")
    assert done.returncode == 0, done.stderr
    ((frames, path, rate, whole),) = seen
    assert (Path(path).name, rate, whole) == ("it.mp4", 25.0, size)
    assert next(iter(frames)).shape == (size[1], size[0], 3)


def test_names_and_values_may_stand_between_commas_and_blanks():
    assert pairs([",a=1,", "b=2 , c=3", " "]) == {"a": "1", "b": "2", "c": "3"}
