"""How both codes share the contact force between the two wires of an overlap; and the judge is judged."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.plant.state import Row

from .figures import figures
from .sections import sections


@pytest.mark.slow
@pytest.mark.parametrize("name", ["overlap-2002", "overlap-330"])
def test_wires_are_touched_at_the_same_places_by_the_same_forces(name):
    section = sections()[name]
    (overlap,) = section.line.overlaps
    seen = []
    run = simulate(
        section.line,
        section.pantograph,
        section.speed_kmh,
        policy="passive",
        distance=section.distance,
        window=0,
        control_interval=0.005,
        watch=lambda task: seen.append([task.plant.of(0, row) for row in ROWS]),
    )
    step, total, second = np.array(seen).T
    x, ours = step * (run.position[1] - run.position[0]), np.stack([total - second, second], axis=1)
    other = section.by_finite_elements()
    theirs = np.stack([np.interp(x, other.position, force) for force in other.wire_forces.T], axis=1)

    places = np.array(
        [[x[np.flatnonzero(each[:, 1])[0]], x[np.flatnonzero(each[:, 0])[-1]]] for each in (ours, theirs)]
    )
    assert places[0] == pytest.approx(places[1], abs=1.0)
    supports, middle = section.line.alignment().supports, overlap.first_span + overlap.spans // 2
    inside = (x > supports[middle - 1]) & (x < supports[middle])
    means = ours[inside].mean(axis=0), theirs[inside].mean(axis=0)
    assert means[0] == pytest.approx(means[1], abs=0.02 * means[1].sum())
    assert min(means[1]) > 0.2 * means[1].sum()


ROWS = Row.STEP, Row.CONTACT_FORCE, Row.SECOND_FORCE


@pytest.mark.study
@pytest.mark.parametrize("name", sections())
def test_half_of_element_and_step_change_the_figures_little(name):
    """Extremes by a share of the mean force: the minimum converges last."""
    section = sections()[name]
    runs = (section.by_finite_elements(share * section.element) for share in (1.0, 0.5))
    coarse, fine = (figures(run, section.spans) for run in runs)
    assert (coarse.std, coarse.mean) == pytest.approx((fine.std, fine.mean), rel=0.005)
    extremes = coarse.maximum, coarse.minimum
    assert extremes == pytest.approx((fine.maximum, fine.minimum), abs=0.012 * fine.mean)
    assert coarse.uplifts_mm == pytest.approx(fine.uplifts_mm, abs=0.25)
