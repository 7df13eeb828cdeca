"""Lines at rest and drawn lines: gradients by hand, tables cell by cell, and what is computed elsewhere."""

import math
from dataclasses import fields, replace
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from panto_env import simulate
from panto_env.analysis.line_check import (
    LABELS,
    OF_SECTIONS,
    DrawnLine,
    LineCheck,
    SpanCheck,
    check,
    drawn_line,
    elasticity_table,
    facts,
    span_tables,
    table,
)
from panto_env.analysis.parameters import parameter_names
from panto_env.base.table import Alarm
from panto_env.catalog import available, load_catenary, load_drawn
from panto_env.catalog.family import gradient_limits, highest_speed
from panto_env.catalog.loader import content_of
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import solve

from ..command import panto
from ..pages import tables_of

HEIGHTS = [0.0, 0.0, -0.065, -0.13, -0.13, 0.0]
LENGTHS = [65.0, 65.0, 65.0, 50.0, 65.0, 65.0]


def of_unlike_spans():
    """Lengths and contact heights that differ from span to span."""
    table = load_catenary("re250").model_dump(exclude_none=True)
    del table["spans"]
    spans = [
        {"span_length": length, "contact_height": height}
        for length, height in zip(LENGTHS, HEIGHTS, strict=True)
    ]
    return FlexibleCatenaryData.model_validate(table | {"sequence": spans})


@pytest.fixture(scope="module")
def line():
    return of_unlike_spans()


@pytest.fixture(scope="module")
def found(line):
    return check(line, 100.0)


def test_gradients_and_their_changes(found):
    np.testing.assert_allclose([each.gradient for each in found.spans], [0, -1, -1, 0, 2, 0], atol=1e-9)
    np.testing.assert_allclose([each.change for each in found.spans], [0, -1, 0, 1, 2, -2], atol=1e-9)
    by_key = {each.key: each for each in found.criteria(120.0)}
    assert by_key["gradient"].value == 2.0
    assert by_key["gradient_change"].value == 2.0
    assert by_key["gradient_change"].kept
    assert not {each.key: each for each in found.criteria(160.0)}["gradient_change"].kept
    assert "up to 120 km/h" in by_key["gradient_change"].note
    assert all(each.kept is None for each in found.criteria())


def test_forces_pre_sag_and_elasticity_of_each_span(line, found):
    shape, (_, yields) = solve(line), elasticity(line, 100.0)
    assert min(each.smallest_force for each in found.spans) == shape.dropper_tension.min()
    assert max(each.largest_force for each in found.spans) == shape.dropper_tension.max()
    assert found.spans[0].pre_sag == 0.065
    assert found.spans[3].pre_sag == pytest.approx(0.05, abs=1e-3)  # as much per metre
    assert math.isnan(found.spans[0].non_uniformity)
    assert math.isnan(found.spans[-1].non_uniformity)
    second = yields[: len(yields) // 4]
    assert found.spans[1].non_uniformity == non_uniformity(second)
    assert found.spans[1].largest_elasticity == second.max()


def test_classes_of_speed():
    """As recalled from EN 50119, table of gradients."""
    assert gradient_limits(50.0) == (25.0, 25.0)
    assert gradient_limits(161.0) == (2.0, 1.0)
    assert gradient_limits(251.0) == (0.0, 0.0)
    assert highest_speed(2.0, 1.0) == 200.0
    assert highest_speed(2.0, 1.1) == 160.0
    assert highest_speed(0.0, 0.0) == math.inf
    assert highest_speed(30.0, 0.0) == 0.0


def test_published_figures_stand_beside_those_of_the_line():
    line = load_catenary("re330-stitched")
    found = check(line, 100.0)
    ((name, middle, support, uneven, _),) = elasticity_table([found]).rows
    yields = 1e3 * found.elasticities
    in_mid_span = f"{yields[found.places == line.span_length / 2].item():.3f} (0.44)"
    assert (name, middle, support) == ("re330-stitched", in_mid_span, f"{yields[0]:.3f} (0.4)")
    assert uneven == f"{non_uniformity(yields):.1f} (8)"
    told = panto("line", "re330-stitched").stdout
    assert in_mid_span in told
    assert "(" not in "".join(elasticity_table([check(load_catenary("ln2"), 100.0)]).rows[0])
    # A published figure is no value of the line: it changes no run, and cannot be varied.
    assert content_of(line) == content_of(line.model_copy(update={"published": None}))
    assert not any("published" in each for each in parameter_names(line, "catenary"))


def test_the_page_has_rows_of_the_elasticity_of_the_catalogue_s_lines():
    lines = (load_catenary(name) for name in available("catenary"))
    alike = [each for each in lines if isinstance(each, FlexibleCatenaryData) and not each.sequence]
    found = elasticity_table([check(each, 100.0) for each in alike])
    headings, rows = tables_of("validation.md")["Elasticity at 100 N, in brackets as published"]
    assert tuple(headings) == found.headings
    assert len(rows) > 3
    assert {tuple(row) for row in rows} <= set(found.cells)


SPAN = SpanCheck(1, 0.0, 65.0, 1.8, 0.0125, -1.5, 0.25, 0.0654, 48.6, 151.4, 0.000321, 0.000654, 34.16)


FIRST = SpanCheck(2, 65.0, 50.5, 1.4, -0.0125, 0.0, -0.25, 0.05, 30.0, 99.7, math.nan, math.nan, math.nan)


def test_the_tables_of_spans_cell_by_cell():
    placed, at_rest = span_tables([SPAN, FIRST])
    assert placed.title == "Spans, and heights at the support where each begins"
    assert at_rest.title == "Spans at rest"
    assert placed.rows == [
        ("1", "0", "65", "+0.013", "1.800", "-1.50", "0.25"),
        ("2", "65", "50.5", "-0.013", "1.400", "0.00", "-0.25"),
    ]
    assert at_rest.rows == [
        ("1", "65", "49 to 151", "0.321 to 0.654", "34.2"),
        ("2", "50", "30 to 100", "–", "–"),
    ]
    assert [len(each.headings) for each in (placed, at_rest)] == [7, 5]
    assert all(each.title.endswith("; all spans are alike") for each in span_tables([SPAN]))


@pytest.mark.parametrize(
    ("steepest", "change", "allowed"),
    [(0.0, 0.0, "at any speed"), (1.5, 0.25, "up to 200 km/h"), (99.0, 0.25, "at no speed")],
)
def test_the_criteria_of_a_line_value_by_value(steepest, change, allowed):
    spans = [
        SPAN._replace(gradient=-steepest, change=change / 2, pre_sag=0.03),
        SPAN._replace(gradient=steepest / 2, change=-change),
    ]
    droppers = [SimpleNamespace(static_force=force) for force in (80.0, 48.6, 151.4)]
    yields = np.array([3e-4, 5e-4, 7e-4])
    found = LineCheck(load_catenary("re250"), spans, droppers, np.arange(3.0), yields, 100.0)
    criteria = {each.key: each for each in found.criteria(200.0)}
    assert {key: (each.value, each.unit) for key, each in criteria.items()} == {
        "gradient": (steepest, "‰"),
        "gradient_change": (change, "‰"),
        "pre_sag": (65.4, "mm"),
        "smallest_dropper_force": (48.6, "N"),
        "largest_dropper_force": (151.4, "N"),
        "largest_elasticity": (pytest.approx(0.7), "mm/N"),
        "smallest_elasticity": (pytest.approx(0.3), "mm/N"),
        "non_uniformity": (pytest.approx(40.0), "%"),
    }
    assert criteria["gradient_change"].note.endswith(f"allows these gradients {allowed}")
    assert (criteria["gradient"].highest, criteria["gradient_change"].highest) == (2.0, 1.0)
    assert {each.highest for each in found.criteria()} == {None}


def drawn(seed, **values):
    """A drawn line: values 1, 2, 3 ... times the seed, within no band."""
    names = [each.name for each in fields(DrawnLine) if each.name != "ending"]
    return replace(
        DrawnLine(**{name: k * float(seed) for k, name in enumerate(names, 1)}, ending=""), **values
    )


INSIDE = {"force_deviation": 0.1, "uplift": 0.02, "elasticity": 0.0002, "non_uniformity": 15.0}
"""At the lower ends of the bands of family:high-speed."""


@pytest.mark.parametrize("name", INSIDE)
def test_the_ends_of_a_band_are_within_it(name):
    lines = load_drawn("family:high-speed")
    low, high = getattr(lines.plausible, name)
    assert INSIDE[name] == low
    for value, outside in ((low, []), (high, []), (low * 0.999, [name]), (high * 1.001, [name])):
        assert drawn(1, **INSIDE | {name: value}).outside(lines) == outside
    assert drawn(1, **INSIDE | {name: math.nan}).outside(lines) == [name]


def test_the_table_of_drawn_lines_cell_by_cell():
    found = [drawn(k, **INSIDE | {"uplift": uplift}) for k, uplift in ((1, 0.05), (3, math.nan), (4, 0.5))]
    for source in ("family:high-speed", "section:main-line"):
        lines = load_drawn(source)
        made = table(lines, found)
        assert made.title == f"3 lines of {lines.kind} {lines.name}"
        assert made.headings == ("value", "minimum", "median", "maximum", "plausible", "lines outside")
        rows = {row[0]: row[1:] for row in made.rows}
        kept = [name for name in LABELS if source.startswith("section") or name not in OF_SECTIONS]
        assert list(rows) == [LABELS[name] for name in kept]
        names = [each.name for each in fields(DrawnLine)]
        for name in set(kept) - set(INSIDE):
            times = names.index(name) + 1
            assert rows[LABELS[name]] == (times, 3 * times, 4 * times, "", "")
    low, high = lines.plausible.uplift
    assert rows[LABELS["uplift"]] == (0.05, pytest.approx(0.275), 0.5, f"{low:g} to {high:g}", "2")
    assert isinstance(rows[LABELS["uplift"]][-1], Alarm)
    assert rows[LABELS["elasticity"]][-2:] == ("0.0002 to 0.001", "0")
    assert not isinstance(rows[LABELS["elasticity"]][-1], Alarm)
    told = facts(load_drawn("family:high-speed"), found)
    assert [each["outside"] for each in told] == [[], ["uplift"], ["uplift"]]
    assert [each["seed"] for each in told] == [1, 3, 4]
    assert set(told[0]) == {each.name for each in fields(DrawnLine)} | {"outside"}


@pytest.mark.slow
@pytest.mark.parametrize("source", ["family:high-speed", "section:main-line"])
def test_values_are_those_of_the_line_that_an_environment_has(source):
    family = load_drawn(source)
    found = drawn_line(family, 3)
    env = gymnasium.make("Pantograph-v0", catenary=source, speed_kmh=(0.0, family.fastest_kmh)).unwrapped
    env.reset(seed=3)
    line = env.task.plant.catenary
    each, encumbrances = line.layout().spans, line.layout().encumbrances
    lengths = [span.span_length for span in each]
    assert found.span_length == pytest.approx(np.mean(lengths), rel=1e-12)
    assert found.length == pytest.approx(sum(lengths), rel=1e-12)
    assert (found.shortest_span, found.longest_span) == pytest.approx((min(lengths), max(lengths)), rel=1e-9)
    assert found.droppers == np.mean([len(span.droppers.positions) for span in each])
    assert found.encumbrance == pytest.approx(np.mean(encumbrances), rel=1e-12)
    assert found.pre_sag == max(max(span.droppers.sag) for span in each)
    at_rest = check(line, 100.0)
    assert found.gradient == pytest.approx(at_rest.largest_gradient)
    assert found.gradient_change == pytest.approx(at_rest.largest_change)
    shown = "shortest span (m)" in {row[0] for row in table(family, [found]).rows}
    assert shown == source.startswith("section")
    assert (found.draws > 0, found.seed, found.ending) == (True, 3, "")
    assert found.contact_tension == line.contact_wire.tension / 1e3
    assert found.messenger_tension == line.messenger_wire.tension / 1e3
    assert found.wave_speed_kmh == pytest.approx(
        3.6 * np.sqrt(line.contact_wire.tension / line.contact_wire.mass)
    )
    run = simulate(line, family.plausible.pantograph, found.speed_kmh, record_droppers=False).summary()
    assert found.force_deviation == run.std / run.mean
    assert found.uplift == run.max_uplift


@pytest.mark.longer
def test_the_stiffest_places_are_not_missed(monkeypatch):
    """They are at droppers: between 49 places, re250's non-uniformity was 45.1 instead of 48.4 %."""
    line = load_catenary("re250")
    found = non_uniformity(elasticity(line, 100.0)[1])
    monkeypatch.setattr("panto_env.plant.catenary.flexible.as_run.PLACES", 650)
    assert non_uniformity(elasticity(line, 100.0)[1]) == pytest.approx(found, abs=0.1)


@pytest.mark.parametrize("name", ["re330-stitched", "re250-stitched"])
def test_droppers_of_the_german_lines_are_those_that_were_seen(name):
    line, stiffer = load_catenary(name), load_catenary(name.removesuffix("-stitched"))
    assert line.droppers.positions[0] == 5.0
    assert np.diff(line.droppers.positions) == pytest.approx(9.17, abs=0.01)
    assert line.sources["droppers.positions"].startswith("seen: ")
    assert line.droppers == stiffer.droppers
