"""Static shape of lines whose spans differ, beside finite elements of the whole line."""

import re

import numpy as np
import pytest
from pydantic import ValidationError

from panto_env import InputError
from panto_env.base.settings import explain
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.as_run import elasticity
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import GRAVITY, dropper_table, droppers_at_rest, hang, solve
from panto_env.plant.catenary.flexible.whole_line import settle_line

from ..finite_element import whole_line as judge
from ..finite_element.sections import line_of
from ..uniform_lines import UNIFORM

SHORT = {
    "span_length": 45.0,
    "encumbrance": 1.2,
    "droppers": {"positions": [4.0, 10.0, 17.0, 28.0, 35.0, 41.0], "sag": [0, 0.02, 0.035, 0.035, 0.02, 0]},
}
MIXED = {
    "span_types": {"long": {}, "short": SHORT, "middle": {"span_length": 54.0, "droppers": {"spacing": 6.0}}},
    "sequence": ["long", "long", "short", "middle", "short", "short", "middle", "long", "long"],
}
"""Spans of three lengths, low supports."""
BRIDGE = {
    "span_types": {
        "open": {},
        "bridge": {"encumbrance": 0.9, "droppers": {"spacing": 5.0, "first": 4.0, "pre_sag": 0.02}},
        "stiff": {"support": {"stiffness": 2e6}, "steady_arm": {"holds_wire": True}},
    },
    "sequence": [
        "open",
        {"type": "open", "contact_height": 0.0},
        {"type": "open", "contact_height": -0.1},
        {"type": "bridge", "contact_height": -0.2, "span_length": 40.0},
        {"type": "bridge", "contact_height": -0.2, "span_length": 42.0},
        {"type": "stiff", "contact_height": -0.2},
        {"type": "open", "contact_height": -0.1},
        "open",
        "open",
    ],
}
"""A bridge: lower supports, the contact wire comes down on a gradient and goes up again."""


def judged(line, element=0.1):
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    wires = line.contact_wire, line.messenger_wire
    return judge.ClosedLine(spans, (heights[-1], encumbrances[-1]), wires, element)


@pytest.mark.parametrize("changes", [MIXED, BRIDGE], ids=["mixed", "bridge"])
@pytest.mark.parametrize("name", ["re250", "benchmark-2015", "en50318-2002"])
def test_agrees_with_finite_elements_of_the_whole_line(name, changes):
    """Heights within 0.5 mm, forces within 1 N; and droppers of these lengths hold the wires so."""
    line = line_of(name, changes)
    shape, closed = solve(line), judged(line)
    as_built = judge.built(closed, shape.dropper_length, shape.dropper_stiffness)
    for other in (judge.designed(closed), as_built):
        np.testing.assert_allclose(shape.contact.height(other.x), other.contact, atol=5e-4)
        np.testing.assert_allclose(shape.messenger.height(other.x), other.messenger, atol=5e-4)
        np.testing.assert_allclose(shape.dropper_tension, other.dropper_tension, atol=1.0)
        loaded = shape.dropper_length + shape.dropper_tension / shape.dropper_stiffness
        np.testing.assert_allclose(loaded, other.dropper_length, atol=5e-4)


@pytest.mark.parametrize("changes", [MIXED, BRIDGE], ids=["mixed", "bridge"])
@pytest.mark.parametrize("name", ["re250", "benchmark-2015", "en50318-2002"])
def test_supports_carry_the_weight_of_everything(name, changes):
    """Messenger's supports, and steady arms that hold the contact wire, with half of it at the ends."""
    line = line_of(name, changes)
    shape, layout = solve(line), line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    supports = np.array(line.alignment().supports)
    wires = (line.contact_wire.mass + line.messenger_wire.mass) * supports[-1]
    clamps = sum(
        len(s.droppers.sag) * (s.droppers.contact_clamp_mass + s.droppers.messenger_clamp_mass) for s in spans
    )
    stiffness = np.array([s.support.stiffness for s in (*spans, spans[-1])])
    stiffness[[0, -1]] /= 2
    tops = np.array(heights) + encumbrances
    carried = (stiffness * (tops - shape.messenger.height(supports))).sum() + shape.arm_force.sum()
    # The ends pull along the outermost gradients, which are level here but for changes of the encumbrance.
    slope = np.diff(tops) / np.diff(supports)
    carried += line.messenger_wire.tension * (slope[-1] - slope[0])
    assert carried == pytest.approx(GRAVITY * (wires + clamps + shape.dropper_mass.sum()), rel=1e-6)


@pytest.mark.parametrize("name", UNIFORM)
def test_equal_spans_of_a_whole_line_are_the_span_that_repeats(name):
    line = load_catenary(name).model_copy(update={"spans": 6})
    whole, one = settle_line(line), solve(line)
    x = np.linspace(0, line.span_length, 301)
    for span in range(6):
        begin = span * line.span_length
        np.testing.assert_allclose(whole.contact.height(begin + x), one.contact.height(x), atol=1e-9)
        np.testing.assert_allclose(whole.messenger.height(begin + x), one.messenger.height(x), atol=1e-9)
    np.testing.assert_allclose(whole.dropper_tension, np.tile(one.dropper_tension, 6), atol=1e-6)
    np.testing.assert_allclose(whole.dropper_length, np.tile(one.dropper_length, 6), atol=1e-9)


def test_a_gradient_from_end_to_end_is_the_level_line_tilted():
    """Wires are nearly level: a tilt changes no force. The ends go on at the gradient."""
    heights = [0.05 * k for k in range(6)]
    sequence = [{"contact_height": height} for height in heights]
    tilted = line_of("re250", {"sequence": sequence, "end_support": {"contact_height": 0.3}})
    level = load_catenary("re250")
    shape, one = hang(tilted), solve(level)
    x = np.linspace(0, 6 * 65.0, 2001)
    rise = 0.05 / 65.0 * x
    np.testing.assert_allclose(shape.contact.height(x) - rise, one.contact.height(x), atol=1e-9)
    np.testing.assert_allclose(shape.dropper_tension, np.tile(one.dropper_tension, 6), atol=1e-6)


@pytest.mark.parametrize(
    ("sequence", "message"),
    [
        (
            ["a", {"type": "a", "droppers": {"sag": [0, 0, 0, 0.15, 0, 0, 0]}}, "a"],
            r"At rest dropper [45] of span 2 of line '.*', at 32.5 m, would carry -\d.* N, and a dropper can",
        ),
        (
            ["a", "a", {"encumbrance": 0.3}, {"encumbrance": 0.3}, "a"],
            r"ropper \d of span 3 of line",
        ),
        (
            [
                "a",
                "a",
                {"type": "a", "contact_height": 1.0, "span_length": 9.0, "droppers": {"spacing": 3.0}},
            ],
            r"At rest dropper 2 of span 3 of line 're250', at 4.5 m, would carry -109",
        ),
        (
            ["a", "a", {"type": "a", "support": {"stiffness": 2e3}}, "a"],
            r"At rest the messenger's support 3 of line 're250' would yield by 0\.\d+ m, more than 0\.3 m",
        ),
        (
            ["a", "a", {"type": "a", "support": {"stiffness": 1e3}}],
            r"At rest the messenger's support [34] of line 're250' would yield by",
        ),
        (
            ["a", {"type": "a", "droppers": {"stiffness": 300.0}}, "a"],
            r"At rest dropper 1 of span 2 of line 're250', at 5 m, would be stretched by 0\.\d+ m, \d+ % of",
        ),
    ],
)
def test_a_line_that_cannot_hang_so_is_refused_with_span_and_dropper(sequence, message):
    line = line_of("re250", {"span_types": {"a": {}}, "sequence": sequence})
    with pytest.raises(InputError, match=message) as caught:
        hang(line)
    assert str(caught.value).count(". ") == 0


@pytest.mark.parametrize("changes", [MIXED, BRIDGE], ids=["mixed", "bridge"])
def test_elasticity_along_the_line_is_that_of_finite_elements(changes):
    """Of a force so small that every dropper stays taut."""
    line = line_of("re250", changes)
    if changes is BRIDGE:  # an arm that holds the wire at rest is no support of it in motion
        types = BRIDGE["span_types"] | {"stiff": {"support": {"stiffness": 2e6}}}
        line = line_of("re250", BRIDGE | {"span_types": types})
    places, yields = elasticity(line, 5.0)
    supports = np.array(line.alignment().supports)
    assert places[0] == supports[1]
    assert places[-1] == supports[-2]
    shape, closed = solve(line), judged(line, 0.2)
    droppers = shape.dropper_length, shape.dropper_stiffness
    rest = judge.built(closed, *droppers)
    for k in range(100, len(places) - 100, 37):
        node = int(np.abs(rest.x - places[k]).argmin())
        lifted = judge.built(closed, *droppers, pushed=(node, 5.0))
        assert lifted.dropper_tension.min() > 0
        theirs = (lifted.contact[node] - rest.contact[node]) / 5.0
        assert np.interp(rest.x[node], places, yields) == pytest.approx(theirs, rel=0.01)


def test_the_dropper_table_names_every_dropper_of_every_span():
    line = line_of("re250", MIXED)
    table, shape = droppers_at_rest(line), solve(line)
    spans = line.layout().spans
    assert [(each.span, each.number) for each in table] == [
        (k, n) for k, span in enumerate(spans, 1) for n in range(1, len(span.droppers.sag) + 1)
    ]
    assert [each.position for each in table] == [x for span in spans for x in span.droppers.positions]
    assert [each.static_force for each in table] == shape.dropper_tension.tolist()
    assert [each.length for each in table] == shape.dropper_length.tolist()
    printed = dropper_table(table)
    assert printed.headings[:2] == ("span", "dropper")
    assert [row[0] for row in printed.rows] == [str(each.span) for each in table]
    uniform = droppers_at_rest(load_catenary("re250"))
    assert dropper_table(uniform).headings[0] == "dropper"
    assert [each.length for each in uniform] == solve(load_catenary("re250")).dropper_length.tolist()


def random_sequence(random):
    """Spans of any length, height and dropper table, few of which repeat."""

    def span():
        length = float(random.uniform(25.0, 75.0))
        first = float(random.uniform(2.0, 6.0))
        inner = np.sort(random.uniform(first + 2, length - first - 2, int(random.integers(2, 8))))
        table = {
            "positions": [first, *inner.tolist(), length - first],
            "pre_sag": float(random.uniform(0, 0.05)),
        }
        rule = {"spacing": float(random.uniform(4, 9)), "pre_sag": float(random.uniform(-0.02, 0.06))}
        return {
            "span_length": length,
            "encumbrance": float(random.uniform(0.9, 2.0)),
            "contact_height": float(random.uniform(-0.05, 0.05)),
            "droppers": table if random.random() < 0.3 else rule,
            "support": {"stiffness": float(10 ** random.uniform(4.5, 7))},
            "steady_arm": {"holds_wire": bool(random.random() < 0.3)},
        }

    spans = [span() for _ in range(int(random.integers(3, 8)))]
    # Its own mirror image, which the judge adds, is level at both ends.
    for near, outer in ((1, 0), (-2, -1)):
        spans[outer] |= {key: spans[near][key] for key in ("contact_height", "encumbrance")}
    return {"sequence": spans}


def test_any_sequence_is_refused_in_one_sentence_or_hangs_as_finite_elements_do():
    hung, messages = 0, []
    for seed in range(60):
        random = np.random.default_rng(seed)
        name = str(random.choice(["re250", "benchmark-2015", "ln2"]))
        try:
            line = line_of(name, random_sequence(random))
            shape = hang(line)
        except ValidationError as error:
            messages.append(explain(error, FlexibleCatenaryData))
            continue
        except InputError as error:
            messages.append(str(error))
            continue
        hung += 1
        other = judge.designed(judged(line, 0.1))
        np.testing.assert_allclose(shape.contact.height(other.x), other.contact, atol=5e-4)
        np.testing.assert_allclose(shape.messenger.height(other.x), other.messenger, atol=5e-4)
        np.testing.assert_allclose(shape.dropper_tension, other.dropper_tension, atol=1.0)
    assert hung >= 10
    assert len(messages) >= 10
    assert not [each for each in messages if re.search(r"[.?!]\s|\n", each)]
