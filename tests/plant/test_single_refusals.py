"""What a single wire or a rail has not, and bad data and numerics of one, in words of its own."""

import json
import re

import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.catalog.loader import text_of

from ..command import panto
from .test_single import RAIL, TRAM, changed

OF_LINES = {
    "broken_droppers=[(3, 1)]": "has no droppers, which broken_droppers is about: take",
    "dropper_scatter=0.005": "has no droppers, which dropper_scatter is about: take",
    "raised_supports=[(3, 0.01)]": "has no messenger wire, which raised_supports is about",
    "lost_messenger_tension=0.1": "has no messenger wire, which lost_messenger_tension is about",
    "lost_contact_tension=0.1": "change contact_wire.tension there",
    "temperature=20": "change contact_wire.tension there",
    "ice=0.5": "load of ice, which ice is about: raise contact_wire.mass",
    "side_wind=20": "has no plan seen from above, which side_wind is about",
    "worn_stretches=[(3, 1.0, 5.0, 0.2)]": "has no spots or stretches unlike the rest",
}
WORDS = [
    *(({"line_condition": f"new:{condition}"}, words) for condition, words in OF_LINES.items()),
    ({"speed_kmh": 400.0}, "below the wave speed of the contact wire, 348 km/h on line 'tram-30'"),
    ({"catenary": changed(RAIL, span_length=40.0)}, "would sag by 1.96 m in a span of 40 m"),
    ({"catenary": changed(TRAM, contact_wire__tension=2e3)}, "more tension or bending_stiffness"),
    ({"catenary": "rail-10", "speed_kmh": 1200.0}, "below 1000 km/h on line 'rail-10'"),
    ({"catenary": changed(TRAM, span_lengths=[25.0, 30.0, 35.0, 30.0]), "spans": 9}, "has 4 span_lengths"),
]


@pytest.mark.parametrize(("settings", "words"), WORDS)
def test_what_a_single_wire_has_not_is_refused_in_its_own_words(settings, words):
    given = {"catenary": "tram-30", "pantograph": "own-tram", "speed_kmh": 50.0} | settings
    with pytest.raises(InputError) as refused:
        simulate(given.pop("catenary"), given.pop("pantograph"), **given)
    assert words in str(refused.value)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("numerics", "words"),
    [({"window": 5}, "A window of 5 spans is short"), ({"spacing": 3.0}, "Elements of 3 m are coarser")],
)
def test_a_short_window_and_long_elements_warn(numerics, words):
    with pytest.warns(AccuracyWarning, match=words):
        simulate("tram-30", "own-tram", 50.0, spans=24, distance=60.0, **numerics)


@pytest.mark.parametrize("speed", [0.0, -5.0, float("nan"), float("inf"), 348.5])
def test_a_speed_that_no_train_has_is_refused_without_spans_as_with_them(speed):
    """The number of spans is found before the line is built."""
    for settings in ({}, {"spans": 24}):
        with pytest.raises(InputError, match="The speed must lie above 0 and below the wave speed"):
            simulate("tram-30", "own-tram", speed, **settings)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"droppers": {"positions": [5.0]}}, 'kind "single" has no droppers: leave droppers out'),
        ({"messenger_wire": {"mass": 1.0}}, "has no messenger wire"),
        ({"contact_wire__tension": 0.0, "contact_wire__bending_stiffness": 0.0}, "needs a tension"),
        ({"damping__ratio": 0.01}, "either alpha and beta, or ratio and frequencies"),
        ({"span_lengths": [30.0, 30.0]}, "Give 3 to 1000 span_lengths, not 2"),
        ({"span_lengths": [30.0] * 4, "spans": 5}, "There are 4 span_lengths, but spans is 5"),
    ],
)
def test_data_that_do_not_go_together_are_refused(changes, words):
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        changed(TRAM, **changes)


@pytest.mark.parametrize("missing", ["tension", "droppers"])
def test_a_rail_or_a_tram_given_as_a_flexible_line_is_told_its_kind(tmp_path, missing):
    text = text_of("en50318-2002")
    if missing == "tension":
        text = re.sub(r"\ntension = \{ value = [^,]+", r"\ntension = { value = 1.0", text, count=1)
    else:
        text = re.sub(r"\[droppers\].*?\n\n", "", text, flags=re.DOTALL)
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match='is of kind "single"'):
        load_catenary(tmp_path / "mine.toml")


def test_panto_line_shows_it_at_rest():
    told = panto("line", "rail-10", "--json")
    (span,) = json.loads(told.stdout)["spans"]
    assert span["sag"] == pytest.approx(7.64e-3, rel=2e-3)
    assert span["first_frequency"] == pytest.approx(2.87, rel=2e-3)
    refused = panto("line", "rail-10", "--plot", "rail.png")
    assert "of which only a table at rest is shown; leave out --plot" in " ".join(refused.stderr.split())
