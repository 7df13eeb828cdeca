"""Figures span by span, and droppers one by one, where spans differ."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary
from panto_env.metrics.by_span import by_span
from panto_env.metrics.droppers import moving_droppers
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import droppers, of_spans
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.dropper_table import droppers_at_rest

LENGTHS = (50, 60, 55, 65, 45, 62, 50, 65, 60, 40, 60, 55, 64)


@pytest.fixture(scope="module")
def run():
    line = load_catenary("en50318-2002").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    spans = [{"span_length": length} for length in LENGTHS]
    return simulate(
        FlexibleCatenaryData.model_validate(line | {"sequence": spans}), "en50318-2002", 250, accuracy="fast"
    )


def test_each_span_has_its_own_figures(run):
    supports = np.append(0.0, np.cumsum(LENGTHS))
    force = low_pass(run.contact_force, run.time_step)
    found = by_span(run, (3, 12))
    assert [each.span for each in found] == list(range(3, 13))
    for each in found:
        begin, end = supports[each.span - 1], supports[each.span]
        own = force[(run.position >= begin) & (run.position < end)]
        assert (each.begin, each.length) == (begin, pytest.approx(end - begin))
        assert (each.mean, each.std, each.max, each.min) == (own.mean(), own.std(), own.max(), own.min())
        at = np.abs(run.support_position - begin).argmin()
        assert each.uplift == run.uplift[:, at].max() > 0.02
    assert [each.span for each in by_span(run, "all")] == list(range(1, 13))
    assert np.isnan(by_span(run, (1, 1))[0].uplift)  # an anchor
    assert max(each.max for each in by_span(run)) == run.summary().max


def test_each_dropper_has_a_row_with_what_it_is_at_rest(run):
    line = FlexibleCatenaryData.model_validate(run.design["catenary"])
    resting = {(each.span, each.number): each for each in droppers_at_rest(line)}
    found = moving_droppers(run, (3, 12))
    assert len(found) == sum(3 <= span <= 12 for span, _ in resting)
    sheet, inside = droppers([run], (3, 12)), run.inside((3, 12))
    rows = [dict(zip(sheet.columns, row, strict=True)) for row in zip(*sheet.columns.values(), strict=True)]
    for each, row in zip(found, rows, strict=True):
        rest = resting[row["span"], row["number"]]
        assert (rest.position, rest.length) == (pytest.approx(row["position"]), row["length"])
        place = sum(LENGTHS[: row["span"] - 1]) + row["position"]
        column = np.abs(run.dropper_position - place).argmin()
        assert each.largest == row["largest"] == run.dropper_force[inside, column].max()
        assert each.largest > rest.static_force
    assert len({row["length"] for row in rows}) > 20  # they are not those of one span


def test_the_table_by_spans_names_its_units(run):
    sheet = of_spans(run, (3, 4))
    assert list(sheet.columns["span"]) == [3, 4]
    assert sheet.headings["uplift"] == "maximum uplift at its first support (m)"
