"""The catalogue: every entry loads and says where its values come from; bad files are refused."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pydantic import BaseModel

from panto_env.base.errors import InputError
from panto_env.catalog import available, load_catenary, load_family, load_pantograph, load_section
from panto_env.catalog.section import LineSection
from panto_env.plant.catenary import CatenaryData
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.periodic_stiffness import PeriodicStiffnessData
from panto_env.plant.catenary.rig import RigData
from panto_env.plant.catenary.three_span import ThreeSpanData
from panto_env.plant.pantograph.schema import PantographData

LOADERS: dict[str, Callable[[Any], Any]] = {"catenary": load_catenary, "pantograph": load_pantograph}
ALL = LOADERS | {"family": load_family, "section": load_section}
ENTRIES = [(family, name) for family in ALL for name in available(family)]
TAG = re.compile(r"(paper [123]|seen|recalled|own choice)\b")
REFERENCE = re.compile(r"(?:seen|recalled|own choice): as ([\w.:-]*\w)")
NOT_VALUES = {"kind", "name", "description", "sources"}


def values(entry: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Key and value of every value that the file gives, the tables opened."""
    given = entry.model_fields_set - (NOT_VALUES if not prefix else set())
    if isinstance(entry, RigData):  # its line has sources of its own, and gives what every line has
        given -= {"line", *CatenaryData.model_fields}
    if getattr(entry, "sequence", ()):  # the spans are those of the sequence
        given -= {"spans"}
    for key in sorted(given):
        item = getattr(entry, key)
        if isinstance(item, BaseModel) and not (isinstance(entry, LineSection) and key == "base"):
            yield from values(item, f"{prefix}{key}.")
        elif key == "span_types":
            for name, table in item.items():
                yield from ((f"{key}.{name}.{own}", value) for own, value in table.items())
        else:
            yield f"{prefix}{key}", item


# --- what stands in the catalogue ---------------------------------------------------------------


def test_every_entry_that_is_promised_is_there() -> None:
    assert set(available("pantograph")) >= {
        *("en50318-2002", "benchmark-2015", "identified-2dof", "three-mass"),
        *("dsa380", "dsa250", "cx", "own-two-mass", "own-motor-head"),
    }
    assert set(available("catenary")) >= {
        *("en50318-2002", "benchmark-2015", "shinkansen-simple"),
        *("ohl-three-span", "periodic-stiffness", "re330", "re250", "ln2", "sweden-st15"),
        *("beijing-tianjin", "beijing-shanghai", "beijing-yizhuang"),
    }


@pytest.mark.parametrize(("family", "name"), ENTRIES)
def test_every_value_has_a_source(family: str, name: str) -> None:
    entry = ALL[family](name)
    assert entry.name == name
    assert entry.description
    needed = {key for key, _ in values(entry)}
    if "damping.ratio" in entry.sources:  # what both coefficients follow from
        needed = needed - {"damping.alpha", "damping.beta"} | {"damping.ratio", "damping.frequencies"}
    assert set(entry.sources) == needed
    assert not {key: text for key, text in entry.sources.items() if not TAG.match(text)}
    for text in entry.sources.values():
        if reference := REFERENCE.match(text):
            families = {f"family:{own}" for own in available("family")}
            assert reference[1] in {*entry.sources, *available(family), *available("catenary"), *families}


@pytest.mark.slow
@pytest.mark.parametrize(("family", "name"), [each for each in ENTRIES if each[0] not in LOADERS])
def test_families_and_sections_have_lines(family: str, name: str) -> None:
    """Loading them takes that for granted."""
    assert ALL[family](name).draw(np.random.default_rng(0))[0].spans > 2


@pytest.mark.parametrize("name", available("catenary"))
def test_wires_carry_waves_faster_than_trains(name: str) -> None:
    line = load_catenary(name)
    if isinstance(line, FlexibleCatenaryData):
        wave_speed_kmh = 3.6 * (line.contact_wire.tension / line.contact_wire.mass) ** 0.5
        assert (350 if line.contact_wires > 1 else 400) < wave_speed_kmh < 600


OF_PANTOGRAPHS = "masses stiffnesses dampings static_force aerodynamic_coefficient contact_stiffness"
OF_LINES = (
    "span_length spans contact_wire.mass contact_wire.tension contact_wire.bending_stiffness "
    "messenger_wire.mass messenger_wire.tension messenger_wire.bending_stiffness support.stiffness "
    "support.damping steady_arm.mass steady_arm.stiffness damping.alpha damping.beta"
)
PUBLISHED: dict[tuple[str, str], tuple[list[Any], dict[str, Any]]] = {
    ("pantograph", "en50318-2002"): (
        [(7.2, 15.0), (4200.0, 50.0), (10.0, 90.0), 120.0, 0.0, 50e3],
        {"contact_damping": 0.0},
    ),
    ("pantograph", "benchmark-2015"): (
        [(7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0), 70.0, 0.00097, 50e3],
        {},
    ),
    ("pantograph", "identified-2dof"): (
        [(5.0, 10.38), (14544.0, 611.85), (0.11, 50.92), 54.0, 0.0, 32992.0],
        {"contact_damping": 12.31},
    ),
    ("pantograph", "three-mass"): (
        [(7.5, 4.6, 4.8), (6000.0, 5400.0, 1.0), (10.0, 5.0, 32.0), 70.0, 0.00097, "rigid"],
        {},
    ),
    ("catenary", "en50318-2002"): (
        [60.0, 10, 1.35, 20e3, 195.0, 1.07, 16e3, 131.7, 500e3, 1000.0, 0.0, 0.0, 0.0125, 1e-4],
        {
            "droppers.positions": (5.0, 10.5, 17.0, 23.5, 30.0, 36.5, 43.0, 49.5, 55.0),
            "droppers.sag": (0.0,) * 9,
            "droppers.stiffness": 100e3,
        },
    ),
    ("catenary", "benchmark-2015"): (
        [55.0, 15, 1.35, 22e3, 195.0, 1.08, 16e3, 131.7, 500e3, 1000.0, 0.5, 266.67, 0.0125, 1e-4],
        {
            "encumbrance": 1.2,
            "droppers.positions": (4.5, 10.25, 16.0, 21.75, 27.5, 33.25, 39.0, 44.75, 50.5),
            "droppers.sag": (0.0, 0.024, 0.041, 0.052, 0.055, 0.052, 0.041, 0.024, 0.0),
            "droppers.axial_stiffness": 200e3,
            "droppers.mass": 0.117,
            "droppers.messenger_clamp_mass": 0.195,
            "droppers.contact_clamp_mass": 0.165,
        },
    ),
    ("catenary", "periodic-stiffness"): ([50.0], {"mean_stiffness": 4000.0, "stiffness_variation": 0.4}),
}
"""Values in the order of the keys above, and others."""


@pytest.mark.parametrize(("family", "name"), PUBLISHED)
def test_published_values(family: str, name: str) -> None:
    held = dict(values(LOADERS[family](name)))
    listed, others = PUBLISHED[family, name]
    keys = OF_PANTOGRAPHS if family == "pantograph" else OF_LINES
    expected = dict(zip(keys.split(), listed, strict=False)) | others
    assert {key: held[key] for key in expected} == expected


# --- values that were computed -------------------------------------------------------------------


def test_damping_of_the_shinkansen_line() -> None:
    line = load_catenary("shinkansen-simple")
    assert isinstance(line, FlexibleCatenaryData)
    omega = 2 * np.pi * np.linspace(1, 20, 200)
    ratio = line.damping.alpha / (2 * omega) + line.damping.beta * omega / 2
    assert (ratio.min(), ratio.max()) == pytest.approx((0.0057, 0.0134), abs=5e-5)


Array = npt.NDArray[np.float64]
STEP = 0.5  # m


def wire_stiffness(length: float, tension: float, bending: float) -> Array:
    """Stiffness of a tensioned beam with free ends: height and slope at each node in turn."""
    h = STEP
    bend = np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h**2, -6 * h, 2 * h**2],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h**2, -6 * h, 4 * h**2],
        ]
    )
    pull = np.array(
        [
            [36, 3 * h, -36, 3 * h],
            [3 * h, 4 * h**2, -3 * h, -(h**2)],
            [-36, -3 * h, 36, -3 * h],
            [3 * h, -(h**2), -3 * h, 4 * h**2],
        ]
    )
    elements = round(length / h)
    matrix = np.zeros((2 * elements + 2,) * 2)
    for first in range(0, 2 * elements, 2):
        part = slice(first, first + 4)
        matrix[part, part] += bending / h**3 * bend + tension / (30 * h) * pull
    return matrix


def flexibility(matrix: Array, span: float) -> Array:
    """Static lift per newton along the second span of a line's first wire."""
    nodes = 2 * np.arange(round(span / STEP), round(2 * span / STEP) + 1)
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)[nodes, nodes]


def once_per_span(lift: Array) -> float:
    """Part of the lift that repeats once per span."""
    phase = np.linspace(0, 2 * np.pi, lift.size)[:-1]
    return float(2 * np.mean(lift[:-1] * np.cos(phase)))


def test_suspension_stiffness_matches_the_two_wire_line() -> None:
    line, two = load_catenary("ohl-three-span"), load_catenary("en50318-2002")
    assert isinstance(line, ThreeSpanData)
    assert isinstance(two, FlexibleCatenaryData)
    span = two.span_length
    one_wire = wire_stiffness(3 * span, line.wire.tension, line.wire.bending_stiffness)
    contact, messenger = (
        wire_stiffness(3 * span, wire.tension, wire.bending_stiffness)
        for wire in (two.contact_wire, two.messenger_wire)
    )
    size = len(contact)
    two_wires = np.block([[contact, np.zeros_like(contact)], [np.zeros_like(contact), messenger]])
    for i in range(4):
        support = 2 * round(i * span / STEP)
        one_wire[support, support] += line.suspension_stiffness
        two_wires[size + support, size + support] += two.support.stiffness
    for place in (i * span + position for i in range(3) for position in two.droppers.positions):
        upper, lower = size + 2 * round(place / STEP), 2 * round(place / STEP)
        spring = two.droppers.stiffness * np.array([[1, -1], [-1, 1]])
        two_wires[np.ix_([upper, lower], [upper, lower])] += spring
    expected = once_per_span(flexibility(two_wires, span))
    assert once_per_span(flexibility(one_wire, span)) == pytest.approx(expected, rel=0.02)


# --- a user's own files --------------------------------------------------------------------------

PANTOGRAPH = """
kind = "pantograph"
description = "mine"
masses = [7.0, 12.0]
stiffnesses = [5000, 50]
dampings = [10, 90]
static_force = 60
aerodynamic_coefficient = 0.001
contact_stiffness = 5e4
"""
LINE = """
kind = "flexible"
description = "mine"
span_length = 50
spans = 5
encumbrance = 1.2
contact_wire = { mass = 1.35, tension = 2e4, bending_stiffness = 195 }
messenger_wire = { mass = 1.07, tension = 1.6e4, bending_stiffness = 131.7 }
support = { stiffness = 5e5, damping = 1000 }
steady_arm = { mass = 0, stiffness = 0 }
damping = { alpha = 0.0125, beta = 1e-4 }
[droppers]
positions = [10, 25, 40]
sag = [0, 0.02, 0]
stiffness = 1e5
"""
SPRING = """
kind = "periodic_stiffness"
description = "mine"
span_length = 50
spans = 12
mean_stiffness = 4000
stiffness_variation = 0.4
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(family: str, source: Any) -> str:
    """Message of the refusal, which must be one sentence."""
    with pytest.raises(InputError) as caught:
        LOADERS[family](source)
    message = str(caught.value)
    assert message.endswith(".")
    assert not re.search(r"[.?!]\s|\n", message), message
    return message


def test_own_file_with_plain_values(tmp_path: Path) -> None:
    path = write(tmp_path, PANTOGRAPH)
    pantograph = load_pantograph(path)
    assert load_pantograph(path) is pantograph
    path.write_text(PANTOGRAPH.replace("static_force = 60", "static_force = 65"))
    assert load_pantograph(path).static_force == 65  # read anew after an edit
    assert isinstance(pantograph, PantographData)
    assert pantograph.name == "mine"
    assert pantograph.masses == (7.0, 12.0)
    assert pantograph.contact_damping == 0
    assert pantograph.sources == {}
    assert load_pantograph(pantograph) is pantograph
    line = load_catenary(str(write(tmp_path, LINE)))
    assert isinstance(line, FlexibleCatenaryData)
    assert line.droppers.sag == (0, 0.02, 0)
    assert isinstance(load_catenary(write(tmp_path, SPRING)), PeriodicStiffnessData)


@pytest.mark.parametrize("family", LOADERS)
def test_unknown_names_missing_files_and_other_types(family: str, tmp_path: Path) -> None:
    message = refusal(family, "en50318-2020")
    assert "en50318-2020" in message
    assert "did you mean 'en50318-2002'" in message
    assert "did you mean" not in refusal(family, "qqq")
    path = tmp_path / "absent.toml"
    for source in (path, str(path)):
        assert str(path) in refusal(family, source)
    assert "int" in refusal(family, 7)


MASSES = "masses = [7.0, 12.0]"
BAD: list[tuple[str, str, str, str, str]] = [
    # family and file, text replaced, its replacement, the key, what was expected
    ("pantograph", MASSES, f"{MASSES}\nmases = 1", "mases", "did you mean 'masses'"),
    ("pantograph", MASSES, f"{MASSES}\nflexible = 1", "flexible", "known are kind"),
    ("pantograph", MASSES, "", "masses", "missing: masses, head first (kg)"),
    ("pantograph", MASSES, "masses = 7", "masses", "a list, such as [7]"),
    ("pantograph", MASSES, "masses = []", "masses", "must not be empty (given: [])"),
    ("pantograph", MASSES, "masses = [7, 'a']", "masses.2", "a number from 0.1 to 200 kg (given: 'a')"),
    ("pantograph", MASSES, "masses = [7, nan]", "masses.2", "a number from 0.1 to 200 kg (given: nan)"),
    ("pantograph", MASSES, "masses = [7, 6, 5]", "stiffnesses", "3 masses are given"),
    ("pantograph", "[10, 90]", "[10]", "dampings", "but 1 dampings"),
    ("pantograph", "= 60", "= -1", "static_force", "a number from 0 to 1,000 N (given: -1)"),
    ("pantograph", "= 60", "= 'big'", "static_force", "a number from 0 to 1,000 N (given: 'big')"),
    ("pantograph", "= 60", "= { valu = 60 }", "static_force", "a number"),
    ("pantograph", "= 60", "= { value = 60, sorce = 'x' }", "static_force", "'sorce'"),
    ("pantograph", "= 60", "= { source = 'x' }", "static_force", "must hold 'value'"),
    ("pantograph", "= 60", "= { value = -1, source = 'x' }", "static_force", "given: -1"),
    ("pantograph", "5e4", "-1", "contact_stiffness", "from 1,000 to 1e+06 N/m or 'rigid' (given: -1)"),
    ("pantograph", "5e4", "'rigid'\ncontact_damping = 1", "contact_damping", "must be 0"),
    ("pantograph", '"pantograph"', '"flexible"', "kind", "must be 'pantograph'"),
    ("line", '"flexible"', '"flexibel"', "kind", "'flexible', 'three_span'"),
    ("line", 'kind = "flexible"', "", "kind", "'flexible', 'three_span'"),
    ("line", "tension = 2e4", "tension = -2e4", "contact_wire.tension", "500 to 200,000 N (given: -20000.0)"),
    ("line", "tension = 2e4", "tenson = 2e4", "contact_wire.tenson", "did you mean 'tension'"),
    ("line", ", tension = 2e4", "", "contact_wire.tension", "missing: tension (N)"),
    ("line", "damping = { alpha", "damping2 = { alpha", "damping", "a table of alpha, beta"),
    ("line", "{ stiffness = 5e5, damping = 1000 }", "5e5", "support", "must be a table"),
    ("line", "[0, 0.02, 0]", "[0, 0]", "droppers", "sag must hold one value per dropper: 3"),
    ("line", "[0, 0.02, 0]", "[0, nan, 0]", "droppers.sag.2", "a number from -0.2 to 0.5 m (given: nan)"),
    ("line", "[10, 25, 40]", "[10, 40, 25]", "droppers", "positions must increase"),
    ("line", "[10, 25, 40]", "[10, 25, 60]", "dropper", "60.0 m lies outside the span of 50.0 m"),
    ("line", "stiffness = 1e5", "", "droppers", "either stiffness or axial_stiffness"),
    ("line", "spans = 5", "spans = 2", "spans", "a whole number from 3 to 1,000 (given: 2)"),
    ("line", "spans = 5", "spans = 5.5", "spans", "a whole number from 3 to 1,000 (given: 5.5)"),
    ("spring", "= 0.4", "= 1.0", "stiffness_variation", "a number from 0 to 0.99 (given: 1.0)"),
    ("spring", "mean_stiffness = 4000", "", "mean_stiffness", "missing: mean stiffness k_m (N/m)"),
]


@pytest.mark.parametrize(("file", "old", "new", "key", "expected"), BAD)
def test_bad_value_is_named(tmp_path: Path, file: str, old: str, new: str, key: str, expected: str) -> None:
    text = {"pantograph": PANTOGRAPH, "line": LINE, "spring": SPRING}[file]
    assert text.count(old) >= 1
    path = write(tmp_path, text.replace(old, new, 1))
    message = refusal("pantograph" if file == "pantograph" else "catenary", path)
    assert str(path) in message
    said = message.removeprefix(str(path))
    assert re.search(rf"\b{re.escape(key)}\b", said), message
    assert expected in said, message
    assert key != "kind" or "span_length" not in said  # it is said alone


@pytest.mark.parametrize("name", available("pantograph"))
def test_values_that_are_invented_do_not_have_the_name_of_a_product(name: str) -> None:
    sources = load_pantograph(name).sources
    own = [sources[key].startswith("own choice") for key in ("masses", "stiffnesses", "dampings")]
    assert name.startswith("own-") == all(own)
