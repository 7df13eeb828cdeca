"""The command `panto`: what it takes, prints and returns."""

import io
import json
import re
from importlib.util import find_spec

import pytest

from panto_env import Trajectory, simulate
from panto_env.base.checksums import __version__
from panto_env.base.errors import AccuracyWarning, PlugInWarning, UnusualWarning
from panto_env.base.table import Table
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.cli import _show_warning, group
from panto_env.cli.identify import pairs
from panto_env.plant.actuators import ACTUATOR_PRESETS, actuator_settings
from panto_env.plant.line_condition import LINE_CONDITIONS
from panto_env.studies.en50318 import reference, study
from panto_env.terminal import PlainConsole, bars, counting

from ..command import panto, whole

WITH_AGENTS = pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="needs the extra 'agents'")
SHORT = {"distance": 120.0, "record_droppers": False}


def told(*words, **options):
    done = panto(*words, "--json", **options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def only_words(text):
    """The text without the frames of tables and the folds of its lines."""
    return "".join(letter for letter in text if letter.isalnum())


# --- options ----------------------------------------------------------------------------------------


def commands(command, words=()):
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, (*words, name))
    if not hasattr(command, "commands"):
        yield words, command


def test_a_switch_has_no_opposite_and_an_option_of_one_value_is_given_once():
    """Of two the last had been taken, without a word."""
    every = list(commands(whole()))
    assert len(every) > 20
    for words, command in every:
        assert [option for each in command.params for option in each.secondary_opts] == []
        assert isinstance(command, group._GivenOnce), words
    ours, of_plug_ins = ("list", "--json"), (("benchmark", "--json"), ("dataset episodes", "--workers=1"))
    for words, option in (ours, *of_plug_ins):
        done = panto(*words.split(), option, option)
        said = f"panto: {option.partition('=')[0]} is given twice; give it once.\n"
        assert (done.returncode, done.stderr) == (2, said)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("simulate --catenary a --speed 3 --catenary=b", "--catenary is given twice"),
        ("simulate --json --json --json", "--json is given 3 times; give it once"),
        ("benchmark --speed x --speed x", "Invalid value for '--speed'"),  # it may be repeated
        ("simulate --pantograf b", "No such option"),
        ("simulate --pantograph x -- --pantograph", "unexpected extra argument"),
        ("simulate --speed 500", "below the wave speed"),
        ("simulate --catenary nowhere", "Unknown catenary 'nowhere'"),
        ("simulate --catenary broken.toml", "broken.toml is not valid TOML"),
        ("simulate --policy best", "Unknown policy 'best'"),
        ("simulate --policy p:gain=much", "Policy 'p:gain=much'"),
        ("simulate --policy half.safetensors", "half.safetensors"),
        ("simulate --distance 200 --spans 5-60", "but the run ends at"),
        ("simulate --line-condition worn:wear_dept=1", "'wear_dept' is not known: did you mean 'wear_depth'"),
        ("simulate --line-condition worn:wear_depth", "'wear_depth' must read name=value"),
        ("simulate --line-condition worm", "'worn' (with values, such as 'new:irregularity=...')"),
        ("list worm", "Unknown name 'worm': did you mean 'worn'"),
        ("list --toml", "Give the name of a line or a pantograph"),
        ("list pd --toml", "is called 'pd'"),
        ("line periodic-stiffness", "has no spans with droppers"),
        pytest.param("train missing.toml", "missing.toml", marks=WITH_AGENTS),
        ("benchmark --config broken.toml", "broken.toml"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, message, tmp_path):
    (tmp_path / "broken.toml").write_text("kind = [")
    (tmp_path / "half.safetensors").write_bytes(b"PK\x03\x04half")
    before = sorted(tmp_path.iterdir())
    result = panto(*arguments.split(), cwd=tmp_path)
    assert (result.returncode, result.stdout) == (2, "")
    assert message in result.stderr
    assert re.fullmatch("panto: [^\n]*\n", result.stderr)
    assert sorted(tmp_path.iterdir()) == before


def test_names_and_values_may_stand_between_commas_and_blanks():
    assert pairs([",a=1,", "b=2 , c=3", " "]) == {"a": "1", "b": "2", "c": "3"}


OURS = [AccuracyWarning, PlugInWarning, UnusualWarning]


@pytest.mark.parametrize("category", [*OURS, UserWarning])
def test_a_warning_of_ours_is_a_sentence_and_one_of_others_says_where_it_is_from(category, capsys):
    _show_warning("Look out.", category, "file.py", 7)
    said = capsys.readouterr().err
    assert (said == "panto: warning: Look out.\n") == (category in OURS)
    assert said.startswith("panto: ") or said.startswith(f"file.py:7: {category.__name__}: Look out.")


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


# --- validate, simulate, film -----------------------------------------------------------------------


@pytest.mark.slow
def test_validate_prints_every_table_that_it_made_and_passes(monkeypatch):
    run = study.run
    validation = run()
    monkeypatch.setattr(study, "run", lambda *_, **__: validation)
    found = told("validate")
    assert found["passed"]
    assert len(found["checks"]) == 2 * len(reference.ACCEPTED)
    assert all(check["lowest"] <= check["value"] <= check["highest"] for check in found["checks"])
    assert {each["line_kind"] for each in found["kinds"]} == {"AC simple", "AC stitched"}
    stitched = {each["catenary"]: each for each in found["kinds"] if each["speed_kmh"] == 300.0}
    assert stitched["re330-stitched"]["max_uplift"] > 1.2 * stitched["re330"]["max_uplift"]  # at supports
    kind, more = study.Validation, [Table(name, ("x",), (("1",),)) for name in ("lines", "wear")]
    usual = kind.tables.fget
    monkeypatch.setattr(kind, "tables", property(lambda self: [*usual(self), *more]))
    printed = panto("validate").stdout
    for words in ("lines", "wear", "All figures inside."):
        assert words in printed
    monkeypatch.setattr(kind, "tables", property(lambda self: usual(self)[:1]))
    assert panto("validate", "--brief").stdout == "EN 50318:2002, 16 figures at two speeds: all inside.\n"
    monkeypatch.setattr(study, "run", run)
    monkeypatch.setitem(reference.ACCEPTED, "std", ((0, 1), (0, 1)))
    done = panto("validate")
    assert (done.returncode, "Not all figures are inside." in done.stdout) == (1, True)


@pytest.mark.longer
def test_simulate_writes_and_prints_what_identifies_the_run(tmp_path):
    words = ("simulate", "--distance", 120, "--sensors", "realistic", "--seed", 3, "--spans", "1-2")
    found = told(*words, "--output", tmp_path / "run.parquet", "--plot", tmp_path / "run.png")
    run = Trajectory.load(tmp_path / "run.parquet")
    assert (found["seed"], found["spans"]) == (3, [1, 2])
    assert found["figures"]["std"] == run.summary((1, 2)).std
    assert found["compliance"]
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    used = found["settings"]
    assert used == run.settings == simulate(**SHORT, sensors="realistic", seed=3).settings
    assert (used["version"], used["time_step"], used["distance"]) == (__version__, run.time_step, 120.0)
    assert used["spacing"] == pytest.approx(60.0 / round(60.0 / used["spacing"]))
    assert used["window"] >= 3
    assert (used["sensors"]["force_noise"], used["actuator"]["force_limit"]) == (2.0, 100.0)
    assert (used["catenary"], used["pantograph"]) == ("en50318-2002", "en50318-2002")
    assert {"line_condition", "control_interval", "pantograph_scatter", "bilateral", "precision"} <= set(used)
    text = panto("simulate", "--policy", "p", "--distance", 120, "--spans", "all").stdout
    assert "policy p, spans all" in text
    assert "standard deviation" in text


@pytest.mark.longer
def test_the_same_settings_give_the_same_run_again():
    run = simulate(line_condition="worn", actuator="realistic", speed_kmh=280.0, seed=1, **SHORT)
    settings = {name: value for name, value in run.settings.items() if name != "version"}
    again = simulate(**settings, seed=1, record_droppers=False)
    assert (again.contact_force == run.contact_force).all()
    settings = simulate("periodic-stiffness", "three-mass", distance=100.0).settings
    assert (settings["spacing"], settings["window"], settings["precision"]) == (None, None, None)  # no grid
    assert settings["time_step"] == 5e-3


@pytest.mark.longer
def test_defects_from_the_command_line_take_effect_and_a_sweep_carries_them_too():
    condition = "new:broken_droppers=[(2, 4)],raised_supports=[(1, 0.02)]"
    rest = ("--distance", 120, "--spans", "all", "--line-condition", condition)
    table = {"broken_droppers": [(2, 4)], "raised_supports": [(1, 0.02)]}
    std = simulate(**SHORT, line_condition=table).summary("all").std
    assert std != simulate(**SHORT).summary("all").std
    assert told("simulate", *rest)["figures"]["std"] == std
    swept = told("sweep", "speed_kmh=300", *rest)
    assert swept["rows"][0]["std"] == std
    assert swept["settings"]["line_condition"][0]["broken_droppers"] == [[2, 4]]
    swept = told("sweep", "catenary.contact_wire.tension=10e3,40e3", "--distance", 120, "--spans", "all")
    assert (swept["version"], swept["seed"], swept["spans"]) == (__version__, 0, "all")
    assert swept["settings"]["distance"] == 120.0
    assert [row["spacing"] for row in swept["rows"]] == sorted(row["spacing"] for row in swept["rows"])
    assert all(row["time_step"] > 0 for row in swept["rows"])
    judged = told("evaluate", "p", "--speed", 300, "--distance", 610)
    assert judged["settings"]["version"] == __version__
    assert set(judged["verdict"]) == {"ratio", "qualified"}


def test_a_preset_takes_values_and_defects():
    settings = simulate(**SHORT, line_condition="worn:irregularity=0.5,broken_droppers=[(2, 5)]").settings
    changed = {"irregularity": 0.5, "broken_droppers": [[2, 5]]}
    assert settings["line_condition"] == [LINE_CONDITIONS["worn"].model_dump(mode="json") | changed]
    assert actuator_settings("realistic:lag=0.02").lag == 0.02
    assert actuator_settings("realistic:lag=0.02").rate_limit == ACTUATOR_PRESETS["realistic"].rate_limit


@pytest.mark.longer
def test_a_film_is_as_large_as_its_help_says(monkeypatch, tmp_path):
    count, size = 2, (1280, 960)
    pytest.importorskip("cv2")
    pytest.importorskip("moviepy")
    seen = []
    monkeypatch.setattr("panto_env.cli.simulate.write_film", lambda *given: seen.append(given))
    words = ["film", *["passive"] * count, "--catenary", "periodic-stiffness", "--pantograph", "three-mass"]
    done = panto(*words, "--distance", "550", "--seconds", "0.1", "--output", tmp_path / "it.mp4")
    assert done.returncode == 0, done.stderr
    ((frames, path, rate, whole_size),) = seen
    assert (str(path), rate, whole_size) == (str(tmp_path / "it.mp4"), 25.0, size)
    assert next(iter(frames)).shape == (size[1], size[0], 3)


# --- list -------------------------------------------------------------------------------------------


@pytest.mark.longer
def test_all_that_has_a_name_is_listed_with_its_whole_description(monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 100)
    shown = only_words(panto("list").stdout)
    for family, load in (("catenary", load_catenary), ("pantograph", load_pantograph)):
        for name in available(family):
            assert only_words(load(name).description) in shown
    assert "headmotorkindmotor" in shown  # of a preset what differs from the usual
    assert "idealnone" in shown
    found = told("list")
    assert {entry["name"] for entry in found["pantograph"]} > {"en50318-2002", "dsa380"}
    usual = {"gain": 1.0, "derivative": 0.005, "damping": 150.0, "washout": None}
    assert found["policy"]["pd"]["parameters"] == usual
    assert found["line_condition"]["worn"]["wear_depth"] == 0.5e-3
    found = told("list", "realistic")
    assert (found["actuator"]["rate_limit"], found["sensors"]["force_noise"]) == (2500.0, 2.0)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("pd", "policy pd|Proportional and derivative feedback|derivative|0.005|(N s/m)"),
        ("fb+ff", "policy fb+ff|dead_zone|'span'"),
        ("worn", "line_condition worn|presets are new, smooth, as-built, fair, worn|wear_depth|0.0005|0.8"),
        ("realistic", "actuator realistic|2500.0|(N/s)|sensors realistic|velocity_noise|0.005"),
        ("head-motor", "actuator head-motor|maxon RE 40|torque_constant|0.0302|seen|recalled|(ohm)"),
        ("benchmark-2015", "catenary benchmark-2015|pantograph benchmark-2015|0.117|recalled|droppers"),
    ],
)
def test_a_name_is_answered_with_parameters_defaults_and_presets(name, parts):
    shown = panto("list", name).stdout
    assert [part for part in parts.split("|") if part not in shown] == []


def test_a_line_of_the_catalogue_is_a_start_for_one_of_yours(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(panto("list", "re250", "--toml").stdout, encoding="utf-8")
    given = load_catenary("re250").model_dump(exclude={"name"})
    assert load_catenary(mine).model_dump(exclude={"name"}) == given
    text = re.sub(
        r'^description = ".*"', 'description = "[bold]it[/bold] [/x]"', text_of("three-mass"), flags=re.M
    )
    mine.write_text(text)  # brackets are shown as they are
    assert "[bold]it[/bold] [/x]" in panto("list", mine).stdout
