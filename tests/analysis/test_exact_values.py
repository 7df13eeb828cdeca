"""Tables of lines, cell by cell, of made-up values that differ in every place."""

import math
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.analysis import line_check as family
from panto_env.analysis.line_check import (
    LABELS,
    OF_SECTIONS,
    DrawnLine,
    LineCheck,
    SpanCheck,
    drawn_line,
    facts,
    span_tables,
    table,
)
from panto_env.base.table import Alarm
from panto_env.catalog import load_catenary, load_drawn
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity

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
    assert {each.text_columns for each in (placed, at_rest)} == {0}
    (placed, at_rest) = span_tables([SPAN])
    assert placed.title.endswith("; all spans are alike")
    assert at_rest.title.endswith("; all spans are alike")


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


def line(seed, **values):
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
        assert line(1, **INSIDE | {name: value}).outside(lines) == outside
    assert line(1, **INSIDE | {name: math.nan}).outside(lines) == [name]


def test_the_table_of_drawn_lines_cell_by_cell():
    found = [line(k, **INSIDE | {"uplift": uplift}) for k, uplift in ((1, 0.05), (3, math.nan), (4, 0.5))]
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


@pytest.mark.parametrize("terminated", [False, True])
def test_a_drawn_line_has_what_is_computed_of_it(monkeypatch, terminated):
    """With the draws and the run replaced by made-up ones."""
    own, passes = load_catenary("re250"), []
    figures = SimpleNamespace(std=30.0, mean=120.0, max_uplift=0.07)
    run = SimpleNamespace(
        terminated=terminated, summary=lambda: figures, nominal_force=110.0, ending="It ended." * terminated
    )
    monkeypatch.setattr(family, "line_of_seed", lambda lines, seed: (own, (150.0, 260.0)))
    monkeypatch.setattr(family, "simulate", lambda *given, **named: passes.append((given, named)) or run)
    lines = SimpleNamespace(
        drawn=lambda random, speeds: iter([None, None, own, None] if speeds == (0.0, 280.0) else []),
        fastest_kmh=280.0,
        plausible=SimpleNamespace(pantograph="dsa250"),
    )
    found = drawn_line(lines, 5)
    assert (found.seed, found.draws, found.speed_kmh) == (5, 3, 260.0)
    assert passes == [((own, "dsa250", 260.0), {"record_droppers": False})]
    assert 0.0 < found.milliseconds < 1e4
    yields = elasticity(own, 110.0)[1]
    assert (found.elasticity, found.non_uniformity) == (yields.max(), non_uniformity(yields))
    if terminated:
        assert math.isnan(found.force_deviation)
        assert math.isnan(found.uplift)
        assert found.ending == "It ended."
    else:
        assert (found.force_deviation, found.uplift, found.ending) == (0.25, 0.07, "")
    assert found.contact_tension == own.contact_wire.tension / 1e3
    assert found.wave_speed_kmh == pytest.approx(3.6 * own.contact_wire.wave_speed)
