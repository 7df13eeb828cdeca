"""Figures of overlaps, behind them and elsewhere."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary
from panto_env.metrics.by_span import by_stretch
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import of_stretches


@pytest.fixture(scope="module")
def run():
    return simulate("sweden-st15-bridge", "dsa250", 160, accuracy="fast")


def test_figures_of_overlaps_and_behind_them_are_those_of_their_places(run):
    line = load_catenary("sweden-st15-bridge")
    supports, (first, last) = np.array(line.alignment().supports), run.spans()
    limits = [(supports[each.first_span - 1], supports[each.first_span + 2]) for each in line.overlaps]
    found = by_stretch(run)
    assert [each.stretch for each in found] == ["overlaps", "up to 200 m behind an overlap", "elsewhere"]
    force, x = low_pass(run.contact_force, run.time_step), run.position
    evaluated = (x >= supports[first - 1]) & (x < supports[last])
    overlaps = sum((x >= begin) & (x < end) for begin, end in limits).astype(bool)
    behind = sum((x >= end) & (x < end + 200) for _, end in limits).astype(bool)
    for each, there in zip(found, (overlaps, behind, ~overlaps & ~behind), strict=True):
        own = force[there & evaluated]
        assert (each.mean, each.std, each.max, each.min) == (own.mean(), own.std(), own.max(), own.min())
    whole = run.summary()
    assert sum(each.distance for each in found) == pytest.approx(whole.distance, abs=1.0)
    weights = [each.distance for each in found]
    assert np.average([each.mean for each in found], weights=weights) == pytest.approx(whole.mean, rel=1e-4)
    table = of_stretches(run)
    assert table.columns["stretch"] == [each.stretch for each in found]
    assert table.titles[table.titles.index("where") + 1] == "distance (m)"


def test_a_run_without_overlaps_has_no_such_figures(run):
    assert by_stretch(run, (10, 12)) == []
    assert by_stretch(simulate("re250", "dsa250", 200, accuracy="fast")) == []
