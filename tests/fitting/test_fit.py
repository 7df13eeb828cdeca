"""A fit finds the line of a record, within its intervals, and leaves the sensors' noise."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from panto_env.base.machine import CAN_CHOOSE_CORES, on_cores
from panto_env.fitting.fit import fit
from panto_env.fitting.solve import STEPS
from panto_env.fitting.tables import parts_table, plain, plot_fit
from panto_env.fitting.values import TOLERANCES

from .conftest import BUILT, SEED, record_of
from .test_problem import moved

FEW = ("tensions", "droppers")
"""Values whose fit is quick, and differs by rounding."""
WRONG = 0.15
"""Position error (m): less than the search's grid."""


@pytest.fixture(scope="module")
def steps():
    """Steps that were reported, with what a further one was expected to gain."""
    return []


@pytest.fixture(scope="module")
def fitted(design, pantograph, coarse, steps):
    """Of a line whose tensions and supports alone differ from its design: few values are quick."""
    condition = {"tension_scatter": BUILT.tension_scatter, "support_scatter": BUILT.support_scatter}
    record = moved(record_of(line_condition=condition, seed=SEED), WRONG)
    free = ("tensions", "supports", "damping")
    return fit(
        [record], design, pantograph, free=free, report=lambda state, gain: steps.append((state, gain))
    )


@pytest.mark.slow
def test_tensions_droppers_and_supports_are_found_within_their_intervals(
    record, design, pantograph, coarse, truth
):
    fitted = fit([moved(record, WRONG)], design, pantograph)
    errors, deviations = (
        {
            kind: np.array([measure(each) for each in fitted.of_kind(kind)])
            for kind in ("tensions", "droppers", "supports")
        }
        for measure in (
            lambda each: each.difference - truth.of(each.value),
            lambda each: each.deviation,
        )
    )
    assert np.abs(errors["tensions"]).max() < 5e-3
    assert (deviations["tensions"] < 0.2 * TOLERANCES["tensions"]).all()
    assert len(errors["droppers"]) == 42
    assert np.median(np.abs(errors["droppers"])) < 3e-3
    assert errors["droppers"].std() < 2.5e-3  # of 5 mm that they were drawn with
    assert 0.1 < np.median(deviations["droppers"]) / TOLERANCES["droppers"] < 0.7
    assert len(errors["supports"]) == 5
    assert np.median(np.abs(errors["supports"])) < 6e-3  # hardly told by 4.6 spans
    assert (deviations["supports"] < TOLERANCES["supports"]).all()
    shares = np.concatenate([errors[kind] / deviations[kind] for kind in errors])
    assert np.mean(np.abs(shares) < 1.96) >= 0.8
    assert 0.4 < np.sqrt(np.mean(shares**2)) < 1.7


@pytest.mark.longer
def test_what_is_left_is_the_sensors_noise_and_the_position_error_is_found(fitted):
    """2 N at 500 samples a second are 0.63 N in a coefficient; values take some of it up."""
    ((before, after),) = fitted.std
    assert before > 20
    assert 0.2 < after < 0.7
    (white,) = fitted.whiteness
    assert white.probability > 0.001
    assert 0.3 < np.median(fitted.solution.state.noise) < 0.9  # known from few coefficients
    shift = fitted.sensors["shift"][0] + fitted.problem.shifts[0]
    deviation = np.sqrt(fitted.solution.covariance[-4, -4])
    assert shift == pytest.approx(-WRONG, abs=4 * deviation)
    assert deviation < 0.05


@pytest.mark.longer
def test_it_settles(fitted, steps):
    assert fitted.solution.converged
    assert steps[-1][0].steps == fitted.solution.state.steps < STEPS
    numbers = [state.steps for state, _ in steps]
    more = np.diff(numbers).tolist()
    assert numbers[0] == 0
    assert sorted(more) == [0] + [1] * (len(more) - 1)  # told twice where fine derivatives begin
    assert steps[-1][1] < 1e-2 * steps[0][1]


@pytest.mark.slow
def test_a_wheel_that_reads_too_much_moves_no_tension(record, design, pantograph, truth):
    (piece,) = record.pieces
    worn = replace(record, pieces=(replace(piece, position=1.001 * piece.position),))
    found = fit([worn], design, pantograph)
    assert found.sensors["scale"] == pytest.approx([-0.001], abs=1e-4)
    assert found.problem.parts[0].fine.speed == pytest.approx(record.pieces[0].speed, rel=2e-4)
    for each in found.of_kind("tensions"):
        assert abs(each.difference - truth.of(each.value)) < 2.5 * each.deviation


@pytest.mark.longer
def test_tables_and_picture(fitted):
    told = plain(fitted)
    assert told["settled"] is True
    assert told["records"][0]["left"] == fitted.std[0][1]
    assert len(told["values"]) == len(fitted.found)
    (row,) = parts_table(fitted).rows
    assert row[:2] == ("run", "250.0")
    assert float(row[2]) == pytest.approx(-WRONG, abs=0.1)
    assert abs(float(row[3])) < 0.1
    assert float(row[7]) > 99
    figure = plot_fit(fitted, "A fit")
    force, supports = figure.axes
    assert len(force.lines) == 2 + 5  # and five supports
    assert "support" in supports.get_ylabel()


@pytest.mark.skipif(not CAN_CHOOSE_CORES, reason="a process cannot choose its cores here")
@pytest.mark.slow
def test_a_fit_does_not_depend_on_the_number_of_cores(record, design, pantograph, coarse):
    """Neither shares of the passes nor sums of the linear algebra do: steps would magnify their rounding."""
    with on_cores(1), threadpool_limits(1, "blas"):
        one = fit([record], design, pantograph, free=FEW)
    with threadpool_limits(2, "blas"):
        two = fit([record], design, pantograph, free=FEW)
    np.testing.assert_array_equal(two.solution.state.x, one.solution.state.x)
    np.testing.assert_array_equal(two.solution.covariance, one.solution.covariance)
