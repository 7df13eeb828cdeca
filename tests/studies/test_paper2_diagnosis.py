"""The study of what diagnosis finds: its counting on made-up cases. Its bars are in ``test_paper2``."""

import numpy as np
import pytest

from panto_env.diagnosis.features import BROKEN, TENSION
from panto_env.diagnosis.training import (
    LINES,
    PANTOGRAPH,
    SEEDS,
    SEVERITIES,
    SPEEDS_KMH,
    Track,
    draw_defect,
    every_defect,
)
from panto_env.plant.line_condition import LineCondition
from panto_env.studies.paper2 import diagnosis as study

TRACK = Track("en50318-2002", "dsa250", 220.0, seed=21)


def case(kind="", severity=0.0, detected=False, others=0, passes=1, located=None):
    located = detected if located is None else located
    return study.Case(TRACK, kind, severity, passes, 0.1, detected, located, 1.0, kind, others, 2.0)


def test_what_is_judged_was_not_trained_on():
    assert not set(study.SPEEDS_KMH) & set(SPEEDS_KMH)
    tracks = study.tracks()
    assert len({track.seed for track in tracks} - set(SEEDS)) == len(tracks)
    assert study.PANTOGRAPH != PANTOGRAPH
    assert len(set(study.LINES) - set(LINES)) == 2


def test_shares_have_wilson_s_interval():
    """Of 8 in 10: (0.490, 0.943), in every table of them."""
    cases = [case(BROKEN, 1.0, k < 8) for k in range(10)]
    assert study.share(cases, detected=True) == pytest.approx((0.8, 0.490, 0.943), abs=1e-3)
    assert np.isnan(study.share([], detected=True)[0])


def test_false_alarms_are_those_of_healthy_lines_alone():
    cases = [case(others=1), *[case()] * 9, case(BROKEN, 1.0, True, others=5), case(TENSION, 0.1, others=7)]
    rate, bound = study.alarms_per_10_km(cases)
    assert rate == pytest.approx(0.5)  # one in 20 km
    assert bound == pytest.approx(4.744 / 2, rel=1e-3)  # Poisson: one seen, 4.744 at most
    assert study.elsewhere_per_10_km(cases) == pytest.approx(25.0)


def test_smallest_severity_needs_all_worse_ones():
    small, middle, large = SEVERITIES["dropper too long"]
    cases = [case("dropper too long", size, size != middle) for size in (small, middle, large)]
    assert study.smallest(cases, "dropper too long", 1) == large


def test_tables_and_curves_hold_every_case():
    sizes = [("", 0.0), *((kind, size) for kind, several in SEVERITIES.items() for size in several)]
    cases = [case(*each, bool(each[0]), passes=count) for each in sizes for count in study.MEANS]
    table = study.severity_table(cases)
    assert [row[2] for row in table.rows] == ["100"] * sum(map(len, SEVERITIES.values()))
    confusion = study.confusion_table(cases, 1)
    assert [row[1 + k] for k, row in enumerate(confusion.rows)] == ["100"] * len(SEVERITIES)
    assert study.broken_table(cases).rows[-1][2:6] == ("1", "100.0", "100.0", "21–100")
    assert len(study.rate_rows(cases)) == len(study.MEANS) * len(study.RATES)


def test_outer_droppers_are_those_next_to_a_support():
    outer = [study.is_outer(TRACK, 12 * 60 + x) for x in TRACK.data.droppers.positions]
    assert outer == [True, *[False] * 7, True]
    assert not study.is_outer(TRACK, 12 * 60)


def test_a_defect_is_drawn_where_it_says_it_is():
    random = np.random.default_rng(0)
    for defect in every_defect(TRACK, random, 3):
        condition = LineCondition(**defect.condition)
        assert condition.defective
        if condition.broken_droppers:
            ((span, number),) = condition.broken_droppers
            at = (span - 1) * 60 + TRACK.data.droppers.positions[number - 1]
            assert defect.position == pytest.approx(at)
    spot = draw_defect(TRACK, "hard spot", 2.0, 14, random)
    assert 13 * 60 <= spot.position <= 14 * 60
