"""Defects that the classifier learns from, and which of what they show is right or wrong."""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.diagnosis import training
from panto_env.diagnosis.features import BROKEN, KINDS, LONG, OF_SORT, SHORT, TENSION, WORN, Sort
from panto_env.diagnosis.training import (
    BEYOND,
    FIRST,
    SEVERITIES,
    SPANS,
    Defect,
    Track,
    draw_defect,
    every_defect,
)
from panto_env.plant.line_condition import LineCondition

TRACK = Track("en50318-2002", "dsa380", 200.0, 1, 0.0)
MOST = {SHORT: 0.02, LONG: 0.01, WORN: 0.3, TENSION: 0.2, "hard spot": 10.0}


@pytest.mark.parametrize("kind", SEVERITIES)
def test_severities_rise_by_little_and_each_can_be_simulated(kind):
    each = SEVERITIES[kind]
    steps = np.array(each[1:]) / np.array(each[:-1])
    assert ((steps > 1.0) & (steps <= 2.5)).all()
    assert each[-1] <= MOST.get(kind, 1.0 if kind == BROKEN else 0.1 if each[-1] < 1 else 10.0)
    for severity in each:
        for span in (FIRST, BEYOND - 1):
            made = draw_defect(TRACK, kind, severity, span, np.random.default_rng(0))
            assert (made.kind, made.severity) == (kind, severity)
            LineCondition(**made.condition)
            begin, end = (TRACK.data.alignment().support(each) for each in (span - 1, span))
            assert np.isnan(made.position) if kind == TENSION else begin <= made.position <= end + 10.0


@pytest.mark.parametrize(("given", "broken"), [((), 1), ((1,), 1), ((8,), 8)])
def test_there_is_one_of_each_severity_and_as_many_broken_droppers_as_wanted(given, broken):
    defects = every_defect(TRACK, np.random.default_rng(0), *given)
    assert sum(defect.kind == BROKEN for defect in defects) == broken
    others = [(defect.kind, defect.severity) for defect in defects if defect.kind != BROKEN]
    assert others == [
        (kind, each) for kind, several in SEVERITIES.items() if kind != BROKEN for each in several
    ]
    assert FIRST < BEYOND < SPANS


def test_only_what_a_defect_of_a_known_kind_shows_where_it_is_is_learnt(monkeypatch):
    """Regions within three quarters of a span of the defect, of passes that reached their end."""
    defects = [
        Defect("hail", 1.0, {}, 100.0),  # of no kind that is learnt
        Defect(KINDS[0], 1.0, {}, 100.0),
        Defect(KINDS[1], 1.0, {}, 300.0),
        Defect(KINDS[0], 1.0, {}, 100.0),  # its pass ended early
        Defect(TENSION, 0.1, {}, float("nan")),  # everywhere
    ]
    runs, healthy, learnt = [], [], []

    def drive(track, number, defects=()):
        run = SimpleNamespace(terminated=len(runs) == 3, number=number)
        (runs if defects else healthy).append(run)
        return run

    positions = np.array([100.0, 144.9, 145.0, 55.1, 55.0, 300.0])
    evidence = SimpleNamespace(position=positions, alignment=SimpleNamespace(length_at=lambda x: 60.0))
    model = SimpleNamespace(scores=None, weigh=lambda passes, level: (evidence, None))

    def learn(evidence, region, defect):
        learnt.append((defect.kind, region.peak))
        return np.ones((1, 2)), np.array([1])

    def side_by_side(runs, healthy, seed):
        assert (len(runs), len(healthy), seed) == (4, training.HEALTHY, TRACK.seed)
        return SimpleNamespace(per_span=1, span=1, only=lambda k: k), None

    monkeypatch.setattr(training, "every_defect", lambda *_: defects)
    monkeypatch.setattr(training, "drive", drive)
    monkeypatch.setattr(training, "side_by_side", side_by_side)
    monkeypatch.setattr(training, "Healthy", SimpleNamespace(of=lambda reference: model))
    monkeypatch.setattr(training, "threshold", lambda *_: 1.0)
    monkeypatch.setattr(
        training, "regions", lambda _: [SimpleNamespace(peak=k) for k in range(len(positions))]
    )
    monkeypatch.setattr(training, "_learn_from", learn)
    shown, classes = training.examples(TRACK)
    assert learnt == [(KINDS[0], 0), (KINDS[0], 1), (KINDS[0], 3), (KINDS[1], 5)]
    assert shown.shape == (4, 2)
    assert classes.tolist() == [1, 1, 1, 1]
    assert [run.number for run in healthy] == list(range(training.HEALTHY))
    assert [run.number for run in runs] == [training.HEALTHY + k for k in range(5)]


@pytest.mark.parametrize("kind", [BROKEN, WORN])
def test_a_candidate_is_right_near_the_defect_and_neither_where_only_its_sort_is_wrong(monkeypatch, kind):
    (sort,) = [sort for sort in Sort if kind in OF_SORT[sort]][:1]
    other = next(each for each in Sort if kind not in OF_SORT[each])
    near = training.NEAR[sort] * (2 if kind == WORN else 1)
    aparts = [(sort, 0.0), (sort, 0.99 * near), (sort, -0.99 * near), (sort, 1.01 * near)]
    aparts += [(other, 0.0), (other, 1.99), (other, 2.0), (other, -2.5)]
    places = [SimpleNamespace(sort=each, position=100.0 + apart) for each, apart in aparts]
    monkeypatch.setattr(training, "candidates", lambda evidence, region: places)
    monkeypatch.setattr(training, "features", lambda evidence, region, kept: kept)
    kept, classes = training._learn_from(None, None, Defect(kind, 1.0, {}, 100.0))
    assert kept == [*places[:4], *places[6:]]
    own = KINDS.index(kind) + 1
    assert classes.tolist() == [own, own, own, 0, 0, 0]
