"""By how much a required mean force is higher where the speed drifts, of a made-up run."""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.control.mean_force import target_mean
from panto_env.control.settings import run_settings
from panto_env.control.task import _required_more
from panto_env.metrics.compliance import largest_mean

SPEEDS = np.array([50.0, 60.0, 70.0, 80.0])
INSIDE = np.array([False, True, True, False])


def made_up(**changes):
    run = {"speed": 55.0, "drifts": True, "speeds": SPEEDS, "inside": lambda spans: INSIDE}
    return SimpleNamespace(**run | changes)


def test_it_is_the_mean_over_the_spans_of_what_each_speed_requires():
    settings = run_settings({"mean_force": "en50367"})
    required = [target_mean(settings, speed) for speed in (60.0, 70.0)]
    expected = np.mean(required) - target_mean(settings, 55.0)
    assert expected > 1.0
    assert _required_more(settings, made_up(), None) == pytest.approx(expected)
    of_standard = largest_mean(60.0, "AC") - largest_mean(55.0, "AC")
    assert target_mean(settings, 60.0) - target_mean(settings, 55.0) == pytest.approx(of_standard)


def test_it_is_nothing_at_one_speed_or_where_a_number_or_nothing_is_required():
    for given in ({"mean_force": "en50367"}, {"mean_force": 60.0}, {}):
        settings = run_settings(given)
        assert _required_more(settings, made_up(drifts=False), None) == 0.0
        if given.get("mean_force") != "en50367":
            assert _required_more(settings, made_up(), None) == 0.0
