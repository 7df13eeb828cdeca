"""Checks of a line at rest: gradients by hand, and what is computed elsewhere."""

import math

import numpy as np
import pytest

from panto_env import simulate
from panto_env.analysis.line_check import check, elasticity_table, span_tables
from panto_env.analysis.parameters import parameter_names
from panto_env.analysis.plots import plot_line
from panto_env.catalog import available, load_catenary
from panto_env.catalog.family import gradient_limits, highest_speed
from panto_env.catalog.loader import content_of
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity, per_span
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import solve

from ..command import panto
from ..documents import ROOT

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
    placed, at_rest = span_tables(found.spans)
    assert placed.rows[4][3:] == ("-0.130", "1.800", "2.00", "2.00")
    assert at_rest.rows[0][3:] == ("–", "–")


def test_a_uniform_line_is_one_span():
    line = load_catenary("en50318-2002")
    found = check(line, 100.0)
    places, yields = elasticity(line, 100.0)
    (span,) = found.spans
    assert span.non_uniformity == non_uniformity(yields)
    assert found.largest_gradient == 0.0
    assert len(found.places) == len(places)
    figure = plot_line(found)
    assert len(figure.axes) == 3


def test_the_drawing_shows_both_wires_every_dropper_and_the_elasticity(line, found):
    wires, contact, drawn = plot_line(found).axes
    shape = solve(line)
    by_label = {each.get_label(): each for each in wires.get_lines()}
    x, heights = by_label["contact wire"].get_data()
    np.testing.assert_allclose(heights, shape.contact.height(np.asarray(x)))
    segments = next(each for each in wires.collections if each.get_label() == "dropper").get_segments()
    assert len(segments) == len(shape.dropper_tension)
    np.testing.assert_allclose(contact.get_lines()[-1].get_ydata()[0], 0.0, atol=1e-6)
    np.testing.assert_allclose(drawn.get_lines()[-1].get_ydata(), 1e3 * found.elasticities)


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


@pytest.mark.parametrize("sequence", [None, [{}, {"span_length": 50.0}, {}, {}]], ids=["alike", "unlike"])
def test_the_stiffest_places_are_not_missed(sequence, monkeypatch):
    """They are at droppers: between 49 places, re250's non-uniformity was 45.1 instead of 48.4 %."""
    table = load_catenary("re250").model_dump(exclude={"sources"}, exclude_none=True)
    if sequence:
        table = {name: value for name, value in table.items() if name != "spans"} | {"sequence": sequence}
    line = FlexibleCatenaryData.model_validate(table)
    found = [non_uniformity(each) for each in per_span(*elasticity(line, 100.0))]
    monkeypatch.setattr("panto_env.plant.catenary.flexible.as_run.PLACES", 650)
    assert [non_uniformity(each) for each in per_span(*elasticity(line, 100.0))] == pytest.approx(
        found, abs=0.1
    )


def test_the_page_has_the_elasticity_of_every_line_whose_spans_are_alike():
    lines = (load_catenary(name) for name in available("catenary"))
    alike = [each for each in lines if isinstance(each, FlexibleCatenaryData) and not each.sequence]
    table = elasticity_table([check(each, 100.0) for each in alike]).markdown
    assert table in (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["re330-stitched", "re250-stitched"])
def test_droppers_of_the_german_lines_are_those_that_were_seen(name):
    line, stiffer = load_catenary(name), load_catenary(name.removesuffix("-stitched"))
    assert line.droppers.positions[0] == 5.0
    assert np.diff(line.droppers.positions) == pytest.approx(9.17, abs=0.01)
    assert line.sources["droppers.positions"].startswith("seen: ")
    assert line.droppers == stiffer.droppers


def test_a_line_built_for_250_km_h_takes_200():
    """It was 0.46 with droppers of our own choice; EN 50367 allows 0.3."""
    found = simulate("re250-stitched", "dsa380", 200.0, mean_force="en50367").summary()
    assert found.std / found.mean == pytest.approx(0.33, abs=0.01)
    assert found.contact_loss == 0.0
