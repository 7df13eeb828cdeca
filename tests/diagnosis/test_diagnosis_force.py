"""The force that a diagnosis is made from, and what is refused of the runs that it is estimated from."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.catalog import load_pantograph
from panto_env.cli import make_app
from panto_env.diagnosis import diagnose, estimated_force
from panto_env.diagnosis.passes import known_pantograph
from panto_env.metrics.low_pass import zero_phase_low_pass


@pytest.fixture(scope="module")
def runs(healthy_runs):
    return healthy_runs[:4]


def error_of(run, seed=0, pantograph=None):
    """Of the estimate, within 0 to 20 Hz and once its start is forgotten."""
    error = estimated_force(run, seed, pantograph) - zero_phase_low_pass(run.contact_force, run.time_step)
    return error[run.inside()]


def test_the_estimate_is_the_force_to_20_hz():
    """Of a pantograph that is as it is known: what is left is the noise of displacements."""
    run = simulate("en50318-2002", "dsa380", 250.0, accuracy="fast", record_droppers=False)
    error = error_of(run)
    assert abs(error.mean()) < 0.3
    assert 0.05 < error.std() < 0.8
    assert run.summary().std > 30 * error.std()
    assert not np.array_equal(error, error_of(run, seed=1))


@pytest.mark.longer
def test_the_estimator_knows_the_pantograph_as_designed(runs):
    """And not as it was drawn: that costs more than noise does, and the catalogue's values are used."""
    as_designed = error_of(runs[0])
    assert np.array_equal(as_designed, error_of(runs[0], pantograph=load_pantograph("dsa250")))
    assert 0.8 < as_designed.std() < 6.0
    design = load_pantograph("dsa250")
    heavy = design.model_copy(update={"masses": (1.5 * design.masses[0], *design.masses[1:])})
    assert error_of(runs[0], pantograph=heavy).std() > 1.3 * as_designed.std()


@pytest.mark.longer
def test_displacements_and_forces_are_all_that_is_looked_at(runs):
    none = np.full(len(runs[0].time), np.nan)
    blind = replace(runs[0], head_velocity=none, frame_velocity=none, contact_force=none, wire=none)
    assert np.array_equal(estimated_force(runs[0], 0), estimated_force(blind, 0))


def unknown(run):
    """The run with a name alone for its pantograph."""
    settings = {key: value for key, value in run.settings.items() if key != "known_pantograph"}
    return replace(run, pantograph="mine", settings=settings, design={})


def test_a_run_s_pantograph_is_known_by_its_values_not_by_its_name(runs):
    """One in a file of the same name as a pantograph of the catalogue had been taken for that."""
    design = load_pantograph("dsa250")
    mine = design.model_copy(update={"masses": (1.5 * design.masses[0], *design.masses[1:])})
    own = replace(unknown(runs[0]), pantograph="dsa250", design={"pantograph": mine.model_dump(mode="json")})
    assert known_pantograph(own).masses == mine.masses
    assert np.array_equal(error_of(own), error_of(runs[0], pantograph=mine))


def with_value(run, name, place, value):
    values = getattr(run, name).copy()
    values[place] = value
    return replace(run, **{name: values})


def gap(run):
    kept = np.ones(len(run.time), dtype=bool)
    kept[5000:5500] = False
    series = ("time", "position", "contact_force", "head", "frame", "frame_force", "head_force")
    return replace(run, **{name: getattr(run, name)[kept] for name in series})


REFUSED = {
    "a gap": (gap, r"Time steps are not equal \(they run from 0.002 to 1.002 s\)"),
    "clock set forward": (
        lambda r: replace(r, time=r.time + 3.0 * (r.time > 9)),
        r"Time steps are not equal .* to 3.002 s",
    ),
    "clock set back": (lambda r: replace(r, time=r.time - 3.0 * (r.time > 9)), "Time does not increase at"),
    "time in ms": (lambda r: replace(r, time=1e3 * r.time), "are 2 s apart, not 0.002 s as the run states"),
    "no time": (lambda r: replace(r, time=r.time * np.nan), "are nan s apart"),
    "position is no number": (
        lambda r: with_value(r, "position", 700, np.nan),
        "position is no number somewhere; leave the run out",
    ),
    "position in km": (
        lambda r: replace(r, position=r.position / 1e3),
        r"positions go at {slow:.4g} km/h in the mean, not evenly at the {speed:.4g} km/h that it states",
    ),
    "position slips": (
        lambda r: replace(r, position=r.position + 20.0 * (r.time > 9)),
        "not evenly at the",
    ),
    "dead": (lambda r: with_value(r, "head", slice(6000, 6100), 0.03), "Column head stays .* dead"),
    "pantograph is not known": (
        lambda r: unknown(r),
        "not hold the masses and springs of its pantograph 'mine', .* its TOML file with --pantograph",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_runs_that_no_force_can_be_estimated_from_are_refused(runs, case):
    spoil, message = REFUSED[case]
    message = message.format(slow=runs[0].speed_kmh / 1e3, speed=runs[0].speed_kmh)
    with pytest.raises(InputError, match=f"^Run 1: .*{message}") as refused:
        diagnose([spoil(runs[0])], runs[1:])
    told = str(refused.value)
    assert "\n" not in told
    assert told.endswith((".", "?"))


def test_a_run_shorter_than_a_span_says_how_far_to_run(runs):
    cut = {
        name: getattr(runs[0], name)[:400]
        for name in ("time", "position", "contact_force", "head", "frame", "frame_force", "head_force")
    }
    short = replace(runs[0], **cut)
    with pytest.raises(InputError, match=rf"ends at {short.distance:.4g} m, .* run 610 m or more"):
        diagnose([short], runs[1:])


@pytest.mark.slow
def test_the_command_takes_the_pantograph_that_is_known(runs, tmp_path):
    """One whose values the run does not hold is known by its file; what it is changes what is estimated."""
    files = []
    for k, run in enumerate(runs):
        files.append(str(tmp_path / f"run{k}.parquet"))
        none = np.zeros((len(run.time), len(run.dropper_position)))
        whole = replace(unknown(run), dropper_force=none)
        whole.save(files[-1])
    call = ["diagnose", files[0], "--healthy", *files[1:], "--json"]
    refused = CliRunner().invoke(make_app(), call)
    assert "its TOML file with --pantograph" in str(refused.exception)
    told = CliRunner().invoke(make_app(), [*call, "--pantograph", "dsa250"])
    assert told.exit_code == 0, told.output
    other = CliRunner().invoke(make_app(), [*call, "--pantograph", "three-mass"])
    assert other.stdout != told.stdout
    wrong = CliRunner().invoke(make_app(), [*call, "--pantograph", "dsa25"])
    assert "did you mean 'dsa250'" in str(wrong.exception)


def test_a_healthy_run_is_named_by_its_number(runs):
    with pytest.raises(InputError, match=r"^Healthy run 2: Column head stays at one value"):
        diagnose(runs[:1], [runs[1], replace(runs[2], head=0 * runs[2].head), runs[3]])
