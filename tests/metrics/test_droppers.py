"""Forces in droppers over a run: wherever the train is, and which droppers count."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.metrics.by_span import moving_droppers
from panto_env.report.findings import Findings

from .test_compliance import by_key
from .test_summary import RUN, SPAN, replace


def with_droppers(forces):
    """The run made up by hand, of four spans, with a dropper in the middle of each and their forces."""
    position = SPAN * np.array([0.5, 1.5, 2.5, 3.5])
    return replace(RUN, dropper_force=forces, dropper_position=position)


def made_up():
    forces = np.full((40, 4), 50.0)
    forces[12:14, 2] = 90.0  # ahead of the train, which is in span 2
    forces[22:27, 1] = 0.0  # behind the train, which is in span 3
    forces[15, 1] = 0.0  # while the train is there
    forces[15, 0], forces[15, 3] = 500.0, 400.0  # in spans that are not evaluated
    forces[5, 1], forces[35, 2] = 300.0, 300.0  # before and after the evaluated run
    return with_droppers(forces)


def test_forces_are_those_of_the_evaluated_spans_over_the_whole_evaluated_run():
    (found,) = moving_droppers(made_up(), (2, 3))
    assert found.position == pytest.approx(SPAN / 2)
    assert (found.largest, found.smallest) == (90.0, 0.0)
    assert found.slack == pytest.approx(100 * 1 / 20)
    (whole,) = moving_droppers(made_up(), "all")
    assert whole.largest == 500.0


def test_the_requirements_show_the_same_maximum_as_the_table():
    found = by_key(made_up().compliance((2, 3)))
    assert found["dropper force"].value == 90.0
    assert found["slack"].value == pytest.approx(100 * 1 / 20)


def test_the_report_shows_the_maximum_of_a_real_run():
    """Of droppers beside a support it is reached while the train is in a span beside theirs."""
    run = simulate("re250", "dsa250", 200.0)
    largest = max(each.largest for each in Findings(run, "run.parquet").droppers)
    assert largest == by_key(run.compliance())["dropper force"].value
    train, own = run.alignment.span_of(run.position), run.alignment.span_of(run.dropper_position)
    evaluated = run.dropper_force[run.inside()]
    near = (train[:, None] == own)[run.inside()]
    assert largest == evaluated[:, (own >= 10) & (own <= 19)].max()
    assert largest > 1.1 * evaluated[near].max(), "the run does not show the difference"
