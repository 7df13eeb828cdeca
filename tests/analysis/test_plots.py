"""Plots draw the filtered force in its place, with supports and limits, and say what they leave out."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from panto_env import simulate
from panto_env.analysis.plots import plot_forces, plot_run, say_what_is_hidden
from panto_env.metrics.low_pass import low_pass, zero_phase_low_pass


def lag(first, second):
    """By how many samples the second series is behind the first."""
    first, second = first - first.mean(), second - second.mean()
    correlation = np.correlate(second, first, "full")
    return int(np.argmax(correlation)) - (len(first) - 1)


@pytest.fixture(scope="module")
def run():
    return simulate("periodic-stiffness", "three-mass", 300.0, "p")


def curve(axis, label):
    (line,) = [line for line in axis.lines if line.get_label() == label]
    return line


def test_the_filter_of_pictures_attenuates_as_much_and_does_not_delay(reference_run):
    force, step = reference_run.contact_force, reference_run.time_step
    late, in_place = low_pass(force, step), zero_phase_low_pass(force, step)
    inside = reference_run.inside()
    assert in_place[inside].std() == pytest.approx(late[inside].std(), rel=0.01)
    for count in (1, 2, 50, 1000):  # it takes any length, and keeps what is constant
        assert zero_phase_low_pass(np.full(count, 120.0), 2e-3) == pytest.approx(120.0)
    assert in_place[inside].mean() == pytest.approx(late[inside].mean(), rel=0.001)
    assert lag(force[inside], in_place[inside]) == 0
    assert lag(force[inside], late[inside]) * step == pytest.approx(0.031, abs=0.006)


def test_a_run_s_plot_shows_the_evaluated_spans_their_supports_and_limits(run):
    figure = plot_run(run)
    contact, height, actuator = figure.axes
    assert {axis.get_xlim() for axis in figure.axes} == {(450.0, 950.0)}
    drawn = curve(contact, "low-passed at 20 Hz, not delayed")
    inside = run.inside()
    np.testing.assert_array_equal(drawn.get_xdata(), run.position[inside])
    np.testing.assert_array_equal(
        drawn.get_ydata(), zero_phase_low_pass(run.contact_force, run.time_step)[inside]
    )
    assert curve(contact, "EN 50367: at most 350 N").get_ydata()[0] == 350
    assert curve(contact, "nominal").get_ydata()[0] == run.nominal_force
    for axis in figure.axes:
        assert {500.0, 550.0, 900.0} <= set(dashed_verticals(axis))
    told = actuator.get_xlabel()
    assert "dashed lines: supports" in told
    assert "spans 10-19; the rest of the run's 950 m is not shown" in told
    assert [text.get_text() for text in actuator.get_legend().get_texts()] == ["on the frame"]
    low, high = height.get_ylim()
    assert low < 1e3 * run.head[inside].min() < 1e3 * run.head[inside].max() < high


def test_a_panel_of_fixed_limits_says_what_it_hides():
    axis = Figure().subplots()
    axis.plot([0, 1, 2, 3], [10.0, 500.0, -200.0, 9000.0])
    axis.set(xlim=(0, 2.5), ylim=(-100, 400))
    say_what_is_hidden(axis)
    (note,) = axis.texts
    assert note.get_text() == "not shown: up to 500, down to -200"
    full = Figure().subplots()
    full.plot([0, 1, 2], [10.0, 20.0, 30.0])
    say_what_is_hidden(full)
    assert len(full.texts) == 0


def dashed_verticals(axis):
    """Places of vertical dashed lines."""
    lines = [line for line in axis.lines if line.get_xdata()[0] == line.get_xdata()[-1] and line.is_dashed()]
    return [line.get_xdata()[0] for line in lines]


def names(axis):
    return [text.get_text() for text in axis.get_legend().get_texts()]


@pytest.fixture(scope="module")
def light():
    """A pantograph of 54 N that loses contact."""
    return simulate("shinkansen-simple", "identified-2dof", 320.0)


@pytest.mark.longer
def test_the_axis_of_a_light_force_fits_it_and_names_the_limit(light):
    """It had been two thirds empty, up to a limit of 350 N."""
    for axis in (plot_run(light).axes[0], *plot_forces([light], ["it"], (10, 12), "it").axes):
        low, high = axis.get_ylim()
        force = light.contact_force[light.inside()]
        assert low < 0 < force.max() < high < 1.2 * force.max()
        assert "EN 50367: at most 350 N, above the axis" in names(axis)


def test_losses_of_contact_are_squares_with_a_name(light, reference_run):
    axis = plot_run(light).axes[0]
    squares = curve(axis, "contact lost")
    assert squares.get_marker() == "s"
    inside = light.inside()
    lost = light.contact_force[inside] <= 0
    begins = light.position[inside][lost & ~np.concatenate([[False], lost[:-1]])]
    np.testing.assert_allclose(squares.get_xdata(), begins)
    assert "contact lost" in names(axis)
    assert "contact lost" not in names(plot_run(reference_run).axes[0])
