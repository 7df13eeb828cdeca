"""What the identification says beside its values, worked out another way, and every bound of a record."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from panto_env import InputError
from panto_env.catalog import load_pantograph
from panto_env.identification import (
    EXPERIMENTS,
    FILTERED,
    FREQUENCY_SWEEP,
    IDENTIFIED,
    OUTPUT_ERROR,
    PRINTED,
    Fit,
    Identification,
    Match,
    Record,
    add_noise,
    band_limited,
    clean_record,
    equations,
    excited_band,
    fit_equation_error,
    fit_output_error,
    identify,
    write_pantograph,
    write_record,
)
from panto_env.identification.methods import solve
from panto_env.identification.record import _check_time, check_record

from ..command import panto as command
from .test_identification import KNOWN, TRUE, TRUTH


def noisy(excitation, duration=10.0):
    return add_noise(clean_record(excitation, TRUTH, duration=duration), np.random.default_rng(0))


RECORD = noisy(FREQUENCY_SWEEP)


@pytest.mark.parametrize("free_offset", [False, True])
@pytest.mark.parametrize("stride", [1, 7])
def test_a_linear_fit_is_ordinary_least_squares_with_its_textbook_errors(free_offset, stride):
    """By the normal equations, with a column of ones for each of the two equations where they are offset."""
    fit = solve(RECORD, KNOWN, stride, free_offset, FILTERED)
    a, y = (each[:, ::stride] for each in equations(RECORD, KNOWN))
    ones = np.repeat(np.eye(2), a.shape[1], axis=0)[:, : 2 * free_offset]
    columns, y = np.column_stack([a.reshape(-1, 5), ones]), y.ravel()
    values, (squares,), *_ = np.linalg.lstsq(columns / (size := np.linalg.norm(columns, axis=0)), y)
    variance = squares / (len(y) - columns.shape[1])
    covariance = variance * np.linalg.inv(columns.T @ columns)
    np.testing.assert_allclose(fit.values, (values / size)[:5], rtol=1e-6)
    np.testing.assert_allclose(fit.std, np.sqrt(np.diag(covariance))[:5], rtol=1e-6)
    if not free_offset:
        assert fit.condition == pytest.approx(np.linalg.cond(columns))
        assert fit.dependence == pytest.approx(np.linalg.cond(columns / size))


def test_a_value_that_is_known_is_taken_out_of_the_equations():
    """The others are then as if its column had been subtracted."""
    known = KNOWN | {"m3": TRUTH["m3"], "c2": 120.0}
    fit = fit_equation_error(RECORD, known)
    assert fit.method == "equation error"
    assert fit_equation_error(RECORD, known, band=5.0).method == "equation error, low-passed"
    a, y = equations(RECORD, KNOWN)
    y = (y - a[:, :, 1] * 120.0 - a[:, :, 2] * TRUTH["m3"]).ravel()
    values = np.linalg.lstsq(a.reshape(-1, 5)[:, [0, 3, 4]], y)[0]
    assert fit.names == ("c1T", "c3", "k3")
    np.testing.assert_allclose(fit.values, values, rtol=1e-6)
    assert fit.parameters == KNOWN | {"m3": TRUTH["m3"], "c2": 120.0} | dict(
        zip(fit.names, fit.values, strict=True)
    )


def test_an_interval_holds_95_per_cent_and_says_whether_0_is_in_it():
    values, std = np.array([1.0, -2.0, 30.0, -4.0, 0.5]), np.array([0.6, 0.5, 20.0, 2.0, 0.255])
    fit = Fit(OUTPUT_ERROR, KNOWN, IDENTIFIED, values, std, 9.0, 3.0)
    low, high = fit.interval.T
    np.testing.assert_allclose(norm.cdf((high - values) / std), 0.975)
    np.testing.assert_allclose(norm.cdf((low - values) / std), 0.025)
    np.testing.assert_allclose(fit.rsd, [60, 25, 200 / 3, 50, 51])
    holds = {name for name, one, other in zip(IDENTIFIED, low, high, strict=True) if one < 0 < other}
    assert set(fit.undetermined) == holds == {"c1T", "m3"}
    told = fit.as_dict()["parameters"]["c2"]
    assert (told["value"], told["low"], told["high"]) == (-2.0, low[1], high[1])


def test_a_band_is_limited_around_its_middle_and_keeps_the_time_of_its_samples():
    """A cosine at the band's edge comes out as it went in, sample for sample; one of thrice that is gone."""
    time = 1e-3 * np.arange(6000)
    slow, quick = np.cos(2 * np.pi * 2.0 * time), np.cos(2 * np.pi * 6.5 * time)
    kept, stride = band_limited(Record(1e-3, 0.3 + slow, slow + quick, quick, slow, 5.0), 2.0)
    inside = slice(round((kept.start - 5.0) / 1e-3), None)
    for ours, wanted in (
        (kept.plate, 0.3 + slow),
        (kept.head, slow),
        (kept.support, 0 * slow),
        (kept.force, slow),
    ):
        np.testing.assert_allclose(ours, wanted[inside][: len(ours)], atol=3e-3)
    assert stride == 166  # 1,000 samples a second over six per second, of noise up to 3 Hz


@pytest.mark.parametrize("channel", ["y_p2", "y_p3"])
def test_a_model_must_explain_the_displacements_that_it_was_identified_from(channel, tmp_path):
    """By half or more; what the force drives, and the force itself, are not what was fitted."""
    fit = Fit(OUTPUT_ERROR, KNOWN, IDENTIFIED, TRUE, 0.01 * TRUE, 10.0, 10.0)
    recorded = np.sin(np.arange(100.0))
    recorded -= recorded.mean()
    path = tmp_path / "mine.toml"

    def write(channel, driven_by, share):
        matches = [Match("y_p2", "plate", recorded, recorded)]
        matches.append(Match(channel, driven_by, recorded, share * recorded))
        told = {"record": "rig.csv", "static_force": 54.0, "force_source": "own choice"}
        write_pantograph(fit, path, matches=matches, **told)

    with pytest.raises(InputError, match=f"does not explain the motion of {channel} "):
        write(channel, "plate", 0.49)
    assert not path.exists()
    for explained in ((channel, "plate", 0.51), (channel, "force", 0.49), ("force", "plate", 0.49)):
        write(*explained)
    assert load_pantograph(str(path)).masses == (5.0, TRUTH["m3"])


def made(n=2000, step=1e-3, plate=2e-3, head=1.8e-3, support=1.5e-3, force=1.0, **other):
    """A record of a sine, swings in m from end to end; head_with, support_with: correlations."""
    angle = 2 * np.pi * other.get("periods", 1) * np.arange(n) / n
    wave, across = np.sin(angle), np.cos(angle)

    def along(correlation):
        return correlation * wave + np.sqrt(1 - correlation**2) * across

    y1, y2 = plate / 2 * wave, head / 2 * along(other.get("head_with", 1.0))
    y3 = support / 2 * along(other.get("support_with", 1.0)) + other.get("high", 0.0)
    spring = KNOWN["k1T"] * (y1 - y2)
    if "force_with" in other:
        spring = KNOWN["k1T"] * 1e-4 * along(other["force_with"])
    pushes = force * spring + other.get("weight", 0.0)
    return Record(step, y1, y2, y3, pushes)


def frame(periods):
    """A frame that goes against the head, so many times in 2 s."""
    return made(periods=periods, support_with=-0.9)


SLOWEST = 1 / 30**1.5
EDGES = {  # a record by a factor that is 1 on the bound, and what is said of one beyond
    "quick": (lambda f: made(n=40_000, step=1 / (50e3 * f)), "seconds in a column of ms"),
    "slow": (lambda f: made(n=100, step=0.1 * f), "milliseconds in a column of s"),
    "short": (lambda f: made(n=500, step=1e-3 / f), "seconds in a column of ms"),
    "long": (lambda f: made(n=40_000, step=0.09 * f), "milliseconds in a column of s"),
    "far": (lambda f: made(high=3.0 * f - 0.75e-3), "y_p3 holds displacements of 3"),
    "wide": (lambda f: made(plate=0.5 * f, head=0.4, support=0.4), "y_p1 holds a motion of 0.5"),
    "still plate": (lambda f: made(plate=20e-6 / f, head=25e-6, support=25e-6), "y_p1 moves by 19.9"),
    "still head": (lambda f: made(plate=25e-6, head=20e-6 / f, support=25e-6), "y_p2 moves by 19.9"),
    "head ahead": (lambda f: made(plate=3e-3, head=90e-3 * f), "y_p2 moves 30"),
    "head behind": (lambda f: made(plate=30e-3, head=1e-3 / f), "y_p2 moves 1/30"),
    "frame ahead": (lambda f: made(plate=3e-3, support=90e-3 * f), "y_p3 moves 30"),
    "frame behind": (lambda f: made(plate=9e-2, head=8e-2, support=9e-2 * SLOWEST / f), "y_p3 moves 1/16"),
    "against": (lambda f: made(head_with=-0.5 * f), "y_p2 falls as y_p1 rises"),
    "frame against": (lambda f: made(support_with=-0.5 * f), "y_p3 falls as y_p2 rises"),
    "pull": (lambda f: made(force_with=-0.5 * f), "force falls as the plate presses"),
    "heavy": (lambda f: made(weight=3000 * f - 3.3), "newtons in a column of kN"),
    "light": (lambda f: made(force=0.01 / (KNOWN["k1T"] * 2e-4) / f, force_with=0.3), "force changes by"),
    "strong": (lambda f: made(force=30 * f), "is k1T in N/m"),
    "weak": (lambda f: made(force=1 / (30 * f)), "is k1T in N/m"),
}  # fmt: skip


@pytest.mark.parametrize("name", EDGES)
def test_a_record_is_taken_up_to_each_bound_and_refused_beyond(name):
    record, message = EDGES[name]
    check_record(record(0.995), KNOWN)
    with pytest.raises(InputError, match=message):
        check_record(record(1.005), KNOWN)


def test_a_frame_must_follow_the_head_below_the_frequency_of_the_heaviest():
    """Of 50 kg on k2: 2.71 Hz, 5.4 periods in 2 s."""
    for periods in (3, 5):
        with pytest.raises(InputError, match="y_p3 falls as y_p2 rises"):
            check_record(frame(periods), KNOWN)
    check_record(frame(6), KNOWN)


def test_two_million_samples_are_the_most():
    _check_time(SimpleNamespace(plate=range(2_000_000), time_step=1e-3))
    with pytest.raises(InputError, match="2,000,000 at most"):
        _check_time(SimpleNamespace(plate=range(2_000_001), time_step=1e-3))


@pytest.mark.longer
def test_a_fit_of_what_is_no_motion_of_such_a_model_ends():
    """Time in s read as ms: the motion is a thousand times as quick as any such pantograph's."""
    record = replace(RECORD, time_step=1e-3 * RECORD.time_step)
    with pytest.raises(InputError, match=r"output-error fit (diverges|does not settle)"):
        fit_output_error(record, KNOWN, band=excited_band(record))


@pytest.fixture
def panto(tmp_path):
    """A function that runs `panto identify` on a record, and gives its status and all that it said."""

    def run(record, *arguments):
        write_record(record, tmp_path / "rig.csv")
        done = command(
            "identify", "rig.csv", "--measured", "k1T=32992 m2=5 k2=14544", *arguments, cwd=tmp_path
        )
        assert done.returncode in (0, 2)
        assert done.returncode == 0 or sorted(tmp_path.iterdir()) == [tmp_path / "rig.csv"]
        return done.returncode, done.stdout + " ".join(done.stderr.split())

    return run


@pytest.mark.parametrize("options", [(), ("--plot", "a.png"), ("--output", "a.toml")])
def test_a_model_that_cannot_be_simulated_is_said_unless_a_file_needs_it(options, panto, monkeypatch):
    def unstable(*_):
        raise InputError("The model is not stable.")

    fit = Fit(OUTPUT_ERROR, KNOWN, IDENTIFIED, TRUE, 0.01 * TRUE, 10.0, 10.0)
    found = Identification(4.0, {OUTPUT_ERROR: fit}, {})
    monkeypatch.setattr("panto_env.identification.identify", lambda *_, **__: found)
    monkeypatch.setattr("panto_env.identification.matches", unstable)
    status, said = panto(RECORD, *options)
    assert status == (2 if options else 0)
    assert "The model is not stable." in said


@pytest.mark.longer
def test_what_a_record_cannot_determine_is_marked_and_said(panto):
    """One sine cannot tell the spring from the mass."""
    sine = noisy(EXPERIMENTS[0], 20.0)
    found = identify(sine, KNOWN)
    assert set(found.fits[PRINTED].impossible) == {"c1T", "c2", "m3"}  # a frame of 0.1 kg, negative dampers
    assert found.fits[OUTPUT_ERROR].impossible == ()
    told = json.loads(panto(sine, "--json")[1].partition("\n}")[0] + "\n}")
    assert set(told["fits"]["equation-error"]["impossible"]) == {"c1T", "c2", "m3"}
    _, shown = panto(sine, "--free-offset")
    for words in ("impossible: -", "no pantograph has that", "k3 not determined, the 95 % interval holds 0"):
        assert words in " ".join(shown.split())


@pytest.mark.longer
def test_a_method_that_finds_nothing_hides_no_other_unless_its_fit_is_wanted(panto, monkeypatch):
    failing = identify(RECORD, KNOWN)
    del failing.fits[OUTPUT_ERROR]
    failing.failures[OUTPUT_ERROR] = "it does not settle."
    monkeypatch.setattr("panto_env.identification.identify", lambda *_, **__: failing)
    assert "low-passed" in panto(RECORD)[1]
    for arguments in (("--output", "mine.toml"), ()):
        status, said = panto(RECORD, *arguments)
        assert status == 2
        assert "Output error: it does not settle" in said
        failing.fits.clear()


@pytest.mark.longer
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--measured", "m2=6"), "m2 is given twice, as 5 and as 6"),
        (("--output", "a.toml", "--static-force", "-5"), "must be a number from 0 to 1000 N"),
        (("--band", "nan"), "The band must be a frequency above 0 Hz"),
        (("--band", "0"), "The band must be a frequency above 0 Hz"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, message, panto):
    status, said = panto(RECORD, *arguments)
    assert status == 2
    assert message in said
