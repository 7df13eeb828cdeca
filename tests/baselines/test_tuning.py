"""The tuner, the files that it writes, and the fitted policies that read them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from panto_baselines.benchmark import settings as seeds
from panto_baselines.policies.adaptive import (
    COMMANDS,
    HARMONICS,
    HISTORY,
    LEAD,
    SIGNALS,
    FittedFeedback,
    Periodic,
)
from panto_baselines.policies.feedback import Skyhook
from panto_baselines.policies.lanes_law import (
    GAINS_FOLDER,
    LanesLaw,
    find_gains,
    gain_file,
    load_gains,
)
from panto_baselines.tuning import command
from panto_baselines.tuning.command import check_gain_file, make_tuning, store, tune, tune_speeds
from panto_baselines.tuning.tune import (
    DAMPINGS,
    MEAN_TOLERANCE,
    MEAN_WEIGHT,
    Still,
    Tuned,
    fit,
    residuals_of,
    run_batch,
    tunable,
    tune_at,
)
from panto_env import InputError, simulate
from panto_env.control.settings import run_settings

from .commands import called
from .laws import CONTEXT, a_context, seen

FEW = {"speed_kmh": 300.0, "accuracy": "fast", "distance": 660.0, "spans": 19}
REAL = {"actuator": "realistic", "sensors": "realistic", "line_condition": "smooth"}


def test_periodic_force_is_its_fourier_series_ahead_by_the_lead():
    gains = np.random.default_rng(0).normal(size=2 * HARMONICS)
    policy = Periodic(gains=gains.tolist())
    policy.reset(CONTEXT)
    for angle in (0.0, 1.3, 5.9):
        ahead = angle + 2 * np.pi * LEAD * CONTEXT.speed / CONTEXT.alignment.mean_length
        expected = sum(
            gains[k - 1] * np.cos(k * ahead) + gains[HARMONICS + k - 1] * np.sin(k * ahead)
            for k in range(1, HARMONICS + 1)
        )
        assert policy.forces(seen(angle=angle))[0] == pytest.approx(expected, abs=1e-4)
        assert policy.act(seen(angle=angle)[0])[0] == pytest.approx(expected / CONTEXT.force_limit, abs=1e-6)


def test_fitted_feedback_adds_past_signals_and_commands_to_the_series():
    gains = np.zeros(2 * HARMONICS + HISTORY * len(SIGNALS) + COMMANDS)
    gains[0] = 7.0  # of the first cosine
    place = 2 * HARMONICS + len(SIGNALS) + list(SIGNALS).index("frame velocity")
    gains[place] = -2.0  # of the frame's velocity one step ago, in units of 0.1 m/s
    gains[-1] = 3.0  # of the command two steps ago, in units of 10 N
    policy = FittedFeedback(gains=gains.tolist())
    policy.begin(CONTEXT, 1)
    angle = -2 * np.pi * LEAD * CONTEXT.speed / CONTEXT.alignment.mean_length
    forces = [policy.forces(seen(angle=angle, frame_velocity=each))[0] for each in (0.0, 0.2, 0.0, 0.0)]
    assert forces[:2] == pytest.approx([7.0, 7.0], abs=1e-4)
    # All but a hundredth of a signal is left of it after its slow average has taken its share.
    assert forces[2] == pytest.approx(7.0 + 3.0 * 0.7 - 2.0 * 0.2 / 0.1, abs=0.1)
    assert forces[3] == pytest.approx(7.0 + 3.0 * 0.7, abs=0.1)


def test_constant_readings_move_no_feedback():
    gains = np.concatenate([np.zeros(2 * HARMONICS), np.ones(HISTORY * len(SIGNALS)), np.zeros(COMMANDS)])
    policy = FittedFeedback(gains=gains.tolist())
    policy.begin(CONTEXT, 1)
    for _ in range(3):
        assert policy.forces(seen(contact_force=140.0, head_displacement=0.07))[0] == 0.0


def test_skyhook_opposes_velocities():
    policy = Skyhook(gains=(150.0, -20.0))
    policy.begin(CONTEXT, 1)
    force = policy.forces(seen(frame_velocity=0.2, head_velocity=-0.1))[0]
    assert force == pytest.approx(-150 * 0.2 - 20 * 0.1, rel=1e-5)


def a_file(path, policy="skyhook"):
    tuned = [
        Tuned(speed, gains, (1.0, 0.5), 40, -0.1, 0.001)
        for speed, gains in ((250.0, (100.0, 10.0)), (300.0, (200.0, 30.0)))
    ]
    store(path, policy, make_tuning(run_settings(REAL), ["frame", "head"], tuned, [2000], "panto tune"))
    return path


def test_stored_gains_are_found_and_interpolated_over_speed(tmp_path):
    path = a_file(tmp_path / "mine.toml")
    policy = Skyhook(gains=str(path))
    policy.reset(a_context(speed_kmh=275.0))
    assert policy.gains == pytest.approx([150.0, 20.0])
    policy.reset(a_context(speed_kmh=310.0))  # beyond, within half a step
    assert policy.gains == pytest.approx([200.0, 30.0])
    tuning = load_gains(path).tunings[0]
    assert (tuning.command, tuning.seeds, tuning.passes) == ("panto tune", (2000,), 80)
    assert tuning.actuator["lag"] == 0.015
    assert load_gains(a_file(path)).tunings == (tuning,)  # the same case is replaced


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"speed_kmh": 330.0}, "from 250 to 300 km/h, not for 330 km/h"),
        ({"catenary": "re330"}, "no gains for the pantograph 'en50318-2002' on the line 're330'"),
        ({"catenary": "re330"}, "give them (frame, head) as the parameter gains"),
        ({"actuator": {"place": "head"}}, "with an actuator at head"),
    ],
)
def test_where_there_are_no_gains_a_sentence_says_so(tmp_path, settings, words):
    path = a_file(tmp_path / "mine.toml")
    with pytest.raises(InputError) as caught:
        Skyhook(gains=str(path)).reset(a_context(**settings))
    assert words in str(caught.value)


def test_gains_of_another_policy_or_number_are_refused(tmp_path):
    path = a_file(tmp_path / "mine.toml")
    with pytest.raises(InputError, match="not those of this policy"):
        Periodic(gains=str(path)).reset(CONTEXT)
    with pytest.raises(InputError, match="There must be 2 gains"):
        Skyhook(gains=(1.0, 2.0, 3.0)).reset(CONTEXT)
    with pytest.raises(InputError, match="holds gains of 'skyhook'"):
        check_gain_file(path, "periodic", run_settings({}), force=False)
    with pytest.raises(InputError, match="There is no file of gains"):
        find_gains("nowhere", ["frame"], CONTEXT)


@pytest.mark.parametrize("path", sorted(GAINS_FOLDER.glob("*.toml")), ids=lambda path: path.stem)
def test_gains_that_come_with_the_project_are_of_their_policy_and_of_training_seeds(path):
    file, trailing = load_gains(path), path.stem.endswith("-trailing")
    assert gain_file(file.policy) == path.with_stem(
        path.stem.removesuffix("-trailing").removesuffix("-any-line")
    )
    for tuning in file.tunings:
        assert ("--controlled 2" in tuning.command) == trailing  # behind another, and nowhere else
        assert list(tuning.names) == list(tunable(file.policy).TUNED)
        assert set(tuning.seeds) <= set(seeds.TRAINING)
        assert all(change < 0 for change in tuning.std_change)
        assert all(abs(change) < MEAN_TOLERANCE for change in tuning.mean_change)


def test_a_linear_problem_is_solved_at_once_a_bent_one_in_some_iterations():
    rng = np.random.default_rng(1)
    matrix, target = rng.normal(size=(40, 5)), rng.normal(size=40)
    found = fit(lambda x: x @ matrix.T - target, np.zeros(5), np.full(5, 0.1), 5)
    expected = np.linalg.lstsq(matrix, target, rcond=None)[0]
    assert found.gains == pytest.approx(expected, abs=2e-3)
    assert list(found.history) == sorted(found.history, reverse=True)

    def rosenbrock(x):
        return np.stack([10 * (x[:, 1] - x[:, 0] ** 2), 1 - x[:, 0]], axis=1)

    assert fit(rosenbrock, np.array([-0.5, 0.5]), np.full(2, 1e-4), 60).gains == pytest.approx(1, abs=0.02)


def test_a_ridge_draws_gains_to_zero_in_units_of_their_steps():
    """Of a linear problem, from a start far off: ridge regression in closed form."""
    rng, steps, start = np.random.default_rng(2), np.array([0.1, 0.5, 2.0]), np.array([3.0, -2.0, 1.0])
    matrix, target = rng.normal(size=(30, 3)), rng.normal(size=30)
    found = fit(lambda x: x @ matrix.T - target, start, steps, 8, ridge=5.0)
    normal = matrix.T @ matrix + 5.0 * np.diag(1 / steps**2)
    expected = np.linalg.solve(normal, matrix.T @ target)
    assert found.gains == pytest.approx(expected, abs=2e-3)
    left = target - matrix @ expected
    least = left @ left + 5.0 * np.sum((expected / steps) ** 2)
    assert found.history[-1] == pytest.approx(least, rel=1e-4)


def test_candidates_that_fail_are_not_taken():
    def residuals(x):
        return np.where(np.abs(x) < 0.5, x - 2.0, np.nan)

    found = fit(residuals, np.zeros(1), np.array([0.1]), 20)
    assert 0.3 < found.gains[0] < 0.5
    with pytest.raises(InputError, match="cannot start"):
        fit(residuals, np.ones(1), np.array([0.1]), 3)


def test_where_all_candidates_are_worse_the_start_stays():
    found = fit(lambda x: 1 + np.abs(x), np.zeros(1), np.array([0.1]), 3)
    assert found.gains == [0.0]
    assert found.history == (1.0,)


@pytest.mark.parametrize("drift", [0.0, 10.0])
def test_a_batch_is_what_single_passes_are(drift):
    settings = FEW | {"speed_drift": drift} | REAL
    laws = [Still(), Skyhook(gains=(100.0, 0.0))]
    force = run_batch(run_settings(settings), laws, [1000, 1001])
    assert (force.std[:, 0] != force.std[:, 1]).all()  # a line of its own for each seed
    for row, policy in enumerate((None, "skyhook:gains=(100.0,0.0)")):
        figures = simulate(policy=policy, seed=1001, **settings).summary()
        assert force.mean[row, 1] == pytest.approx(figures.mean, rel=2e-3 if drift else 1e-3)
        assert force.std[row, 1] == pytest.approx(figures.std, rel=1e-2)


class Push(LanesLaw):
    """Upwards with all that the actuator has."""

    def forces(self, observations):
        """Force of each lane, (lanes,), (N)."""
        return np.full(len(observations), 1e4)


def test_a_pass_that_ends_early_has_no_figures_beside_others_that_have():
    settings = run_settings(FEW | {"actuator": {"force_limit": 1000}})
    force = run_batch(settings, [Still(), Push()], [1, 2])
    assert np.isfinite(force.values[0]).all()
    assert np.isnan(force.values[1]).all()
    assert np.isnan([force.mean[1], force.std[1]]).all()


def test_residuals_are_of_sigma_and_of_the_mean_beside_the_passive_ones():
    force = run_batch(run_settings(FEW | REAL), [Still(), Skyhook(gains=(100.0, 0.0))], [2000, 2001])
    passive = force._replace(values=force.values[:1], mean=force.mean[:1], std=force.std[:1])
    costs = (residuals_of(force, passive) ** 2).sum(axis=1)
    off = (force.mean[1] / force.mean[0] - 1) / MEAN_TOLERANCE
    expected = np.mean((force.std[1] / force.std[0]) ** 2 + MEAN_WEIGHT * off**2)
    assert costs == pytest.approx([1.0, expected])


@pytest.mark.longer
def test_tuning_finds_gains_that_help_on_lines_it_has_not_seen():
    settings = run_settings(FEW | REAL)
    tuned = tune_at("skyhook", settings, 350.0, 1, 60)
    assert tuned.history[-1] < 0.8 < tuned.history[0]
    assert tuned.std_change < -0.1
    assert tuned.passes <= 60 + 11


@pytest.mark.longer
def test_gains_tuned_with_a_washout_are_for_policies_that_have_it(tmp_path):
    path, without = tmp_path / "own.toml", run_settings({"accuracy": "fast"} | REAL)
    made = Tuned(250.0, (0.1, 0.2, 0.3, 0.4), (1.0, 0.9), 10, -0.1, 0.0)
    names = list(tunable("tuned-pd", washout=1.0).TUNED)
    with_it = without.model_copy(update={"washout": 1.0})
    store(path, "tuned-pd", make_tuning(with_it, names, [made], [2000], "a command"))
    check_gain_file(path, "tuned-pd", without, force=False)
    washed = a_context(washout=1.0)
    assert find_gains(str(path), names, washed)[0] == 0.1
    with pytest.raises(InputError, match="only for a washout of 1 s, which the policy must then have"):
        find_gains(str(path), names, CONTEXT)
    other = replace(made, gains=(0.5, 0.2, 0.3, 0.4))
    store(path, "tuned-pd", make_tuning(without, names, [other], [2000], "a command"))
    assert [find_gains(str(path), names, each)[0] for each in (washed, CONTEXT)] == [0.1, 0.5]
    with pytest.raises(InputError, match="already holds gains"):
        check_gain_file(path, "tuned-pd", with_it, force=False)
    with pytest.raises(InputError, match=r"'lqg' has no gains to tune with a washout; .* are .*tuned-pd"):
        tunable("lqg", washout=1.0)


@pytest.mark.parametrize(
    ("name", "speed", "left"),
    [("fitted-fb+ff", 350.0, 0.65), ("periodic", 337.5, 0.85)],
)
def test_fitted_policies_calm_the_force_at_the_same_mean_also_between_tuned_speeds(name, speed, left):
    settings = {"speed_kmh": speed, "accuracy": "fast", "seed": 1003} | REAL
    passive, figures = (simulate(policy=policy, **settings).summary() for policy in (None, name))
    assert figures.std < left * passive.std
    assert figures.mean == pytest.approx(passive.mean, rel=MEAN_TOLERANCE)


FAMILY = {"catenary": "family:high-speed", "pantograph": "dsa380", "line_condition": "as-built"}
FAMILY |= {"actuator": "realistic", "sensors": "realistic", "accuracy": "fast", "speed_kmh": 275}


@pytest.mark.longer
def test_on_a_family_each_seed_has_its_own_line():
    """Forces of a batch beside those of single runs, which draw the same lines."""
    force = run_batch(run_settings(FAMILY), [Still(), Skyhook(gains=(200.0, 0.0))], [2001, 2002])
    assert force.values.shape[:2] == (2, 2)
    for law, k, policy in ((0, 0, None), (1, 1, Skyhook(gains=(200.0, 0.0)))):
        run = simulate(**FAMILY, observation="measured", seed=2001 + k, policy=policy)
        assert force.std[law, k] == pytest.approx(run.summary().std, rel=0.02)
        assert force.mean[law, k] == pytest.approx(run.summary().mean, rel=0.005)


def test_gains_of_a_family_are_for_any_line_that_has_none_of_its_own(tmp_path):
    settings = run_settings(FAMILY)
    tuned = Tuned(275.0, (150.0, 20.0), (1.0, 0.5), 40, -0.1, 0.0)
    path = tmp_path / "gains.toml"
    check_gain_file(path, "skyhook", settings, force=False)
    store(path, "skyhook", make_tuning(settings, list(Skyhook.TUNED), [tuned], (2000,), "test"))
    assert load_gains(path).tunings[0].catenary == "family:high-speed"
    given = {"catenary": "re330", "pantograph": "dsa380", "speed_kmh": 275.0}
    found = find_gains(str(path), list(Skyhook.TUNED), a_context(**given))
    np.testing.assert_allclose(found, tuned.gains, rtol=1e-4)
    with pytest.raises(InputError, match="already holds gains for dsa380 on family:high-speed"):
        check_gain_file(path, "skyhook", settings, force=False)
    with pytest.raises(InputError, match="no gains for the pantograph 'dsa250'"):
        find_gains(str(path), list(Skyhook.TUNED), a_context(**given | {"pantograph": "dsa250"}))
    own = run_settings(FAMILY | {"catenary": "re330"})
    other = replace(tuned, gains=(90.0, 10.0))
    store(path, "skyhook", make_tuning(own, list(Skyhook.TUNED), [other], (2000,), "test"))
    found = find_gains(str(path), list(Skyhook.TUNED), a_context(**given))
    np.testing.assert_allclose(found, other.gains, rtol=1e-4)  # its own go first


SMALL = ("--speed", "350", "--seeds", "1", "--passes", "11", "--workers", "1")


@pytest.mark.slow
def test_it_stores_gains_that_the_policy_then_finds(tmp_path, monkeypatch):
    file = tmp_path / "mine.toml"
    monkeypatch.setattr("sys.argv", ["/somewhere/panto", "tune", "skyhook", *SMALL])
    result = called(tune, "skyhook", *SMALL, "--sensors", "ideal", "--output", str(file), "--json")
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout[result.stdout.index("{") :])
    stored = load_gains(file)
    (kept,) = stored.tunings
    assert stored.policy == "skyhook"
    assert (kept.catenary, kept.pantograph, kept.place) == ("en50318-2002", "en50318-2002", "frame")
    assert (kept.speeds_kmh, kept.names) == ((350.0,), ("frame", "head"))
    assert printed["gains"] == [list(kept.gains[0])]
    assert kept.seeds == (seeds.TRAINING[0],)
    assert kept.command == f"panto tune skyhook {' '.join(SMALL)}"
    assert kept.actuator["lag"] > 0  # "realistic" unless told otherwise
    assert kept.sensors["force_noise"] == 0
    # The passive run, and one iteration: gains as they are, each changed alone, and each damping.
    assert kept.passes == 1 + 1 + 2 + len(DAMPINGS)
    assert kept.std_change[0] < -0.1
    run = REAL | {"speed_kmh": 350.0, "sensors": "ideal", "seed": seeds.SELECTION[0]}
    passive, controlled = (
        simulate(policy=policy, **run).summary() for policy in (None, f"skyhook:gains='{file}'")
    )
    assert controlled.std / passive.std - 1 == pytest.approx(kept.std_change[0], abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("pd",), "'pd' has no gains to tune; policies with gains are"),
        (("skyhook", "--output", "gains.json"), ".toml"),
        (("skyhook", "--output", "{lqg}"), "holds gains of 'lqg'; give another --output"),
    ],
)
def test_what_it_cannot_do_is_said_at_once(tmp_path, arguments, words, monkeypatch):
    file = tmp_path / "lqg.toml"
    file.write_text('policy = "lqg"\n')
    monkeypatch.setattr(command, "tune_speeds", None)  # nothing may be run
    result = called(tune, *(each.format(lqg=file) for each in arguments), *SMALL)
    assert result.exit_code != 0
    assert words in str(result.exception)
    assert file.read_text() == 'policy = "lqg"\n'


@pytest.mark.slow
def test_parts_of_another_tuning_are_not_taken(tmp_path):
    settings = run_settings({"catenary": "periodic-stiffness", "pantograph": "three-mass"})
    given = {"speeds_kmh": (250.0,), "passes": 11, "workers": 1}
    first = tune_speeds(tmp_path, "skyhook", settings, seeds=1, **given)
    assert tune_speeds(tmp_path, "skyhook", settings, seeds=1, **given) == first
    with pytest.raises(InputError, match=r"holds parts of another work \(its seeds is 1, this is 2\)"):
        tune_speeds(tmp_path, "skyhook", settings, seeds=2, **given)
    with pytest.raises(InputError, match=r"holds parts of another work \(its passes is 11, this is 12\)"):
        tune_speeds(tmp_path, "skyhook", settings, seeds=1, **given | {"passes": 12})
    part = tmp_path / "250.0.json"
    part.write_text(part.read_text().replace("0.", "1.", 1))
    assert tune_speeds(tmp_path, "skyhook", settings, seeds=1, **given) == first  # damage: anew
