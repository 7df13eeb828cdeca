"""Figures leave out the start of a run by default, and say which spans they cover."""

import pytest

from panto_env import InputError, simulate
from panto_env.analysis.sweep import sweep
from panto_env.metrics.figures import FIRST_SETTLED, LAST_USUAL, chosen_spans, in_words
from panto_env.plant.alignment import Alignment
from panto_env.studies.en50318 import lines as start

USUAL = (FIRST_SETTLED, LAST_USUAL)
LINE = Alignment.equal(60.0, 20)


@pytest.mark.parametrize("line", [("en50318-2002", "en50318-2002"), ("periodic-stiffness", "three-mass")])
def test_a_pass_goes_on_until_ten_spans_after_its_start_are_covered(line):
    run = simulate(*line, record_droppers=False)
    assert run.spans() == USUAL == (10, 19)
    assert run.summary() == run.summary(USUAL) != run.summary("all")
    assert run.summary().distance == pytest.approx(10 * run.alignment.mean_length, abs=2 * run.stride)
    assert run.distance == pytest.approx(LAST_USUAL * run.alignment.mean_length, abs=1.0)


def test_what_was_asked_for_is_kept():
    assert simulate(distance=300.0).distance == pytest.approx(300.0, abs=1.0)
    assert simulate(spans=10).distance == pytest.approx(9 * 60.0, abs=1.0)
    assert simulate(distance=2000.0, record_droppers=False).spans() == (10, 33)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [250.0, 300.0])
def test_the_default_is_near_what_a_long_run_comes_to(speed):
    """With the start in it σ is much farther off."""
    (all_spans, default) = start.check_start(speed, (1, FIRST_SETTLED))
    assert default.rms < 1.2  # as docs/validation.md says
    assert default.worst < 2.5
    assert all_spans.rms > 2 * default.rms
    assert (default.first, default.last) == USUAL
    assert default.lines >= 10


def test_a_short_run_has_no_figures_but_of_spans_that_are_named():
    run = simulate(distance=300.0)
    with pytest.raises(InputError, match="ends before its start has died out") as caught:
        run.summary()
    assert "9 spans (540 m)" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert run.summary((2, 5)).std > 0
    assert run.summary("all").distance == pytest.approx(300.0, abs=1.0)
    with pytest.raises(InputError, match="start has died out"):
        sweep({"speed_kmh": [250.0]}, distance=300.0)


def test_choices():
    assert chosen_spans(None, 600.0, LINE) == (10, 10)
    assert chosen_spans(None, 600.0 * (1 - 1e-12), LINE) == (10, 10)
    assert chosen_spans((5, 6), 120.0, LINE) == (5, 6)
    assert chosen_spans("all", 120.0, LINE) is None
    assert (in_words((5, 6)), in_words(None)) == ("5-6", "all")
