"""Slips of units in lines and pantographs: each ends in a refusal, a warning, or does little."""

import re
import warnings

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import UnusualWarning
from panto_env.catalog import available, load_catenary, load_family, load_pantograph, unusual
from panto_env.catalog.loader import text_of
from panto_env.catalog.values import FACTOR, values_of
from panto_env.envs import PantographEnv
from panto_env.plant.catenary import check_line
from panto_env.plant.pantograph.schema import check_at_rest
from tests.command import panto

ENTRIES = {
    "en50318-2002": load_catenary,
    "benchmark-2015": load_catenary,
    "ohl-three-span": load_catenary,
    "periodic-stiffness": load_catenary,
    "dsa380": load_pantograph,
    "identified-2dof": load_pantograph,
    "en50318-2002 ": load_pantograph,
}
LITTLE = {
    # A thousandth of what the catalogue also has as zero is as good as zero.
    *(("droppers.sag", 1e-3), ("droppers.mass", 1e-3), ("droppers.messenger_clamp_mass", 1e-3)),
    *(("droppers.contact_clamp_mass", 1e-3), ("steady_arm.mass", 1e-3), ("steady_arm.stiffness", 1e-3)),
    *(("contact_damping", 1e-3), ("dampings 1", 1e-3)),
    ("aerodynamic_coefficient", 1e-3),  # the mean force is then below the standard's minimum
    # Springs to the ground are 0.1 to 612 N/m in the catalogue: 0.1 and 100 N/m are both usual.
    *(("stiffnesses 3", 1e3), ("stiffnesses 2", 1e-3)),
    # 0.11 N s/m is the catalogue's lightest damper of a head, 110 N s/m would be one, too.
    ("dampings 1", 1e3),
}
"""Slips without a word: key, with the number in a list whose numbers are changed one by one, and factor."""


def table_of(entry, key, value):
    """The entry's table with another value."""
    table = entry.model_dump(exclude={"sources"})
    *groups, last = key.split(".")
    place = table
    for group in groups:
        place = place[group]
    place[last] = value
    return table


def slips(entry):
    """Name, factor and table of each slip: numbers of a pantograph's lists are slipped one by one, too."""
    for key, given, *_ in values_of(entry):
        if isinstance(given, str | int) or not np.any(given):
            continue
        for factor in (1e3, 1e-3):
            if isinstance(given, float):
                yield key, factor, table_of(entry, key, factor * given)
                continue
            yield key, factor, table_of(entry, key, [factor * each for each in given])
            for number, each in enumerate(given if "." not in key else (), start=1):
                one = [*given[: number - 1], factor * each, *given[number:]]
                if each:
                    yield f"{key} {number}", factor, table_of(entry, key, one)


def end_of(entry, table):
    """How a slip ends."""
    try:
        slipped = type(entry).model_validate(table)
        check_line(slipped) if entry.kind in ("flexible", "three_span") else None
        check_at_rest(slipped) if entry.kind == "pantograph" else None
    except ValueError:
        return "refused"
    return "warned" if unusual(slipped) else "silent"


@pytest.mark.parametrize(("name", "load"), ENTRIES.items())
def test_every_slip_of_a_thousand_is_refused_or_warned_of_or_does_little(name, load):
    entry = load(name.strip())
    ends = {(key, factor): end_of(entry, table) for key, factor, table in slips(entry)}
    assert len(ends) >= 8
    silent = {slip for slip, end in ends.items() if end == "silent"}
    assert not silent - LITTLE


@pytest.mark.parametrize(
    ("name", "load", "key", "value", "sentence"),
    [
        ("dsa380", load_pantograph, "stiffnesses", [9.43, 14100, 0.1], "At rest spring 1 .* by 16.5 m"),
        ("dsa380", load_pantograph, "stiffnesses", [9430, 14.1, 0.1], "At rest spring 2 .* by 11.1 m"),
        ("en50318-2002", load_catenary, "droppers.stiffness", 150.0, "dropper 1 .* stretched by 0.46 m"),
        ("benchmark-2015", load_catenary, "droppers.axial_stiffness", 200.0, "dropper 1 .* by 0.5 m"),
        ("en50318-2002", load_catenary, "support.stiffness", 500.0, "supports .* would yield by 2.7 m"),
    ],
)
def test_what_gives_way_at_rest_is_refused(name, load, key, value, sentence):
    entry = load(name)
    slipped = type(entry).model_validate(table_of(entry, key, value))
    with pytest.raises(InputError, match=sentence):
        simulate(**{"pantograph" if load is load_pantograph else "catenary": slipped})


def test_an_uplift_per_m_s_instead_of_km_h_is_refused():
    entry = load_pantograph("dsa380")
    with pytest.raises(ValueError, match=r"must be a number from -0\.01 to 0\.01"):
        type(entry).model_validate(table_of(entry, "aerodynamic_coefficient", 0.00097 * 3.6**2))


def test_the_force_at_speed_decides_as_well_as_the_static_force():
    entry = load_pantograph("dsa380")
    table = entry.model_dump() | {"stiffnesses": [450.0, 14100.0, 0.1]}
    soft = type(entry).model_validate(table)
    check_at_rest(soft)  # 70 N: 0.16 m
    with pytest.raises(InputError, match=r"At rest spring 1 of pantograph 'dsa380' .* compressed by 0\.3"):
        simulate(pantograph=soft, speed_kmh=300.0)


def test_nothing_of_the_catalogue_and_of_its_families_is_unusual():
    for name in available("catenary"):
        assert not unusual(load_catenary(name))
    for name in available("pantograph"):
        assert not unusual(load_pantograph(name))
    for name in available("family"):
        family = load_family(name)
        for seed in range(8):
            assert not unusual(family.draw(np.random.default_rng(seed))[0])


def test_bounds_are_the_catalogue_s_times_the_factor():
    bending = [
        load_catenary(name).contact_wire.bending_stiffness
        for name in available("catenary")
        if load_catenary(name).kind == "flexible"
    ]
    line = load_catenary("re250")
    for value, expected in (
        (min(bending) / FACTOR * 1.01, False),
        (min(bending) / FACTOR * 0.99, True),
        (max(bending) * FACTOR * 0.99, False),
        (max(bending) * FACTOR * 1.01, True),
        (0.0, False),
    ):
        found = unusual(type(line).model_validate(table_of(line, "contact_wire.bending_stiffness", value)))
        assert bool(found) is expected


@pytest.mark.parametrize(
    ("sag", "sentence"),
    [
        ([-0.024, -0.041, -0.052, -0.041, -0.024], "52 mm higher within the span than at the supports"),
        ([0.055, 0.03, 0.0, 0.03, 0.055], "55 mm higher within the span than at the outer droppers"),
        ([0.0, 0.024, 0.03, 0.024, 0.0], None),
        ([0.0, -0.004, 0.0, 0.0, 0.0], None),
        ([0.02, 0.02, 0.02, 0.02, 0.02], None),
    ],
)
def test_a_wire_that_hogs_is_warned_of(sag, sentence):
    line = load_catenary("en50318-2002")
    droppers = line.droppers.model_copy(
        update={"positions": (5.0, 17.0, 30.0, 43.0, 55.0), "sag": tuple(sag)}
    )
    found = unusual(line.model_copy(update={"droppers": droppers}))
    assert len(found) == (sentence is not None)
    assert sentence is None or (sentence in found[0] and "a pre-sag is positive" in found[0])


def of_spans(sequence, **types):
    """A line of the catalogue with spans of its own."""
    table = load_catenary("re250").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    return table | {"span_types": types, "sequence": sequence}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"droppers": {"stiffness": 100e6}},
            r"droppers\.stiffness in span 2 is 1e\+08 N/m, more than 30 times beyond",
        ),
        ({"support": {"damping": 1.0}}, r"support\.damping in span 2 is 1 N s/m, more than 30 times beyond"),
        (
            {"droppers": {"sag": [0.0, 0.0, -0.006, -0.006, -0.006, 0.0, 0.0]}},
            "6 mm higher within span 2 than at the supports; droppers.sag counts downwards",
        ),
    ],
)
def test_a_value_of_one_span_is_warned_of_with_its_number(changes, sentence):
    line = load_catenary("re250")
    found = unusual(type(line).model_validate(of_spans(["a", "b", "a", "a"], a={}, b=changes)))
    assert len(found) == 1
    assert re.search(sentence, found[0])
    assert not unusual(type(line).model_validate(of_spans(["a", {"span_length": 60.0}, "a"], a={})))


def test_a_value_that_every_span_replaces_is_not_unusual():
    table = of_spans(["a", "a", {"type": "a", "span_length": 60.0}], a={"droppers": {"stiffness": 100e3}})
    table["droppers"]["stiffness"] = 100e6
    assert not unusual(type(load_catenary("re250")).model_validate(table))


def test_a_line_made_from_masts_is_warned_of_like_any_other(tmp_path):
    base, masts = tmp_path / "base.toml", tmp_path / "masts.csv"
    base.write_text(text_of("re250").replace("value = 137.5", "value = 0.1375"), encoding="utf-8")
    masts.write_text("position\n0\n65\n125\n190\n")
    result = panto("line", str(base), "--masts", str(masts))
    assert result.returncode == 0, result.stderr
    assert "warning: Line 'masts': contact_wire.bending_stiffness is 0.1375 N m^2" in result.stderr


@pytest.fixture
def slipped(tmp_path):
    """A file of a line whose bending stiffness is in kN m^2."""
    path = tmp_path / "mine.toml"
    path.write_text(re.sub(r"value = 195\.0", "value = 0.195", text_of("en50318-2002")), encoding="utf-8")
    return str(path)


SENTENCE = "Line 'mine': contact_wire.bending_stiffness is 0.195 N m^2, more than 30 times beyond"


def test_a_warning_reaches_users_of_python(slipped):
    with pytest.warns(UnusualWarning, match=re.escape(SENTENCE)):
        simulate(slipped, distance=120.0, spans=4)
    with pytest.warns(UnusualWarning, match=re.escape(SENTENCE)):
        PantographEnv(catenary=slipped)
    with warnings.catch_warnings(action="ignore"):
        line, env = load_catenary(slipped), PantographEnv()
    with pytest.warns(UnusualWarning, match=re.escape(SENTENCE)):
        simulate(line, distance=120.0, spans=4)
    with pytest.warns(UnusualWarning, match=re.escape(SENTENCE)):
        env.reset(options={"catenary": slipped})


@pytest.mark.slow
def test_a_warning_reaches_users_of_commands_and_reports(slipped, tmp_path):
    run, page = tmp_path / "run.parquet", tmp_path / "page.html"
    done = panto("simulate", "--catenary", slipped, "--distance", "700", "--output", str(run))
    assert done.stderr.count(f"warning: {SENTENCE}") == 1
    listed = panto("list", slipped)
    assert f"warning: {SENTENCE}" in listed.stderr
    panto("report", str(run), "--output", str(page))
    assert SENTENCE.replace("'", "&#39;") in page.read_text(encoding="utf-8")
