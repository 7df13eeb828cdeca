"""The rig: its parts against closed forms and SciPy, and as a whole against the line without a rig."""

import copy
from functools import cache

import gymnasium
import numpy as np
import pytest
from scipy.signal import butter, lsim

from panto_env import InputError, simulate
from panto_env.backend import kernel
from panto_env.catalog import load_catenary
from panto_env.metrics.low_pass import in_band
from panto_env.plant.catenary.protocol import advance_wire, apply_force, end_step, place_contact
from panto_env.plant.catenary.rig import Rig
from panto_env.plant.catenary.rig.build import assumed, bank, outer_lead
from panto_env.plant.catenary.rig.step import RIG_ROW, RigRow
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics, Runs

from ..marks import some_at_once

LINE, PANTOGRAPH, SPEED = "en50318-2002", "own-two-mass", 250
EXACT = {
    "cylinder": {"natural_frequency": 200, "speed_limit": 20, "stiffness": 5e8, "displacement_noise": 0},
    "load_cell": {"noise": 0, "filter_frequency": 2e3, "mass": 0, "compensated_mass": 0},
    "computer": {"delay": 0, "input_bits": 32, "output_bits": 32},
}


def rig(name="rig-flexible", **tables):
    """A rig of the catalogue with other values in its tables."""
    data = load_catenary(name)
    changed = {key: {**getattr(data, key).model_dump(), **tables.get(key, {})} for key in EXACT}
    return type(data).model_validate(data.model_dump() | changed)


@cache
def on_the_line(time_step):
    return simulate(LINE, PANTOGRAPH, SPEED, time_step=time_step)


@cache
def on_a_rig(data, time_step):
    return simulate(data, PANTOGRAPH, SPEED, time_step=time_step)


def error(data, time_step, low=0.0, high=20.0):
    """Rms error of the contact force on a rig, as a share of the rms on the line itself, in a band."""
    run, reference = on_a_rig(data, time_step), on_the_line(time_step)
    assert not run.ending
    inner = slice(len(run.time) // 4, int(0.95 * len(run.time)))
    ours, true = (in_band(each.contact_force[inner], time_step, low, high) for each in (run, reference))
    return (ours - true).std() / true.std()


# --- parts ---------------------------------------------------------------------------------------


@kernel
def drive_cylinder(line, wire, commands, force, heights, cells, counts):
    """Run a rig without its computer: a command and a force for each step."""
    for k in range(commands.size):
        wire.table[0, RIG_ROW.COMMAND] = commands[k]
        x = 0.01 * (k + 0.5)
        place_contact(line, wire, 0, counts, x)
        advance_wire(line, wire, 0)
        apply_force(line, wire, 0, counts, x, force[k])
        end_step(line, wire, 0)
        heights[k] = wire.table[0, RIG_ROW.HEIGHT]
        cells[k] = wire.table[0, RIG_ROW.FILTERED]


def parts_of_run(data, commands, force):
    model = Rig(data, lanes=1, collectors=1, spans=10, numerics=Numerics(time_step=2.5e-4), runs=Runs())
    assert model.time_step == 2.5e-4
    model.line = model.line._replace(interval_steps=1 << 40)  # no sample is taken
    model.settle(0, DrawnLine(LineCondition()), 0.0)
    heights, cells = np.zeros(len(commands)), np.zeros(len(commands))
    drive_cylinder(model.line, model.wire, commands, force, heights, cells, 0)
    return model, heights, cells


def transfer_function(cylinder):
    """As a system that gives height and velocity."""
    omega, ratio = 2 * np.pi * cylinder.natural_frequency, cylinder.damping_ratio
    return [[0, 1], [-(omega**2), -2 * ratio * omega]], [[0], [omega**2]], np.eye(2), np.zeros((2, 1))


@pytest.mark.slow
@pytest.mark.plain
def test_the_cylinder_is_its_transfer_function_behind_the_delay():
    """Of 2.4 steps; within a step a command that changes counts by its mean."""
    data, dt = rig("rig", cylinder={"speed_limit": 20}, computer={"delay": 0.6e-3}), 2.5e-4
    commands = 1e-3 * np.cumsum(np.random.default_rng(0).standard_normal(160))
    _, heights, _ = parts_of_run(data, commands, np.zeros(160))
    late = [np.append(np.zeros(steps), commands)[:160] for steps in (2, 3)]
    _, true, _ = lsim(
        transfer_function(data.cylinder),
        np.append(0.6 * late[0] + 0.4 * late[1], 0),
        dt * np.arange(161),
        interp=False,
    )
    assert heights == pytest.approx(true[1:, 0], abs=1e-9)


@pytest.mark.longer
@pytest.mark.plain
def test_the_cylinder_keeps_its_largest_speed_and_stops_at_its_end():
    data = rig("rig", cylinder={"speed_limit": 0.5})
    commands = np.full(800, 0.15)
    model, heights, _ = parts_of_run(data, commands, np.zeros(800))
    assert np.abs(np.diff(heights)).max() == pytest.approx(0.5 * 2.5e-4)
    assert model.wire.table[0, RigRow.LIMITED] > 700
    assert model.wire.table[0, RigRow.STOPPED] == 0
    data = rig("rig", cylinder={"speed_limit": 5})
    model, heights, _ = parts_of_run(data, 2 * commands, np.zeros(800))
    assert heights.max() == pytest.approx(0.2)
    assert model.wire.table[0, RigRow.STOPPED] > 0


@pytest.mark.longer
@pytest.mark.plain
def test_the_load_cell_reads_the_force_less_inertia_behind_its_filter():
    data = rig("rig", load_cell={"mass": 2.0, "compensated_mass": 0.5, "filter_frequency": 100})
    random, dt = np.random.default_rng(1), 2.5e-4
    force, still = 50 + 20 * random.standard_normal(400), np.zeros(400)
    _, heights, cells = parts_of_run(data, still, force)
    assert not heights.any()  # the force by itself does not move it
    numerator, denominator = butter(2, 2 * np.pi * 100, analog=True)
    time = dt * np.arange(401)
    _, filtered, _ = lsim((numerator, denominator), np.r_[force, force[-1]], time, interp=False)
    assert cells == pytest.approx(filtered[1:], abs=1e-8)
    # The inertia of what is not compensated for: 1.5 kg times the mean acceleration of each step.
    commands = 1e-4 * random.standard_normal(400)
    _, _, inertial = parts_of_run(data, commands, still)
    delayed = np.r_[np.zeros(4), commands][:400]
    _, motion, _ = lsim(transfer_function(data.cylinder), np.r_[delayed, 0], time, interp=False)
    acceleration = np.diff(motion[:, 1]) / dt
    _, filtered, _ = lsim((numerator, denominator), np.r_[-1.5 * acceleration, 0], time, interp=False)
    assert inertial == pytest.approx(filtered[1:], rel=1e-6, abs=1e-6)


def test_a_prediction_goes_on_with_a_cubic_and_an_inverse_knows_its_rates():
    data = rig(computer={"compensation": "prediction"})
    h = data.computer.interval
    weights = bank(data)
    wanted = assumed(data)[1] + outer_lead(data)
    past = -h * np.arange(weights.shape[1])
    for power in range(4):
        assert weights[0] @ past**power == pytest.approx(wanted**power, abs=1e-12)
    rates = bank(rig(computer={"compensation": "inverse"}))
    past = -h * np.arange(4)
    assert rates @ (1 + 2 * past + 3 * past**2) == pytest.approx([1, 2, 6])


def test_the_inverse_is_that_of_cylinder_and_delay_up_to_the_square_of_frequency():
    data = rig()
    s = 2j * np.pi * np.array([1.0, 2.0, 4.0])
    omega, ratio = 2 * np.pi * data.cylinder.natural_frequency, data.cylinder.damping_ratio
    delay = data.computer.delay + data.computer.interval / 2
    plant = omega**2 / (s**2 + 2 * ratio * omega * s + omega**2) * np.exp(-s * delay)
    remainder = np.abs(plant * np.polyval(assumed(data)[::-1], s) - 1)
    assert remainder[0] < 1e-5
    assert remainder[1:] / remainder[:-1] == pytest.approx([8, 8], rel=0.02)


# --- the whole -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_rig_without_faults_is_the_line_itself_the_closer_the_shorter_the_time_step():
    """Whatever its sampling interval: the line is computed where the force was measured."""
    errors = {}
    for dt in (5e-4, 2.5e-4, 1.25e-4):
        for interval in (1e-3, dt):
            data = rig(**EXACT | {"computer": EXACT["computer"] | {"interval": interval}})
            errors.setdefault(interval == 1e-3, []).append(error(data, dt))
    assert errors[True][-1] < 0.004
    for over_step in errors.values():
        assert over_step[0] > 1.4 * over_step[1] > 1.4**2 * over_step[2]


@pytest.mark.slow
def test_the_rig_as_it_stands_follows_the_flexible_line_within_a_tenth_to_20_hz():
    dt = 2.5e-4
    usual = error(rig(), dt)
    assert usual < 0.05
    assert error(rig(), dt, 15, 20) < 0.12
    assert error(rig(computer={"compensation": "none"}), dt) > 3 * usual


@pytest.mark.longer
def test_a_fitted_compensation_learns_a_cylinder_that_is_not_the_assumed_one():
    dt, wrong = 2.5e-4, {"assumed_frequency": 40.0}
    fixed = error(rig(computer=wrong), dt)
    fitted = error(rig(computer={**wrong, "compensation": "adaptive"}), dt)
    known = error(rig(), dt)
    assert known < fitted < known + 0.4 * (fixed - known)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("tables", "said"),
    [({"computer": {"delay": 0.02}}, "load cell"), ({"cylinder": {"stroke": 0.02}}, "end of its stroke")],
)
def test_a_loop_that_is_not_stable_ends_by_itself(tables, said):
    run = simulate(rig(**tables), PANTOGRAPH, SPEED)
    assert said in run.ending


@pytest.mark.longer
def test_a_loop_whose_limits_are_far_away_diverges_and_says_that_it_is_the_loop():
    wild = {"load_cell": {"force_range": 1e5}, "cylinder": {"stroke": 2, "speed_limit": 20}}
    data = rig(**wild, computer={"delay": 0.02, "assumed_delay": 0.001})
    with pytest.raises(InputError, match="loop of the rig may be unstable"):
        simulate(data, PANTOGRAPH, SPEED, bilateral=True)


def test_what_the_cylinder_would_not_follow_is_refused():
    with pytest.raises(InputError, match=r"line_condition without irregularity"):
        simulate("rig-flexible", PANTOGRAPH, SPEED, line_condition="fair")
    with pytest.raises(InputError, match=r"whole number of the rig's sampling intervals of 0.7 ms"):
        simulate(rig(computer={"interval": 7e-4}), PANTOGRAPH, SPEED)


@pytest.mark.longer
def test_a_defect_of_the_computed_line_is_felt_on_the_rig():
    dt, broken = 2.5e-4, {"broken_droppers": [(5, 4)]}
    change = {}
    for name in (LINE, "rig-flexible"):
        given = {"time_step": dt, "distance": 340.0}
        runs = [simulate(name, PANTOGRAPH, SPEED, **given, line_condition=c) for c in ("new", broken)]
        forces = [in_band(run.contact_force[: len(runs[0].time)], dt, 0, 20) for run in runs]
        place = slice(int(4.2 * 60 / (SPEED / 3.6) / dt), int(5.5 * 60 / (SPEED / 3.6) / dt))
        change[name] = (forces[1] - forces[0])[place]
    assert np.corrcoef(*change.values())[0, 1] > 0.97
    assert change["rig-flexible"].std() == pytest.approx(change[LINE].std(), rel=0.1)


@pytest.mark.longer
@pytest.mark.parametrize("name", some_at_once(["rig", "rig-flexible"], ["rig"]))
def test_an_environment_on_the_rig_is_one_like_any_other(name):
    """A policy's view of it; lanes are single environments, copies go on as the original does."""
    settings = {"catenary": name, "pantograph": PANTOGRAPH, "line_condition": "new", "speed_kmh": (200, 300)}
    lanes = gymnasium.make_vec("panto_env:Pantograph-v0", 3, **settings)
    alone = gymnasium.make("panto_env:Pantograph-v0", **settings).unwrapped
    lanes.reset(seed=5)
    alone.reset(seed=6)
    other = None
    for k in range(30):
        action = np.sin(0.3 * k + np.arange(3.0)).reshape(3, 1).astype(np.float32)
        together = lanes.step(action)
        single = alone.step(action[1])
        assert np.array_equal(together[0][1], single[0])
        if other is not None:
            assert np.array_equal(other.step(action)[0], together[0])
        if k == 15:
            other = copy.deepcopy(lanes)


def test_a_rig_may_name_its_line_and_takes_over_what_that_has(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('kind = "rig"\ndescription = "mine"\nline = "re330"\n')
    data, line = load_catenary(str(path)), load_catenary("re330")
    assert (data.span_length, data.spans, data.system) == (line.span_length, line.spans, line.system)
    for name, words in (("re331", "did you mean 're330'"), ("periodic-stiffness", "line")):
        path.write_text(f'kind = "rig"\ndescription = "mine"\nline = "{name}"\n')
        with pytest.raises(InputError, match=words):
            load_catenary(str(path))
