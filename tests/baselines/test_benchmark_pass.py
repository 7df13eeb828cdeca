"""One pass of a benchmark: it runs as its settings ask, and its rate of action is that of the commands."""

import numpy as np
import pytest
from scipy import signal

from panto_baselines.benchmark.settings import BenchmarkSettings, Line, Windows
from panto_baselines.benchmark.single_pass import drive, run_pass
from panto_env import simulate
from panto_env.base.settings import parse
from panto_env.catalog import load_pantograph

LINE = Line(catenary="periodic-stiffness", pantograph="three-mass", distance=160.0)
SPEED_KMH = 300.0
INTERVAL = 0.02  # s


def settings(**given):
    return parse(BenchmarkSettings, given, "the benchmark")


def run(**given):
    return drive(settings(**{"line_condition": "new"} | given), LINE, "p:gain=0.5", SPEED_KMH, seed=3)[0]


@pytest.mark.longer
@pytest.mark.parametrize(
    "setting",
    [
        {"actuator": {"force_limit": 7.0}},
        {"sensors": {"delay": 0.03}},
        {"line_condition": "worn"},
        {"control_interval": INTERVAL},
        {"pantograph_scatter": 0.1},
        {"speed_drift": 1.0},
    ],
    ids=lambda setting: next(iter(setting)),
)
def test_a_pass_is_run_under_each_setting(setting):
    asked = run(**setting)
    expected = simulate(
        LINE.catenary, LINE.pantograph, SPEED_KMH, "p:gain=0.5", seed=3, distance=160.0, **setting
    )
    np.testing.assert_array_equal(asked.contact_force, expected.contact_force)
    assert not np.array_equal(asked.contact_force, run().contact_force)


class Shouting:
    """Asks for more than there is, on frame and head, by a plan."""

    def reset(self, context):
        self.step = 0
        self.plan = np.random.default_rng(0).normal(0, 1, (200, context.actions))

    def act(self, observation):
        self.step += 1
        return self.plan[self.step - 1]


def test_rate_of_action_is_that_of_the_possible_commands_within_the_spans():
    given = settings(
        actuator={"place": "both", "force_limit": 50.0}, line_condition="new", control_interval=INTERVAL
    )
    row = run_pass(given, LINE, Windows((2, 3)), Shouting(), SPEED_KMH, seed=0).row
    asked = 50.0 * np.clip(np.random.default_rng(0).normal(0, 1, (200, 2)), -1, 1)
    # A span of 50 m takes 0.6 s, 30 commands: those of spans 2 and 3 are the 31st to the 90th.
    changes = np.diff(asked[30:90], axis=0) / INTERVAL
    assert row.action_rate == pytest.approx(np.sqrt((changes**2).sum() / 59))
    assert (row.seed, row.speed_kmh, row.terminated) == (0, SPEED_KMH, False)
    assert row.figures.distance == pytest.approx(100.0)


def test_a_pass_that_ends_early_has_no_figures():
    class Down:
        def reset(self, context):
            pass

        def act(self, observation):
            return -np.ones(1)

    given = settings(actuator={"force_limit": 1000.0}, line_condition="new")
    row = run_pass(given, LINE, Windows((2, 3)), Down(), SPEED_KMH, seed=0).row
    assert row.terminated
    assert np.isnan([*row.figures.as_dict().values(), row.action_rate, row.power, row.pressed_std]).all()


@pytest.mark.longer
def test_the_pressed_passive_pantograph_has_the_mean_of_the_pass():
    given = settings(line_condition="new")
    row = run_pass(given, LINE, Windows((2, 3)), "p:gain=0.5", SPEED_KMH, seed=0).row
    arguments = {"distance": 160.0, "line_condition": "new", "control_interval": 0.01}
    data = load_pantograph(LINE.pantograph)
    forces = [data.static_force + more for more in (-20.0, 0.0, 20.0)]
    pantographs = [data.model_copy(update={"static_force": force}) for force in forces]
    pressed = [simulate(LINE.catenary, p, SPEED_KMH, **arguments).summary((2, 3)) for p in pantographs]
    expected = np.interp(row.figures.mean, [one.mean for one in pressed], [one.std for one in pressed])
    assert row.pressed_std == pytest.approx(expected, rel=0.01)
    assert row.pressed_std != pytest.approx(pressed[1].std, rel=1e-3)
    own = run_pass(given, LINE, Windows((2, 3)), "passive", SPEED_KMH, seed=0).row
    assert (own.pressed_std, own.pressed_cost_function) == (own.figures.std, own.figures.cost_function)


def test_saturation_and_power_are_those_of_the_commands_and_the_forces():
    given = settings(actuator={"force_limit": 50.0}, line_condition="new", control_interval=INTERVAL)
    row = run_pass(given, LINE, Windows((2, 3)), Shouting(), SPEED_KMH, seed=0).row
    plan = np.random.default_rng(0).normal(0, 1, (200, 1))
    assert row.saturation == pytest.approx(np.mean(np.abs(plan[30:90]) > 0.999))
    run, _ = drive(given, LINE, Shouting(), SPEED_KMH, seed=0)
    inside = (run.position > 50.0) & (run.position < 150.0)
    assert row.power == pytest.approx(np.abs(run.frame_force * run.frame_velocity)[inside].mean(), rel=0.01)


@pytest.mark.longer
def test_a_trace_is_the_force_along_two_spans_and_its_spectrum():
    given = settings(line_condition="new")
    row, _, trace = run_pass(given, LINE, Windows((1, 3)), "p:gain=0.5", SPEED_KMH, seed=3, traced=True)
    run, _ = drive(given, LINE, "p:gain=0.5", SPEED_KMH, seed=3)
    assert (trace.policy, trace.speed_kmh, trace.seed) == ("p:gain=0.5", SPEED_KMH, 3)
    position, force = np.array(trace.position), np.array(trace.force)
    np.testing.assert_allclose(position, np.linspace(50.0, 150.0, 201), atol=0.01)  # spans of 50 m
    filtered = signal.sosfiltfilt(
        signal.butter(3, 20.0, fs=1 / run.time_step, output="sos"), run.contact_force
    )
    inside = (position > 60) & (position < 140)
    expected = np.interp(position, run.position, filtered)
    np.testing.assert_allclose(force[inside], expected[inside], atol=0.02 * expected.std())
    frequency, amplitude = np.array(trace.frequency), np.array(trace.amplitude)
    assert frequency[-1] <= 20.0 < frequency[-1] + frequency[1]
    raw = run.contact_force[run.position < 150.0]
    _, power = signal.periodogram(raw, 1 / run.time_step, window="hann", scaling="spectrum")
    np.testing.assert_allclose(amplitude, np.sqrt(2 * power[: len(amplitude)]), atol=0.01 * amplitude.max())
    assert run_pass(given, LINE, Windows((2, 3)), "passive", SPEED_KMH, seed=0).trace is None
    assert row.figures.std == run.summary((1, 3)).std


@pytest.mark.longer
def test_where_the_speed_drifts_commands_count_where_the_figures_do():
    """An ideal actuator does what it is told: its effort in the figures is the rms of the commands."""
    given = settings(line_condition="new", speed_drift=10.0)
    line = LINE.model_copy(update={"distance": 2000.0})
    run, commands = drive(given, line, "p:gain=0.5", 100.0, seed=5)
    assert abs(run.position - 100 / 3.6 * run.time).max() > 10.0  # m: a fifth of a span
    steps = round(given.control_interval / run.time_step)
    begin, end = 20 * 50.0, 24 * 50.0
    counted = (run.position[::steps] >= begin) & (run.position[::steps] < end)
    expected = np.diff(commands[counted], axis=0) / given.control_interval
    row = run_pass(given, line, Windows((21, 24)), "p:gain=0.5", 100.0, seed=5).row
    assert row.action_rate == pytest.approx(np.sqrt(np.mean(expected**2)))
    assert np.sqrt(np.mean(commands[counted] ** 2)) == pytest.approx(row.figures.effort, rel=2e-3)


def test_a_slow_train_leaves_points_enough_for_a_peak_at_20_hz():
    given = settings(line_condition="new")
    trace = run_pass(given, LINE, Windows((2, 2)), "passive", 40.0, seed=0, traced=True).trace
    steps = np.diff(trace.position)
    assert steps.max() <= 40 / 3.6 / 80 + 0.011
    assert (trace.position[0], trace.position[-1]) == (50.0, 100.0)
