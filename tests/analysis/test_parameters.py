"""Names, labels and changes of parameters, and options of commands: units, defaults, spans, panels."""

import re

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from panto_env import InputError
from panto_env.analysis import sweep as sweep_module
from panto_env.analysis.options import PANELS, SEVERAL, parse_spans, with_settings
from panto_env.analysis.parameters import (
    change,
    change_together,
    check_name,
    parameter_label,
    parameter_names,
)
from panto_env.analysis.sweep import FAMILIES, labels, sweep
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.cli import make_app
from panto_env.control.settings import fields, run_settings

from .test_line_check import of_unlike_spans


def test_the_names_of_an_entry_are_all_its_numbers():
    assert parameter_names(load_pantograph("three-mass"), "p") == [
        *(f"p.{key}.{k}" for key in ("masses", "stiffnesses", "dampings") for k in (1, 2, 3)),
        *("p.static_force", "p.aerodynamic_coefficient", "p.aerodynamic_linear"),
        *("p.contact_stiffness", "p.contact_damping"),
        *("p.roll_inertia", "p.spring_distance", "p.frame_friction"),
    ]
    names = parameter_names(load_catenary("re250"), "c")
    assert {"c.contact_wire.tension", "c.droppers.stiffness", "c.droppers.positions.1", "c.spans"} <= set(
        names
    )
    assert not {"c.name", "c.sources", "c.contact_wire", "c.droppers.positions", "c.ends"} & set(names)


def test_labels_have_the_unit_at_their_end_or_none():
    line = load_catenary("re250")
    assert parameter_label("line.spans", line).startswith("line: default number of spans")
    condition = run_settings({}).line_condition[0]
    assert parameter_label("line_condition.irregularity", condition).startswith("line condition: ")
    for word in ("1st", "2nd", "3rd", "4th", "11th", "12th", "13th", "21st", "22nd", "101st", "112th"):
        assert parameter_label(f"catenary.droppers.positions.{word[:-2]}", line) == (
            f"catenary: droppers: distance from support, {word} (m)"
        )
    assert labels(["policy.gain", "speed_kmh"]) == {
        "speed_kmh": "speed of the train (km/h)",
        "policy.gain": "policy: gain",
    }


@pytest.mark.parametrize("name", ["masses", "x.masses", "x.mases.1", "x.masses.4", "x.masses.0"])
def test_an_unknown_name_is_refused_with_what_is_known(name):
    with pytest.raises(InputError) as told:
        check_name(name.replace("x.", "pantograph."), load_pantograph("three-mass"))
    before, _, known = str(told.value).partition("known are ")
    assert before.startswith("Unknown parameter '")
    assert "' of three-mass: " in before
    assert known.endswith("frame_friction (lists count from 1).")
    assert "masses.1," in known
    assert "masses.2" not in known
    with pytest.raises(InputError, match=r"Unknown parameter 'sensors\.nothing': (?!.*lists count)"):
        check_name("sensors.nothing", run_settings({}).sensors)


@pytest.mark.parametrize("name", ["seed", "catenary", "mean_force", "speedy", "speed_kmh.1", "policy", ""])
def test_only_the_speed_and_the_families_values_are_swept(name):
    """Each setting by its bare name would change nothing without a word."""
    begin = "" if name in FAMILIES else ".*it must be speed_kmh, distances or begin with one of 'catenary.', "
    with pytest.raises(InputError, match=f"Unknown parameter{begin}"):
        sweep({name: [250.0]}, workers=1)


def test_a_change_is_of_one_value_and_the_entry_stays():
    one = load_pantograph("three-mass")
    other = change(one, "pantograph.masses.2", 11.0)
    assert other.masses == (one.masses[0], 11.0, one.masses[2])
    assert other.model_dump(exclude={"masses"}) == one.model_dump(exclude={"masses"})
    both = change_together(one, {"pantograph.masses.3": 12.0, "pantograph.static_force": 60.0})
    assert both.masses == (*one.masses[:2], 12.0)
    assert both.static_force == 60.0
    nested = change(load_catenary("re250"), "catenary.contact_wire.tension", 14000.0)
    assert nested.contact_wire.tension == 14000.0
    assert nested.messenger_wire == load_catenary("re250").messenger_wire


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("catenary.span_length", -5.0, ".*must be a number from"),  # from its schema
        ("catenary.messenger_wire.tension", 200.0, ""),  # from what hangs it
    ],
)
def test_what_cannot_be_is_said_after_which_value_it_was(name, value, message):
    with pytest.raises(InputError, match=f"^{name} cannot be {value:g}: {message}"):
        change(load_catenary("re250"), name, value)
    with pytest.raises(InputError, match=f"^These values do not go together: {message}"):
        change_together(load_catenary("re250"), {name: value})


def test_a_value_that_every_span_replaces_is_refused():
    line = of_unlike_spans()
    given = line.model_dump(exclude_none=True)
    own = {"sequence": [span | {"encumbrance": 1.7} for span in given["sequence"]]}
    line = type(line).model_validate(given | own)
    with pytest.raises(
        InputError, match=r"cannot be 1\.5: Each span in the sequence of line 're250' has values"
    ):
        change(line, "catenary.encumbrance", 1.5)
    with pytest.raises(InputError, match=r"together: Each span .* in the place of encumbrance, so nothing"):
        change_together(line, {"catenary.encumbrance": 1.5})
    assert change(line, "catenary.encumbrance", line.encumbrance) == line
    assert change(line, "catenary.contact_wire.tension", 14000.0).contact_wire.tension == 14000.0
    both = {"catenary.encumbrance": 1.5, "catenary.contact_wire.tension": 14000.0}
    assert change_together(line, both).contact_wire.tension == 14000.0


def test_spans_that_a_command_takes():
    taken = {None: None, "all": "all", "5-6": (5, 6), " 5 - 16 ": (5, 16), "7-7": (7, 7), "1-1000": (1, 1000)}
    assert {text: parse_spans(text) for text in taken} == taken
    for text in ("", "5", "5-", "-6", "-", "5-6-7", "a-6", "5-b", "٥-٦", "1234567890-2", "5.0-6", "ALL"):
        with pytest.raises(InputError, match=r"^--spans must read first-last, e\.g\. 5-6, or all, not '"):
            parse_spans(text)
    for text in ("6-5", "0-3", "1-1001", "123456789-999999999"):
        with pytest.raises(InputError, match="spans must be two whole numbers"):
            parse_spans(text)


def test_every_option_of_a_setting_has_its_help_and_no_value_by_itself():
    @with_settings(left_out=("precision",))
    def command(settings, more: int = 3):
        """Do nothing."""

    options = {each.name: each for each in command.__signature__.parameters.values()}
    assert not {"settings", "precision"} & set(options)
    assert options.pop("more").default == 3
    renamed = {"speed": "speed_kmh", "line_spans": "spans", "fault": "faults"}
    for name, option in options.items():
        field = fields()[renamed.get(name, name)]
        kind, info = option.annotation.__metadata__[0], option.annotation.__metadata__[-1]
        assert kind is info
        assert option.default is None
        own = field.description.replace("(s)", "(ms)", 1) if name == "time_step" else field.description
        flag = isinstance(field.default, bool)
        default = "" if flag or field.default in (None, ()) else f" Default: {field.default}."
        often = " May be given several times." * (renamed.get(name, name) in SEVERAL)
        assert info.help == f"{own[:1].upper()}{own[1:]}.{often}{default}"


def test_droppers_are_laid_out_anew_by_spacing_pre_sag_and_span():
    """As the TOML file takes them; a span of another length had kept its droppers' places, or was refused."""
    line = load_catenary("re250")
    of_file = line.droppers.model_dump(exclude_none=True, exclude={"positions", "sag"})
    first = line.droppers.positions[0]
    closer = change(line, "catenary.droppers.spacing", 5.0)
    given = {"spacing": 5.0, "first": first, "pre_sag": max(line.droppers.sag) - line.droppers.sag[0]}
    laid_out = type(line).model_validate(line.model_dump(exclude_none=True) | {"droppers": of_file | given})
    assert closer.droppers == laid_out.droppers
    assert len(closer.droppers.positions) > len(line.droppers.positions)
    sagging = change(closer, "catenary.droppers.pre_sag", 0.04)
    assert sagging.droppers.positions == closer.droppers.positions
    assert max(sagging.droppers.sag) == pytest.approx(0.04, abs=2e-3)
    shorter = change(line, "catenary.span_length", 40.0)
    x = shorter.droppers.positions
    assert (shorter.span_length, x[0], 40.0 - x[-1]) == (40.0, first, pytest.approx(first))
    usual = np.diff(line.droppers.positions).mean()
    assert np.diff(x).mean() == pytest.approx(usual, rel=0.15)
    assert change(line, "catenary.span_length", line.span_length) == line
    assert parameter_label("catenary.droppers.spacing", line) == (
        "catenary: droppers: approximate distance between droppers, which gives their number (m)"
    )


def test_span_and_spacing_are_swept_together_in_any_order(monkeypatch):
    seen = []
    monkeypatch.setattr(
        sweep_module, "_rows", lambda one, spans: seen.append(one.arguments["catenary"]) or []
    )
    both = {"catenary.span_length": [50.0, 65.0], "catenary.droppers.spacing": [5.0, 9.0]}
    for order in (both, dict(reversed(both.items()))):
        seen.clear()
        sweep(order, catenary="re250", workers=1)
        found = {(each.span_length, len(each.droppers.positions)) for each in seen}
        assert found == {(50.0, 9), (50.0, 5), (65.0, 12), (65.0, 7)}


def call(*words, **options):
    """What a command with settings as options gets, and its help."""
    got = {}

    @with_settings(**options)
    def command(settings):
        got.update(settings)

    app = typer.Typer()
    app.command()(command)
    done = CliRunner().invoke(app, list(words))
    assert done.exit_code == 0, done.output
    return got, " ".join(done.output.split())


def test_a_time_step_is_given_in_milliseconds():
    assert call("--time-step", "2.5") == ({"time_step": 0.0025}, "")


def test_the_help_says_defaults_unless_a_file_may_have_others():
    shown = f"Default: {fields()['speed_kmh'].default}."
    assert shown in call("--help", only=("speed_kmh",))[1].replace("│ ", "").replace(" │", "")
    assert "Default" not in call("--help", only=("speed_kmh",), defaults=False)[1]


def test_the_help_groups_options_and_learning_comes_last():
    done = CliRunner().invoke(make_app(), ["simulate", "--help"], env={"COLUMNS": "120"})
    panels = {}
    for line in done.output.splitlines():
        if line.startswith("╭─"):
            panels[line.strip("╭╮─ ")] = options = []
        elif found := re.match(r"│ +\*? *--([a-z-]+)", line):
            options.append(found[1])
    assert list(panels) == ["Options", "Line", "Pantograph", "Run", "Output", "Control and learning"]
    assert panels["Options"] == ["help"]
    assert {"catenary", "line-condition"} <= set(panels["Line"])
    assert {"pantograph", "mean-force", "actuator", "sensors"} <= set(panels["Pantograph"])
    assert {"speed", "policy", "spans", "seed", "time-step"} <= set(panels["Run"])
    assert {"output", "plot", "json", "figures", "droppers"} <= set(panels["Output"])
    assert {"washout", "history", "settle"} <= set(panels["Control and learning"])
    assert panels["Run"].index("policy") < panels["Run"].index("time-step")


@pytest.mark.parametrize("command", ["sweep", "film", "rig", "evaluate", "benchmark", "tune", "oracle"])
def test_commands_with_settings_have_no_option_outside_a_panel(command):
    done = CliRunner().invoke(make_app(), [command, "--help"], env={"COLUMNS": "120"})
    first = done.output.partition("╭─ Options")[2].partition("╰")[0]
    assert re.findall(r"--[a-z-]+", first) == ["--help"]
    order = [panel for panel in PANELS if f"╭─ {panel} ─" in done.output]
    assert order == sorted(order, key=lambda panel: done.output.index(f"╭─ {panel} ─"))
    assert "Output" in order


def test_commands_are_grouped_by_what_a_person_wants():
    shown = CliRunner().invoke(make_app(), ["--help"], env={"COLUMNS": "120"}).output
    places = [shown.index(f"╭─ {panel} ─") for panel in ("Simulate", "Judge", "Identify", "Control", "Learn")]
    assert places == sorted(places)
    assert "─ Commands ─" not in shown
    assert "From other packages" not in shown, "a command of ours is in no panel"
    assert places[0] < shown.index("│ simulate ") < places[1] < shown.index("│ report ") < places[2]
    assert places[3] < shown.index("│ benchmark ") < places[4] < shown.index("│ train ")
