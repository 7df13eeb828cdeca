import json
import re

import numpy as np
import pandas
import pytest
from pydantic import ValidationError

from panto_env import InputError, simulate
from panto_env.analysis.parameters import change, change_together
from panto_env.base.settings import explain, ranges_of
from panto_env.catalog import load_catenary
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary import check_line
from panto_env.plant.catenary.flexible import static as static_shape
from panto_env.plant.catenary.flexible.schema import Droppers, FlexibleCatenaryData, Support
from panto_env.plant.catenary.flexible.static import RestingDropper, as_rows, dropper_table, droppers_at_rest
from panto_env.plant.catenary.rig import RigData
from panto_env.plant.catenary.schema import Wire

from ..command import panto
from ..finite_element import simulation as finite_element
from ..finite_element.sections import line_of
from ..uniform_lines import UNIFORM
from . import periodic_span


def test_dropper_lengths_of_the_2015_benchmark_within_3_mm():
    shape = static_shape.solve(load_catenary("benchmark-2015"))
    half = [1.017, 0.896, 0.810, 0.758, 0.741]
    assert shape.dropper_length == pytest.approx(half + half[-2::-1], abs=3e-3)


@pytest.mark.parametrize("name", UNIFORM)
def test_agrees_with_finite_elements(name):
    """Smooth elements round the kinks at the droppers, at first order."""
    line = load_catenary(name)
    shape, other = static_shape.solve(line), finite_element.static_shape(line, element=0.1)
    inner = (other.x >= 0) & (other.x <= line.span_length)
    np.testing.assert_allclose(shape.contact.height(other.x[inner]), other.contact[inner], atol=2e-4)
    np.testing.assert_allclose(shape.messenger.height(other.x[inner]), other.messenger[inner], atol=2e-4)
    table, droppers = droppers_at_rest(line), line.droppers
    forces, stretches = (
        np.array([getattr(each, key) for each in table]) for key in ("static_force", "stretch")
    )
    assert forces.sum() == pytest.approx(other.dropper_tension.sum(), rel=1e-3)
    np.testing.assert_allclose(forces, other.dropper_tension, rtol=1e-3, atol=0.2)
    np.testing.assert_allclose([each.length for each in table] + stretches, other.dropper_length, atol=5e-4)
    stiffness = [droppers.stiffness or droppers.axial_stiffness / each.length for each in table]
    np.testing.assert_allclose(stretches, forces / stiffness, rtol=1e-9)


def check_against_the_closed_form(line, shape, tolerance):
    """tolerance: of heights (m), and a thousandth of that of forces (N)."""
    x = np.linspace(0, line.span_length, 1001)
    contact, messenger, tension, arm_force = periodic_span.shape(line, shape.dropper_mass, x)
    np.testing.assert_allclose(shape.contact.height(x), contact, rtol=0, atol=tolerance)
    np.testing.assert_allclose(shape.messenger.height(x), messenger, rtol=0, atol=tolerance)
    np.testing.assert_allclose(shape.dropper_tension, tension, rtol=0, atol=1e3 * tolerance)
    assert shape.arm_force == pytest.approx(arm_force, abs=1e3 * tolerance)


@pytest.mark.parametrize("name", [name for name in UNIFORM if load_catenary(name).stitch_wire is None])
def test_agrees_with_the_closed_form(name):
    line = load_catenary(name)
    check_against_the_closed_form(line, static_shape.solve(line), 1e-12)


# --- lines that can't hang so ---------------------------------------------------------------------

LINE = load_catenary("en50318-2002")
TWO = {"positions": (5.0, 55.0), "sag": (0.0, 0.0)}


def changed(**tables):
    """The reference line's table with other values."""
    given = LINE.model_dump()
    for key, value in tables.items():
        given[key] = given[key] | value if isinstance(value, dict) else value
    return given


def toml_of(table):
    """A table as the text of a TOML file."""
    given = {key: value for key, value in table.items() if value is not None and key != "sources"}
    tables = {key: value for key, value in given.items() if isinstance(value, dict)}
    plain = "".join(f"{key} = {json.dumps(value)}\n" for key, value in given.items() if key not in tables)
    return plain + "".join(f"[{key}]\n{toml_of(value)}" for key, value in tables.items())


SOFT = {"droppers": TWO, "contact_wire": {"tension": 60e3}, "messenger_wire": {"tension": 5e3}}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"droppers": {"sag": (0, 0, 0, 0, -0.1, 0, 0, 0, 0)}}, "4 .* at 23.5 m, would carry -231.2 N"),
        ({"encumbrance": 0.5}, r"Unloaded, dropper 3 .* at 17 m, would be -0.04186 m long"),
        (SOFT, "messenger wire .* would hang 0.022 m below"),
        (
            {"droppers": TWO, "encumbrance": 5.0, "contact_wire": {"tension": 7e3}},
            "differ by 0.59 m in height",
        ),
        ({"messenger_wire": {"tension": 3e3}, "encumbrance": 8.0}, "messenger .* would have a slope of 0.2"),
        ({"droppers": {"mass": 5.0}, "messenger_wire": {"tension": 2e3}}, "does not settle in 200 rounds"),
    ],
)
def test_a_line_that_can_t_hang_so_is_refused_however_it_is_made(values, message, tmp_path):
    """From a file, by a rig that computes it, and past the schema."""
    table = changed(**values)
    line = type(LINE).model_validate(table)
    file = tmp_path / "mine.toml"
    file.write_text(toml_of(table))
    with pytest.raises(InputError, match=rf"mine\.toml is not a valid entry: .*{message}"):
        load_catenary(file)
    with pytest.raises(InputError, match=message):
        check_line(RigData(name="rig", description="of it", line=line))
    parts = {key: getattr(LINE, key).model_copy(update=values[key]) for key in values if key != "encumbrance"}
    with pytest.raises(InputError, match=message) as caught:
        simulate(LINE.model_copy(update={key: values[key] for key in values} | parts))
    assert str(caught.value).count(". ") == 0


def test_a_parameter_with_which_a_line_can_t_hang_is_refused_in_the_same_words():
    message = r"Unloaded, dropper 3 .* at 17 m, would be -0.04186 m long"
    with pytest.raises(InputError, match=rf"catenary.encumbrance cannot be 0.5: {message}"):
        change(LINE, "catenary.encumbrance", 0.5)
    with pytest.raises(InputError, match=f"do not go together: {message}"):
        change_together(LINE, {"catenary.encumbrance": 0.5})


def test_too_many_unknowns_are_refused_before_any_is_made():
    with pytest.raises(InputError, match="has 2,000,007 nodes per wire; the maximum is 1,000,000"):
        simulate(spans=1000, window=0, spacing=0.03, time_step=1e-6)


def test_droppers_keep_apart_from_one_another_and_from_the_support():
    for positions in ((5.0, 5.05), (5.0, 59.95)):
        with pytest.raises(ValidationError, match=r"by 0\.1 m or more|0\.1 m or more from"):
            type(LINE).model_validate(changed(droppers={"positions": positions, "sag": (0.0, 0.0)}))


# --- any line -------------------------------------------------------------------------------------


def number(random, schema, key, usual):
    """Mostly near a usual value, at times anywhere in the range of the schema, or at one of its ends."""
    (between,) = ranges_of(schema.model_fields[key].rebuild_annotation())
    low, high = between.low, between.high
    match random.choice(["near"] * 5 + ["anywhere", "end"]):
        case "near":
            return float(random.uniform(max(low, usual / 4), min(high, usual * 4)))
        case "anywhere":
            return float(random.uniform(low, high))
        case _:
            return float(random.choice([low, high]))


def random_line(random):
    """Table of a line, all numbers within the schema's ranges."""
    span = number(random, FlexibleCatenaryData, "span_length", 60.0)
    count = int(random.integers(1, 13))
    gap = span / count
    shift = float(random.uniform(0.1, 0.9))
    depth = number(random, Droppers, "sag", 0.03)
    level = [depth * (1 - ((2 * k + 1) / count - 1) ** 2) for k in range(count)]  # a parabola
    errors = random.uniform(-0.02, 0.02, count) * (random.random() < 0.3)
    wires = [
        {
            "mass": number(random, Wire, "mass", 1.2),
            "tension": number(random, Wire, "tension", 20e3),
            "bending_stiffness": number(random, Wire, "bending_stiffness", 150.0),
        }
        for _ in range(2)
    ]
    kind = str(random.choice(["stiffness", "axial_stiffness"]))
    return LINE.model_dump() | {
        "span_length": span,
        "encumbrance": number(random, FlexibleCatenaryData, "encumbrance", 1.4),
        "contact_wire": wires[0],
        "messenger_wire": wires[1],
        "droppers": {
            "positions": [gap * (k + shift) for k in range(count)],
            "sag": np.clip(level + errors, -0.2, 0.5).tolist(),
            kind: number(random, Droppers, kind, 1e5),
            "mass": number(random, Droppers, "mass", 0.1),
            "contact_clamp_mass": number(random, Droppers, "contact_clamp_mass", 0.2),
            "messenger_clamp_mass": number(random, Droppers, "messenger_clamp_mass", 0.2),
        },
        "support": {"stiffness": number(random, Support, "stiffness", 5e5), "damping": 1000.0},
        "steady_arm": {"mass": 0.0, "stiffness": 0.0, "holds_wire": bool(random.integers(2))},
    }


@pytest.mark.longer
def test_any_line_is_refused_in_one_sentence_or_hangs_in_equilibrium():
    """Random numbers within the ranges; what hangs is judged by finite elements."""
    hung, messages = 0, []
    for seed in range(70):
        try:
            line = FlexibleCatenaryData.model_validate(random_line(np.random.default_rng(seed)))
            shape = static_shape.hang(line)
        except ValidationError as error:
            messages.append(explain(error, FlexibleCatenaryData))
            continue
        except InputError as error:
            messages.append(str(error))
            continue
        hung += 1
        assert shape.dropper_tension.min() > 0
        assert shape.dropper_length.min() > 0
        assert np.isfinite(shape.dropper_length).all()
        check_against_the_closed_form(line, shape, 1e-8)
        assert shape.contact.height(np.array(line.droppers.positions)) == pytest.approx(
            -np.array(line.droppers.sag), abs=1e-9
        )
        loaded = shape.messenger.height(np.array(line.droppers.positions)) + np.array(line.droppers.sag)
        stretched = shape.dropper_tension / shape.dropper_stiffness
        assert shape.dropper_length + stretched == pytest.approx(loaded, rel=1e-9)
        other = finite_element.static_shape(line, element=min(0.25, line.span_length / 40))
        inner = (other.x >= 0) & (other.x <= line.span_length)
        np.testing.assert_allclose(shape.contact.height(other.x[inner]), other.contact[inner], atol=2e-3)
        # They take a dropper's mass from its loaded length.
        extra = static_shape.GRAVITY * line.droppers.mass * stretched.max()
        weight = line.contact_wire.mass * static_shape.GRAVITY * line.span_length
        np.testing.assert_allclose(
            shape.dropper_tension, other.dropper_tension, rtol=1e-2, atol=extra + 2e-3 * weight
        )
    assert hung >= 10
    assert len(messages) >= 10
    assert not [each for each in messages if re.search(r"[.?!]\s|\n", each)]


RECORDED = {
    "ohl-three-span": "own-two-mass",
    "periodic-stiffness": "three-mass",
    "en50318-2002": "en50318-2002",
}


def test_the_command_lists_them_and_writes_them_with_units(tmp_path):
    line = load_catenary("re250")
    table = droppers_at_rest(line)
    told = panto("list", "re250")
    assert "Droppers of a span at rest" in told.stdout
    for each in table:
        assert f"{each.static_force:.1f}" in told.stdout
        assert f"{each.length:.4f}" in told.stdout
    listed = json.loads(panto("list", "re250", "--json").stdout)["catenary"]["droppers_at_rest"]
    assert [each["static_force"] for each in listed] == [each.static_force for each in table]
    path = tmp_path / "droppers.csv"
    result = panto("list", "re250", "--droppers", path)
    assert result.returncode == 0, result.stderr
    frame = pandas.read_csv(path)
    assert frame["number"].tolist() == list(range(1, 8))
    assert frame["from support (m)"].tolist() == list(line.droppers.positions)
    assert frame["static force (N)"].tolist() == pytest.approx([each.static_force for each in table])
    assert frame["length, unloaded (m)"].tolist() == pytest.approx([each.length for each in table])
    assert frame["stretch at rest (m)"].tolist() == pytest.approx([each.stretch for each in table])


@pytest.mark.parametrize("name", ["dsa250", "periodic-stiffness"])
def test_what_has_no_droppers_has_no_table(name, tmp_path):
    result = panto("list", name, "--droppers", tmp_path / "droppers.csv")
    assert result.returncode == 2
    assert "not a line with droppers" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_rig_has_those_of_its_line():
    assert droppers_at_rest(load_catenary("rig-flexible")) == droppers_at_rest(load_catenary("en50318-2002"))


def test_the_table_numbers_spans_only_where_they_differ():
    given = {"sequence": ["a", "a", {"span_length": 60.0}], "span_types": {"a": {}}}
    differ = as_rows(droppers_at_rest(line_of("re250", given)))
    assert [row["span"] for row in differ] == [1] * 7 + [2] * 7 + [3] * 6  # 60 m
    alike = as_rows(droppers_at_rest(load_catenary("re250")))
    assert alike[0].keys() == differ[0].keys() - {"span"}


@pytest.mark.parametrize("name", RECORDED)
def test_tension_is_recorded_of_every_dropper_and_only_on_request(name):
    given = {"catenary": name, "pantograph": RECORDED[name], "distance": 120.0}
    plant = Task(run_settings(given), lanes=2).plant
    droppers = len(plant.model.droppers)
    assert (droppers > 0) == (name == "en50318-2002")
    assert plant.samples(5).tension.shape == (2, 5, 0)
    assert plant.samples(5, tension=True).tension.shape == (2, 5, droppers)
    assert plant.samples(5).uplift.shape == (2, len(plant.model.supports), 5)
    assert plant.samples(5).rows.shape[:2] == (2, 5)
    if name != "periodic-stiffness":  # a massless line keeps no tension at all
        plant.start(np.arange(2), 50.0)
        tension = plant.model.rest_tension(0)
        assert tension.shape == (droppers,)
        assert (tension > 0).all()


def dropper(span, number):
    return RestingDropper(number, 5.0 * number, 0.0124, 1.23456, 123.44, 0.001234, span)


def test_a_line_is_drawn_below_the_last_dropper_of_each_span():
    places = [(1, 1), (1, 2), (1, 3), (2, 1), (3, 1), (3, 2)]
    made = dropper_table([dropper(*place) for place in places])
    assert made.section_ends == (2, 3)
    assert [row[:3] for row in made.rows[:2]] == [("1", "1", "5.000"), ("1", "2", "10.000")]
    assert made.rows[-1] == ("3", "2", "10.000", "12.4", "1.2346", "123.4", "1.23")
    assert made.title == "Droppers of all spans at rest, as designed"
    assert made.headings[:2] == ("span", "dropper")
    alike = dropper_table([dropper(1, 1), dropper(1, 2)])
    assert alike.section_ends == ()
    assert alike.rows[0] == ("1", "5", "12.4", "1.2346", "123.4", "1.23")
    assert alike.title == "Droppers of a span at rest, as designed"
    assert len(alike.headings) == len(made.headings) - 1 == 6
    assert "sag (mm)" in alike.headings
    assert "stretch at rest (mm)" in alike.headings


def test_string_hangs_in_a_parabola_between_its_droppers():
    line = load_catenary("en50318-2002")
    limp = line.contact_wire.model_copy(update={"bending_stiffness": 0.0})
    shape = static_shape.solve(line.model_copy(update={"contact_wire": limp}))
    a, b = line.droppers.positions[4:6]
    deepest = limp.mass * static_shape.GRAVITY * (b - a) ** 2 / (8 * limp.tension)
    assert shape.contact.height(np.array([(a + b) / 2]))[0] == pytest.approx(-deepest, rel=1e-6)


@pytest.mark.parametrize("name", UNIFORM)
def test_in_equilibrium(name):
    """Droppers and steady arm carry the contact wire's weight; tensions are positive."""
    line = load_catenary(name)
    shape = static_shape.solve(line)
    weight = line.contact_wire.mass * static_shape.GRAVITY * line.span_length
    clamps = static_shape.GRAVITY * (shape.dropper_mass / 2 + line.droppers.contact_clamp_mass)
    assert (shape.dropper_tension - clamps).sum() + shape.arm_force == pytest.approx(weight)
    assert shape.dropper_tension.min() > 0
    sag = -np.array(line.droppers.sag)
    assert shape.contact.height(np.array(line.droppers.positions)) == pytest.approx(sag, abs=1e-9)
