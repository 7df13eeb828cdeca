"""A mean force that is asked for is met by trimming the static force, once, and kept."""

import json
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, Trajectory, simulate
from panto_env.analysis.simulation import passive_at_mean
from panto_env.analysis.sweep import sweep
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task, passive_mean, trim_of_pass
from panto_env.control.passive_run import TOLERANCE, TRIM_DISTANCE, TrimAsDesigned, target_mean
from panto_env.control.settings import far_enough, run_settings
from panto_env.control.task import _required_more
from panto_env.metrics.compliance import largest_mean
from panto_env.plant.state import Row

from ..command import panto

LIGHT = {"catenary": "periodic-stiffness", "pantograph": "identified-2dof"}
"""A line that costs little, and a pantograph whose spring pulls back by a fifth."""
DIRECT = load_catenary("en50318-2002").model_copy(update={"system": "DC 3 kV"})


@pytest.fixture
def empty_store(tmp_path, monkeypatch):
    """The folder of what is kept, empty; and how often a passive run has been made."""
    monkeypatch.setattr("panto_env.backend.cache.cache_folder", lambda: tmp_path)
    runs = []
    run_passively = Task.run_passively
    monkeypatch.setattr(
        Task, "run_passively", lambda self, watch=None: (runs.append(1), run_passively(self, watch))[1]
    )
    return tmp_path / "mean_force", runs


@pytest.mark.parametrize(
    ("line", "pantograph", "speed", "wanted", "target"),
    [
        ("en50318-2002", "en50318-2002", 180.0, "en50367", 0.00047 * 180**2 + 90 - 0.05),
        ("periodic-stiffness", "identified-2dof", 300.0, "60", 60.0),
    ],
)
def test_the_mean_is_met_over_the_evaluated_spans(line, pantograph, speed, wanted, target):
    run = simulate(line, pantograph, speed, mean_force=wanted, record_droppers=False)
    assert run.target_mean == pytest.approx(target)
    assert run.summary().mean == pytest.approx(target, abs=0.1)
    free = simulate(line, pantograph, speed, record_droppers=False)
    assert np.isnan(free.target_mean)
    assert free.nominal_force == pytest.approx(load_pantograph(pantograph).nominal_force(speed / 3.6))
    assert abs(free.summary().mean - target) > 0.5


def test_it_is_met_over_the_spans_that_are_named_and_on_ones_own_line():
    own = LIGHT | {"mean_force": 60.0, "seed": 3, "line_condition": "worn"}
    run = simulate(**own, trimmed_over=(5, 6), distance=400.0)
    assert run.summary((5, 6)).mean == pytest.approx(60.0, abs=0.1)
    other = simulate(**own | {"seed": 4}, trimmed_over=(5, 6), distance=400.0)
    assert other.nominal_force != run.nominal_force


def test_which_spans_are_evaluated_does_not_change_the_run():
    """It had been trimmed anew over each choice, so that every span of an uneven line had the same mean."""
    worn = {**LIGHT, "line_condition": "worn", "seed": 2, "mean_force": 60.0}
    whole = simulate(**worn)
    assert whole.summary().mean == pytest.approx(60.0, abs=0.1)
    rows = [sweep({"speed_kmh": [300.0]}, spans=spans, **worn)[0] for spans in ((10, 10), (17, 17), "all")]
    assert {row["nominal_force"] for row in rows} == {whole.nominal_force}
    means = [row["mean"] for row in rows]
    assert means == [whole.summary(spans).mean for spans in ((10, 10), (17, 17), "all")]
    assert np.ptp(means) > 0.2


def test_under_a_policy_the_passive_pantograph_meets_it(tmp_path):
    passive, driven = (simulate(**LIGHT, mean_force=60.0, policy=policy) for policy in (None, "p"))
    driven.save(tmp_path / "run.parquet")
    again = Trajectory.load(tmp_path / "run.parquet")
    assert again.nominal_force == driven.nominal_force == passive.nominal_force
    assert again.target_mean == driven.target_mean == 60.0
    assert driven.frame_force.any()
    short = simulate(**LIGHT, mean_force=60.0, distance=300.0)  # too short for the default spans
    assert short.summary("all").mean == pytest.approx(60.0, abs=0.1)


@pytest.mark.parametrize(
    ("given", "speed", "target"),
    [
        ({"mean_force": "en50367"}, 250, 0.00097 * 250**2 + 70 - 0.05),
        ({"mean_force": "en50367", "catenary": DIRECT}, 160, 0.00097 * 160**2 + 110 - 0.05),
        ({"pantograph": "en50318-2002"}, 300, None),  # 120 N applied
        ({"pantograph": "benchmark-2015"}, 300, 157.3),  # which prescribes the mean
        ({"pantograph": "benchmark-2015", "mean_force": 130.0}, 300, 130.0),
    ],
)
def test_what_is_required_goes_by_standard_supply_and_pantograph(given, speed, target):
    found = target_mean(run_settings(given), speed / 3.6)
    assert found is target or found == pytest.approx(target)


def test_what_was_found_is_kept_and_found_again(empty_store):
    folder, runs = empty_store
    first = simulate(**LIGHT, mean_force=60.0)
    tried = len(runs)
    assert 3 <= tried <= 6  # the last is the run itself
    again = simulate(**LIGHT, mean_force=60.0)
    assert len(runs) == tried + 1
    np.testing.assert_array_equal(first.contact_force, again.contact_force)
    (file,) = folder.iterdir()
    assert json.loads(file.read_text())["value"] == [first.nominal_force]


CHANGES = [
    {"mean_force": 61.0},
    {"speed_kmh": 301.0},
    {"time_step": 2.5e-3},
    {"seed": 1},
    {"trimmed_over": (11, 12)},
    {"catenary": load_catenary("periodic-stiffness").model_copy(update={"mean_stiffness": 4100.0})},
    {"pantograph": load_pantograph("identified-2dof").model_copy(update={"masses": (5.1, 10.38)})},
    {"line_condition": "fair"},
    {"distance": 1000.0},
]


def test_whatever_the_run_is_made_of_is_trimmed_anew(empty_store):
    folder, _ = empty_store
    for number, change in enumerate([{}, *CHANGES], start=1):
        simulate(**LIGHT | {"mean_force": 60.0} | change)
        assert len(list(folder.iterdir())) == number, change


def test_what_a_passive_run_does_not_depend_on_needs_no_other(empty_store):
    folder, _ = empty_store
    simulate(**LIGHT, mean_force=60.0)
    simulate(**LIGHT, mean_force=60.0, sensors="realistic", actuator="realistic", policy="pd")
    assert len(list(folder.iterdir())) == 1


def test_a_damaged_file_is_made_anew(empty_store):
    folder, runs = empty_store
    force = simulate(**LIGHT, mean_force=60.0).nominal_force
    (file,) = folder.iterdir()
    whole = file.read_text()
    for damaged in (whole.replace(repr(force), repr(force + 1.0)), "[1, 2]"):
        assert damaged != whole
        file.write_text(damaged)
        tried = len(runs)
        assert simulate(**LIGHT, mean_force=60.0).nominal_force == force
        assert len(runs) > tried + 1
        assert file.read_text() == whole


def test_an_environment_meets_it_at_any_speed_it_draws(empty_store):
    settings = {**LIGHT, "speed_kmh": (290.0, 301.0), "mean_force": 60.0}
    env = gymnasium.make("panto_env:PantographStiffness-v0", **settings).unwrapped
    assert not empty_store[1]  # it is not slowed down before it is used
    _, info = env.reset(seed=5)
    applied, speed = env.context.nominal_force, info["speed_kmh"]
    exact = simulate(**LIGHT, speed_kmh=speed, mean_force=60.0).nominal_force
    assert applied == pytest.approx(exact, abs=0.3)
    assert applied > 65.0
    lanes = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=2, **settings)
    lanes.reset(seed=5)
    assert lanes.unwrapped.task.plant.of(0, Row.NOMINAL_FORCE) == applied


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mean_force": -5}, "mean_force must be a positive number"),
        ({"mean_force": "much"}, "mean_force must be a positive number .* not 'much'"),
        ({"mean_force": True}, "mean_force must be a positive number"),
        ({"mean_force": float("nan")}, "mean_force must be a positive number"),
        ({"mean_force": 900.0, "catenary": "en50318-2002"}, "cannot be met .* ended early"),
        ({"mean_force": 50.0, "pantograph": "three-mass"}, "aerodynamic uplift alone is 87.3 N"),
    ],
)
def test_what_cannot_be_met_is_refused_in_one_sentence(given, message):
    with pytest.raises(InputError, match=message) as caught:
        simulate(**LIGHT | given)
    assert "\n" not in str(caught.value)


def test_the_command_takes_it_and_says_what_it_applied():
    light = ("--catenary", "periodic-stiffness", "--pantograph", "identified-2dof")
    command = ["simulate", *light, "--spans", "5-8", "--mean-force"]
    text = panto(*command, "60")
    assert text.returncode == 0, text.stderr
    assert "trimmed for a passive mean of 60.0 N" in text.stdout
    told = json.loads(panto(*command, "en50367", "--json").stdout)
    assert told["target_mean"] == pytest.approx(largest_mean(300 / 3.6, "AC") - TOLERANCE)
    assert told["figures"]["mean"] == pytest.approx(told["target_mean"], abs=1.0)
    assert told["nominal_force"] > told["target_mean"]


def test_a_trim_by_speed_is_near_that_of_each_speed():
    """Between the speeds that are trimmed the mean is within a few tenths of a newton."""
    given = LIGHT | {"mean_force": 60.0}
    settings = run_settings(given | {"speed_kmh": (240.0, 250.0)})
    trim = TrimAsDesigned(settings, (240 / 3.6, 250 / 3.6), passive_mean)
    assert 3.6 * np.diff(trim.speeds).max() <= TRIM_DISTANCE
    between = far_enough(run_settings(given | {"speed_kmh": 247.3}))
    exact = trim_of_pass(between, 0, None, passive_mean)
    assert trim.static_force(247.3 / 3.6) == pytest.approx(exact.static_forces[0], abs=0.3)


def made_up(**changes):
    """A run whose speed drifts, by how much a required mean force is then higher."""
    run = {"speed": 55.0, "speeds": np.array([50.0, 60.0, 70.0, 80.0])}
    inside = np.array([False, True, True, False])
    identity = SimpleNamespace(**{"drifts": True} | changes)
    return SimpleNamespace(inside=lambda spans: inside, identity=identity, **run)


def test_it_is_the_mean_over_the_spans_of_what_each_speed_requires():
    settings = run_settings({"mean_force": "en50367"})
    required = [target_mean(settings, speed) for speed in (60.0, 70.0)]
    expected = np.mean(required) - target_mean(settings, 55.0)
    assert expected > 1.0
    assert _required_more(settings, made_up(), None) == pytest.approx(expected)
    of_standard = largest_mean(60.0, "AC") - largest_mean(55.0, "AC")
    assert target_mean(settings, 60.0) - target_mean(settings, 55.0) == pytest.approx(of_standard)


def test_it_is_nothing_at_one_speed_or_where_a_number_or_nothing_is_required():
    for given in ({"mean_force": "en50367"}, {"mean_force": 60.0}, {}):
        settings = run_settings(given)
        assert _required_more(settings, made_up(drifts=False), None) == 0.0
        if given.get("mean_force") != "en50367":
            assert _required_more(settings, made_up(), None) == 0.0


@pytest.mark.parametrize(("condition", "more"), [("fair", -1), ("fair:wind=15", 0)])
def test_the_pass_that_met_the_mean_is_the_one_that_simulate_gives(empty_store, condition, more):
    given = LIGHT | {"pantograph": "dsa380", "speed_kmh": 250.0, "line_condition": condition, "seed": 4}
    given |= {"spans": 30, "distance": 700.0, "mean_force": 110.0, "trimmed_over": (5, 8)}
    expected = simulate(**given, record_droppers=False)
    with_trim = len(empty_store[1])
    from_store = passive_at_mean(**given)
    assert len(empty_store[1]) == with_trim + 1
    for kept in empty_store[0].iterdir():
        kept.unlink()
    found = passive_at_mean(**given)
    assert len(empty_store[1]) == 2 * with_trim + 1 + more  # in wind the trim's run is another
    for each in (found, from_store):
        np.testing.assert_array_equal(each.contact_force, expected.contact_force)
        assert each.seed == expected.seed
        assert each.summary((5, 8)) == expected.summary((5, 8))
    mean = found.summary((5, 8)).mean
    assert mean > 120.0 if "wind" in condition else mean == pytest.approx(110.0, abs=TOLERANCE)
