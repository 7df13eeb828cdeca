"""The free values of a fit: their names and places, and where a variant of the line has each."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.fitting.fit import Found, slack_droppers
from panto_env.fitting.values import FREE, TOLERANCES, WAVES, Design, Value, Values
from panto_env.plant.line_condition import LINE_CONDITIONS, LineCondition, draw

SPANS = 14


@pytest.fixture
def plan(design, pantograph):
    """14 spans of 60 m with 9 droppers each."""
    return Design(design, pantograph, LineCondition(), SPANS)


def everything(plan, **more):
    return Values(plan, FREE, (-1.0, 900.0), **more)


def at(values, name, difference):
    """Differences of which only one, of the value of this name, is not 0."""
    (number,) = [k for k, value in enumerate(values.all) if value.name == name]
    return difference * np.eye(len(values))[number]


def test_names_and_places(plan):
    values = everything(plan)
    by_name = {value.name: value for value in values.all}
    assert len(by_name) == len(values) == 2 + 9 * SPANS + (SPANS - 1) + 2 + 7 + 2 * len(WAVES)
    dropper = by_name["dropper 4 of span 12"]
    assert dropper.place == 11 * 60.0 + 23.5
    assert dropper.index == (11 * 9 + 3,)
    assert (dropper.kind, dropper.unit, dropper.scale) == ("droppers", "mm", 1e3)
    assert by_name["support 13"].place == 780.0
    assert by_name["tension of the messenger wire"].place is None
    # The DSA 380's upper dampers are 0, so no share of them can be found.
    assert {name for name in by_name if name.startswith("dampings")} == {"dampings 3 of the pantograph"}
    along = {value.name: value.index for value in everything(replace(plan, first_span=40)).all}
    assert (along["dropper 4 of span 52"], along["support 53"]) == ((11 * 9 + 3,), (12,))
    assert [value.kind for value in values.all] == sorted((v.kind for v in values.all), key=FREE.index)


def test_only_those_within_the_stretch_are_freed(plan):
    values = Values(plan, ("supports", "droppers"), (100.0, 200.0))
    assert [value.name for value in values.all if value.kind == "supports"] == ["support 2", "support 3"]
    places = [value.place for value in values.all if value.kind == "droppers"]
    assert places == [place for place in plan.layout.positions if 100 < place < 200]
    assert values.of_kind("supports") == [len(places), len(places) + 1]


@pytest.mark.parametrize("free", [("dropper",), (), ("tensions", "Droppers")])
def test_what_cannot_be_freed_is_refused(plan, free):
    name = next((each for each in free if each not in FREE), "")
    with pytest.raises(InputError, match=f"'{name}' cannot be freed: .*droppers"):
        Values(plan, free, (0.0, 900.0))


def test_tolerances(plan):
    values = everything(plan, tolerances={"droppers": 0.01})
    own = dict(zip((value.name for value in values.all), values.tolerances, strict=True))
    assert own["dropper 1 of span 1"] == 0.01
    assert own["support 1"] == TOLERANCES["supports"]
    # Parts of a wave of a drawn phase: cosine and sine of it have half its power each.
    assert own["sine of waves of 5 m"] == WAVES[1][1] / np.sqrt(2)


def test_a_variant_has_damping_and_pantograph_and_that_of_zeros_is_the_design(plan):
    """Values of the line are where they should: ``test_problem`` has the true ones."""
    values = everything(plan)

    def variant(name, difference):
        return values.variant(at(values, name, difference), 70.0)

    damping = variant("damping beta", 0.5).catenary.damping
    assert (damping.alpha, damping.beta) == (plan.catenary.damping.alpha, 1.5 * plan.catenary.damping.beta)
    masses = variant("masses 2 of the pantograph", 0.1).pantograph.masses
    assert masses == pytest.approx((7.12, 6.6, 5.8))
    assert variant("stiffnesses 1 of the pantograph", -0.1).pantograph.stiffnesses[0] == pytest.approx(8487)
    bare = values.variant(np.zeros(len(values)), 70.0)
    assert (bare.catenary, bare.pantograph, bare.static_force) == (plan.catenary, plan.pantograph, 70.0)
    assert bare.line.tensions == (1.0, 1.0)
    assert not any(each.any() for each in (bare.line.scatter, bare.line.heights, bare.line.waves[:, 0]))


def test_waves_are_those_of_a_line_as_built(plan):
    """One more or less of them would be waves that droppers explain."""
    drawn = draw([LINE_CONDITIONS["as-built"]], np.random.default_rng(0))
    amplitudes, turns, _ = drawn.waves.T
    np.testing.assert_allclose(WAVES, np.stack([1 / turns, amplitudes], axis=1))
    assert everything(plan).variant(np.zeros(len(everything(plan))), 70.0).line.waves.shape == (4, 3)


def test_damping_never_drives_waves_and_none_stays_none(plan):
    values = everything(plan)
    line = values.variant(at(values, "damping beta", -1.5), 70.0).catenary
    assert (line.damping.alpha, line.damping.beta) == (plan.catenary.damping.alpha, 0.0)
    bare = plan.catenary.damping.model_copy(update={"alpha": 0.0})
    undamped = replace(plan, catenary=plan.catenary.model_copy(update={"damping": bare}))
    names = [value.name for value in everything(undamped).all if value.kind == "damping"]
    assert names == ["damping beta"]


def test_a_dropper_that_is_far_too_long_is_called_slack():
    value = Value("droppers", "dropper 4", "mm", 1e3, 5e-3, 130.0, (3,))
    (sentence,) = slack_droppers([Found(value, by, 1e-3) for by in (0.027, 0.015, -0.03)])
    assert "dropper 4 reads +27 mm: it carries nothing, so it is slack, probably broken" in sentence
