"""Static shape of lines whose spans differ, beside finite elements of the whole line."""

import re

import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.as_run import elasticity
from panto_env.plant.catenary.flexible.static import hang, solve
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


def judged(line, element=0.1):
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    wires = line.contact_wire, line.messenger_wire
    return judge.ClosedLine(spans, (heights[-1], encumbrances[-1]), wires, element)


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


HIGH = {"type": "a", "contact_height": 1.0, "span_length": 9.0, "droppers": {"spacing": 3.0}}


@pytest.mark.parametrize(
    ("spans", "message"),
    [
        (
            ["a", {"type": "a", "droppers": {"sag": [0, 0, 0, 0.15, 0, 0, 0]}}, "a"],
            r"dropper [45] of span 2 of line '.*', at 32.5 m, would carry -\d.* N, and a dropper can",
        ),
        (["a", "a", {"encumbrance": 0.3}, {"encumbrance": 0.3}, "a"], r"ropper \d of span 3 of line"),
        (["a", "a", HIGH], r"At rest dropper 2 of span 3 of line 're250', at 4.5 m, would carry -109"),
        (
            ["a", "a", {"type": "a", "support": {"stiffness": 2e3}}, "a"],
            r"At rest the messenger's support 3 of line 're250' would yield by 0\.\d+ m, more than 0\.3 m",
        ),
        (
            ["a", "a", {"type": "a", "support": {"stiffness": 1e3}}],
            r"support [34] of line 're250' would yield",
        ),
        (
            ["a", {"type": "a", "droppers": {"stiffness": 300.0}}, "a"],
            r"At rest dropper 1 of span 2 of line 're250', at 5 m, would be stretched by 0\.\d+ m, \d+ % of",
        ),
    ],
)
def test_a_line_that_cannot_hang_so_is_refused_with_span_and_dropper(spans, message):
    line = line_of("re250", {"span_types": {"a": {}}, "sequence": spans})
    with pytest.raises(InputError, match=message) as caught:
        hang(line)
    assert str(caught.value).count(". ") == 0


def test_elasticity_along_the_line_is_that_of_finite_elements():
    """Of a force so small that every dropper stays taut; with steady arms."""
    line = line_of("re250", MIXED)
    places, yields = elasticity(line, 5.0)
    supports = np.array(line.alignment().supports)
    assert places[0] == supports[1]
    assert places[-1] == supports[-2]
    shape, closed = solve(line), judged(line, 0.2)
    droppers = shape.dropper_length, shape.dropper_stiffness
    rest = judge.built(closed, *droppers)
    for k in range(100, len(places) - 100, 61):
        node = int(np.abs(rest.x - places[k]).argmin())
        lifted = judge.built(closed, *droppers, pushed=(node, 5.0), at_arms=rest.contact[closed.masts])
        assert lifted.dropper_tension.min() > 0
        theirs = (lifted.contact[node] - rest.contact[node]) / 5.0
        assert np.interp(rest.x[node], places, yields) == pytest.approx(theirs, rel=0.01)


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


@pytest.mark.longer
def test_any_sequence_is_refused_in_one_sentence_or_hangs_as_finite_elements_do():
    hung, messages = 0, []
    for seed in range(30):
        random = np.random.default_rng(seed)
        name = str(random.choice(["re250", "benchmark-2015", "ln2"]))
        try:
            line = line_of(name, random_sequence(random))
            shape = hang(line)
        except InputError as error:
            messages.append(str(error))
            continue
        hung += 1
        other = judge.designed(judged(line, 0.1))
        np.testing.assert_allclose(shape.contact.height(other.x), other.contact, atol=5e-4)
        np.testing.assert_allclose(shape.messenger.height(other.x), other.messenger, atol=5e-4)
        np.testing.assert_allclose(shape.dropper_tension, other.dropper_tension, atol=1.0)
    assert hung >= 10
    assert len(messages) >= 5
    assert not [each for each in messages if re.search(r"[.?!]\s|\n", each)]
