"""Figures' table of made-up runs: which have a row, what stands in it, and the speed that limits go by."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env import InputError
from panto_env.metrics import compliance as en50367
from panto_env.metrics.compliance import Criterion
from panto_env.metrics.run_tables import _figure, _with_figures

from .test_summary import RUN

ENDED = replace(RUN, terminated=True, ending="It ended.")


def test_runs_that_ended_early_are_left_out_unless_spans_are_named_or_all_did():
    assert _with_figures([RUN, ENDED], None) == [RUN]
    assert _with_figures([RUN, ENDED], (1, 2)) == [RUN, ENDED]
    assert _with_figures([RUN, ENDED], "all") == [RUN, ENDED]
    assert _with_figures([ENDED, ENDED], None) == [ENDED, ENDED]
    with pytest.raises(InputError):
        ENDED.summary()


def test_a_row_has_the_limits_of_its_criterion_or_none():
    whole = Criterion("a", "one", "N", 2.0, 1.0, 2.5, "a standard", "a note")
    row = {"key": "a", "figure": "one", "value": 2.0, "unit": "N"}
    assert _figure("a", "one", "N", 2.0, whole) == row | {
        "lowest": 1.0,
        "highest": 2.5,
        "margin": 0.5,
        "verdict": "kept",
        "source": "a standard",
        "note": "a note",
    }
    bare = {"lowest": None, "highest": None, "margin": None, "verdict": "", "source": "", "note": ""}
    assert _figure("a", "one", "N", 2.0, None) == row | bare
    broken = _figure("a", "one", "N", 2.0, replace(whole, highest=1.5, source="", note=""))
    assert (broken["verdict"], broken["source"], broken["note"]) == ("broken", "", "")
    unknown = _figure("a", "one", "N", 2.0, replace(whole, value=float("nan")))
    assert unknown["verdict"] == "not judged"


def test_limits_are_those_of_the_mean_speed_over_the_spans():
    """A train that speeds up from 40 m/s by 20 m/s in the 0.4 s of the run."""
    speeding = replace(
        RUN, position=40 * RUN.time + 25 * RUN.time**2, settings={"speed_drift": 5.0}, speed=50.0
    )
    assert speeding.drifts
    inside = speeding.inside((1, 1))
    mean = 40 + 50 * speeding.time[inside].mean()
    limits = {each.key: each for each in speeding.compliance((1, 1))}
    assert limits["mean"].highest == pytest.approx(en50367.largest_mean(float(mean), "AC"))
    steady = {each.key: each for each in RUN.compliance((1, 1))}
    assert steady["mean"].highest == pytest.approx(en50367.largest_mean(50.0, "AC"))
    assert steady["mean"].highest - limits["mean"].highest > 1.0
    assert np.ptp(speeding.speeds) == pytest.approx(50 * 0.39)
