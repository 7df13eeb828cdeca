"""Records that can't be a rig's are refused with the likely mistake; what explains nothing is not written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from panto_env import InputError
from panto_env.catalog import load_pantograph
from panto_env.cli import make_app
from panto_env.identification import (
    EXPERIMENTS,
    FREQUENCY_SWEEP,
    IDENTIFIED,
    MEASURED,
    OUTPUT_ERROR,
    PRINTED,
    Fit,
    add_noise,
    clean_record,
    excited_band,
    fit_output_error,
    identify,
    matches,
    parameters_of,
    read_record,
    write_pantograph,
    write_record,
)
from panto_env.identification.plausibility import check_record

TRUTH = parameters_of(load_pantograph("identified-2dof"))
KNOWN = {name: TRUTH[name] for name in MEASURED}
KNOWN_TEXT = ("--measured", "k1T=32992 m2=5 k2=14544")


def noisy(excitation, duration=20.0):
    return add_noise(clean_record(excitation, TRUTH, duration=duration), np.random.default_rng(0))


RECORD = noisy(FREQUENCY_SWEEP)


def changed(record, **factors):
    return replace(record, **{name: factor * getattr(record, name) for name, factor in factors.items()})


@pytest.mark.parametrize("excitation", [*EXPERIMENTS, FREQUENCY_SWEEP], ids=lambda each: each.name)
def test_records_of_the_rig_pass(excitation):
    check_record(noisy(excitation), KNOWN)
    check_record(replace(noisy(excitation), force=None), KNOWN)


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"time_step": 1e-3}, "20,001 samples in 0.02 s, 1e.06 a second, .*: seconds in a column of ms"),
        ({"time_step": 1e3}, "1 a second, .*: milliseconds in a column of s"),
        ({"plate": 1e3, "head": 1e3, "support": 1e3}, "y_p1 holds displacements of 55.3 m, .*: mm in a"),
        ({"plate": 1e-3, "head": 1e-3, "support": 1e-3}, "y_p1 moves by 1.99 µm only, .*: metres in a"),
        ({"head": 20.0, "plate": 0.5}, "y_p2 moves .* times as far as y_p1"),
        ({"support": 1e-3}, "y_p3 moves 1/.* as far as y_p1: are both in the units"),
        ({"force": 1e3}, "force holds .* N, which no pantograph bears: newtons in a column of kN"),
        ({"force": 1e-4}, "force changes by .* N only: kilonewtons in a column of N"),
        ({"head": -1.0}, "y_p2 falls as y_p1 rises, .*: one of them seems to point the other way"),
        ({"support": -1.0}, "y_p3 falls as y_p2 rises"),
        ({"plate": -1.0, "head": -1.0, "support": -1.0}, "force falls as .*: heights seem to point up"),
        ({"force": -1.0}, "force falls as the plate presses further in"),
    ],
)  # fmt: skip
def test_the_likely_mistake_is_named(factors, message):
    with pytest.raises(InputError, match=message):
        identify(changed(RECORD, **factors), KNOWN)


def test_a_head_higher_than_any_reaches_is_refused_however_little_it_moves():
    """Below 3 m it is taken; the record's own displacements are some centimetres."""
    check_record(replace(RECORD, head=RECORD.head + 2.8), KNOWN)
    with pytest.raises(InputError, match=r"y_p2 holds displacements of 3\.\d* m, which no pantograph makes"):
        check_record(replace(RECORD, head=RECORD.head + 3.1), KNOWN)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"k1T": 32.992}, "k1T must be a number from 1,000 to 1e.06 N/m, not 32.992"),
        ({"m2": 5000.0}, "m2 must be a number from 0.1 to 200 kg, not 5000"),
        ({"k1T": 32.992e5}, r"k1T must be a number from 1,000 to 1e\+06 N/m, not 3.2992e\+06"),
        ({"k1T": 1.0e3}, "the compression of the contact spring does: is k1T in N/m"),
    ],
)
def test_known_values_in_other_units_are_named(known, message):
    with pytest.raises(InputError, match=message):
        identify(RECORD, KNOWN | known)


def test_a_fit_of_what_is_no_motion_of_such_a_model_ends():
    """Time in s read as ms: the motion is a thousand times as quick as any such pantograph's."""
    record = changed(RECORD, time_step=1e-3)
    with pytest.raises(InputError, match=r"output-error fit (diverges|does not settle)"):
        fit_output_error(record, KNOWN, band=excited_band(record))


def test_impossible_values_are_marked():
    sine = identify(noisy(EXPERIMENTS[0]), KNOWN)
    printed, fitted = sine.fits[PRINTED], sine.fits[OUTPUT_ERROR]
    assert set(printed.impossible) == {"c1T", "c2", "m3"}  # a frame of 0.1 kg, and negative dampers
    assert printed.as_dict()["impossible"] == list(printed.impossible)
    assert fitted.impossible == ()


@pytest.fixture
def panto(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("panto_env.terminal.console._width", 120)

    def run(record, *arguments):
        write_record(record, "rig.csv")
        result = CliRunner().invoke(make_app(), ["identify", "rig.csv", *KNOWN_TEXT, *arguments])
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.output

    return run


def test_marks_are_printed_and_in_the_json(panto):
    sine = noisy(EXPERIMENTS[0])
    shown = panto(sine)
    assert "impossible: -" in shown
    assert "no pantograph has that" in shown
    told = json.loads(panto(sine, "--json"))
    assert set(told["fits"]["equation-error"]["impossible"]) == {"c1T", "c2", "m3"}


def test_what_a_record_cannot_determine_is_said_beside_the_values(panto):
    """One sine cannot tell the spring from the mass."""
    shown = " ".join(panto(noisy(EXPERIMENTS[0]), "--free-offset").split())
    assert "k3 not determined, the 95 % interval holds 0" in shown


def test_a_method_that_finds_nothing_hides_no_other_unless_its_fit_is_wanted(panto, monkeypatch):
    failing = identify(RECORD, KNOWN)
    del failing.fits[OUTPUT_ERROR]
    failing.failures[OUTPUT_ERROR] = "it does not settle."
    monkeypatch.setattr("panto_env.identification.identify", lambda *_, **__: failing)
    assert "low-passed" in panto(RECORD)
    with pytest.raises(InputError, match=r"Output error: it does not settle"):
        panto(RECORD, "--output", "mine.toml")
    failing.fits.clear()
    with pytest.raises(InputError, match=r"Output error: it does not settle"):
        panto(RECORD)


OTHER = replace(
    RECORD,
    support=0.05
    + 0.5e-3 * np.sin(2 * np.pi * 0.77 * RECORD.time + 1.0)
    + 0.5e-3 * np.sin(2 * np.pi * 3.1 * RECORD.time),
)
"""With the frame of another rig: its motion has nothing to do with this plate's."""


def test_no_pantograph_is_written_from_a_model_that_explains_nothing(tmp_path):
    """All its values are possible: they are the true ones."""
    values = np.array([TRUTH[name] for name in IDENTIFIED])
    fit = Fit(OUTPUT_ERROR, KNOWN, IDENTIFIED, values, 0.01 * values, 10.0, 10.0)
    told = {"record": "rig.csv", "static_force": 54.0, "force_source": "own choice"}
    path = tmp_path / "mine.toml"
    with pytest.raises(InputError, match=r"does not explain the motion of y_p3 .fitting performance -"):
        write_pantograph(fit, path, matches=matches(OTHER, fit.parameters), **told)
    assert not path.exists()
    write_pantograph(fit, path, matches=matches(RECORD, fit.parameters), **told)
    assert load_pantograph(str(path)).masses == (5.0, TRUTH["m3"])


def test_the_command_writes_none_of_a_frame_of_another_rig(panto, tmp_path):
    with pytest.raises(InputError, match=r"so none is written"):
        panto(OTHER, "--output", "mine.toml", "--method", "low-passed")
    assert not (tmp_path / "mine.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--measured", "m2=6"], "m2 is given twice, as 5 and as 6"),
        (["--output", "mine.toml", "--static-force", "-5"], "static force must be a number from 0 to 1000 N"),
    ],
)
def test_options_that_make_no_sense_are_refused(panto, tmp_path, arguments, message):
    with pytest.raises(InputError, match=message):
        panto(RECORD, *arguments)
    assert not (tmp_path / "mine.toml").exists()


def test_a_file_in_other_units_is_refused_with_the_heading_in_mind(tmp_path):
    path = tmp_path / "rig.csv"
    write_record(RECORD, path)
    path.write_text(path.read_text().replace("time (s)", "time (ms)").replace("(mm)", "(m)"))
    with pytest.raises(InputError, match="seconds in a column of ms"):
        identify(read_record(path), KNOWN)


@pytest.mark.parametrize("band", ["nan", "-1", "0"])
def test_a_band_is_a_frequency(panto, band):
    with pytest.raises(InputError, match="The band must be a frequency above 0 Hz"):
        panto(RECORD, "--band", band)
