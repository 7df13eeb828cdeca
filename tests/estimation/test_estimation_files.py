"""Records, refusals, verdicts and the command, on a simulated pass."""

import dataclasses
import json
import re

import numpy as np
import pyarrow.parquet as pq
import pytest

from panto_env import InputError
from panto_env.cli.estimate import _scores_table
from panto_env.estimation.estimate import Score, phases
from panto_env.estimation.motion import SHORTEST, measure, read_motion, write_motion
from panto_env.studies.paper2.estimation import OBSERVATIONS, filtered, known_pantograph, settled_scores

from ..command import panto


@pytest.fixture(scope="module")
def record(motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("train") / "record.csv"
    write_motion(motion, path)
    return path


def test_a_measurement_is_the_run_with_noise(run):
    clean = measure(run, displacement_noise=0.0, velocity_noise=0.0)
    seen = measure(run, seed=3)
    assert seen.time_step == pytest.approx(1e-3)
    for name, noise in (("head", 2e-5), ("frame", 2e-5), ("head_velocity", 5e-3), ("frame_velocity", 5e-3)):
        added = getattr(seen, name) - getattr(clean, name)
        assert added.std() == pytest.approx(noise, rel=0.03)
        assert abs(np.corrcoef(added[1:], added[:-1])[0, 1]) < 0.03
        between = np.interp(clean.time, run.time, getattr(run, name))
        np.testing.assert_allclose(getattr(clean, name), between, atol=2e-3 * np.ptp(between))
    np.testing.assert_array_equal(measure(run, seed=3).head, seen.head)
    assert not np.array_equal(measure(run, seed=4).head, seen.head)
    # A cubic through the heights moves as the velocities say.
    moved = np.cumsum(clean.head_velocity) * clean.time_step
    np.testing.assert_allclose(np.diff(clean.head), np.diff(moved), atol=1e-5)
    # The true force is a mean over the sampling interval: its sum is that of the run.
    begin, end = clean.time[0] - 5e-4, clean.time[-1] + 5e-4
    inside = (run.time > begin) & (run.time < end)
    assert clean.contact_force.sum() * 1e-3 == pytest.approx(run.contact_force[inside].sum() * 5e-4, rel=1e-4)
    assert (clean.lift, clean.span, clean.speed) == (120.0, 60.0, pytest.approx(250 / 3.6))
    assert len(measure(run, rate=200.0).head) == pytest.approx(len(clean.head) / 5, abs=2)


def test_known_forces_are_those_until_the_next_sample(run):
    """A step of an actuator's force half way between samples is half a step in that interval."""
    acting = np.where(run.time > 3.0005, 10.0, 0.0)
    seen = measure(dataclasses.replace(run, frame_force=acting, head_force=-acting))
    before = int(np.searchsorted(seen.time, 3.0005)) - 1
    share = 10 * (seen.time[before] + 1e-3 - 3.0005) / 1e-3
    np.testing.assert_allclose(seen.frame_force[before - 1 : before + 2], [0.0, share, 10.0], atol=1e-6)
    np.testing.assert_array_equal(seen.head_force, -seen.frame_force)


@pytest.mark.longer
def test_the_bar_of_the_estimator(run):
    """250 km/h, 120 N static, noise of real sensors, parameters 5 % wrong: above 0.97 in 0 to 20 Hz."""
    delays = {}
    for observation in OBSERVATIONS:
        scores = []
        seen = measure(run)
        force = filtered("random-walk", 0.0, seen, known_pantograph(0), observation)
        scores.append(settled_scores(seen, force)[-1])
        delays[observation] = 1e3 * np.mean([each.delay for each in scores])
        assert min(each.correlation for each in scores) > (0.97 if "velocities" in observation else 0.94)
    assert 2.0 < delays[OBSERVATIONS[0]] < 3.5
    assert 4.2 < delays[OBSERVATIONS[1]] < 6.0


@pytest.mark.slow
def test_the_command_prints_compares_and_writes(record, tmp_path, monkeypatch):
    monkeypatch.setattr("panto_env.terminal.console._width", 200)
    output, picture = tmp_path / "force.parquet", tmp_path / "force.png"
    shown = panto(
        "estimate", record, "--pantograph", "own-two-mass", "--output", output, "--plot", picture, "--json"
    )
    assert shown.returncode == 0, shown.stderr
    told = json.loads(shown.stdout)
    assert told["mean"] == pytest.approx(116.4, abs=0.5)
    assert told["std"] == pytest.approx(27.4, abs=1.0)
    assert told["believe"] is True
    assert [test["kept"] for test in told["tests"]] == 4 * [True]
    assert "nis_bounds" not in told  # it is not judged by these
    assert told["scores"][-1]["correlation"] > 0.97
    table = pq.read_table(output)
    assert table.column_names == ["time", "contact_force", "nis"]
    assert np.mean(table["nis"].to_numpy()) == pytest.approx(told["nis"], rel=0.05)
    assert picture.stat().st_size > 10_000
    shown = panto(
        "estimate", record, "--pantograph", "own-two-mass", "--displacements", "--speed", "250",
        "--span", "60", "--force-model", "periodic", "--lag", "0.1",
    )  # fmt: skip
    assert shown.returncode == 0, shown.stderr
    assert "from displacements, periodic" in " ".join(shown.stdout.split())
    words = " ".join(shown.stdout.split())
    for bounds in ("0.667 to 1.5", "up to 2.5", "-0.6 to 0.6", "-20 to 20"):
        assert bounds in words
    assert "all within these bounds" in words


def test_a_table_of_scores_has_the_units_of_its_headings():
    table = _scores_table([Score(20.0, 1.25, 3.5, 0.987, 0.12345, 4.0, 0.0)])
    assert table.headings == ("band", "bias (N)", "rms error (N)", "correlation", "delay (ms)")
    assert table.rows == [("0 to 20 Hz", "1.25", "3.50", "0.9870", "123.45")]


@pytest.mark.slow
def test_a_record_tunes_its_noise_and_that_is_said(run, tmp_path):
    seen = measure(run, rate=250.0, displacement_noise=6e-5)
    write_motion(seen, tmp_path / "noisy.csv")
    shown = panto("estimate", tmp_path / "noisy.csv", "--pantograph", "own-two-mass", "--tune", "--json")
    assert shown.returncode == 0, shown.stderr
    told = json.loads(shown.stdout)
    assert told["settings"]["displacement_noise"] == pytest.approx(6e-5, rel=0.1)
    assert told["settings"]["velocity_noise"] == pytest.approx(5e-3, rel=0.1)
    assert told["nis"] == pytest.approx(1.0, abs=0.1)
    assert "the size of its innovations is no test" in " ".join(shown.stderr.split())


@pytest.mark.longer
@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        (lambda rows: [*rows[:3000], *rows[3100:]], (), "Time steps are not equal"),
        (lambda rows: [rows[0].replace("frame (mm)", "y (mm)"), *rows[1:]], (), "has no column frame"),
        (lambda rows: rows[:15], (), "14 samples, too few to estimate a force"),
        (lambda rows: rows, ("--pantograph", "dsa380"), "aerodynamic uplift; give the speed"),
        (lambda rows: rows, ("--force-model", "shaped"), "The shaped force model needs the speed"),
        (
            lambda rows: rows,
            ("--force-model", "shaped:damping=99"),
            "damping.* must be a number from",
        ),
        (lambda rows: rows, ("--displacement-noise", "2"), "displacement_noise.* from 1e-08 to 0.1 m"),
        (lambda rows: rows, ("--lag", "100"), "lag.* from 0 to 5 s"),
        (lambda rows: rows, ("--output", "force.txt"), "must end in one of .csv, .xlsx, .parquet"),
    ],
)
def test_bad_input_to_the_command_is_one_sentence(change, options, message, record, tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(change(record.read_text().splitlines())) + "\n")
    given = options if "--pantograph" in options else ("--pantograph", "own-two-mass", *options)
    shown = panto("estimate", path, *given, cwd=tmp_path)
    assert shown.returncode == 2
    assert re.search(message, " ".join(shown.stderr.split())), shown.stderr
    assert "Traceback" not in shown.stderr
    assert sorted(each.name for each in tmp_path.iterdir()) == ["mine.csv"]


def file_of(path, headers, count=SHORTEST):
    rows = [",".join(headers)]
    rows += [
        ",".join([f"{0.5 + 0.01 * k:.2f}", *(f"{7 + k + i}" for i in range(len(headers) - 1))])
        for k in range(count)
    ]
    path.write_text("\n".join(rows))
    return path


UNITS = {  # with the scale of each to SI
    "usual": {
        "head": ("m", 1.0),
        "frame": ("mm", 1e-3),
        "head_velocity": ("m/s", 1.0),
        "head_force": ("N", 1.0),
    },
    "small": {"head": ("µm", 1e-6), "frame": ("um", 1e-6), "frame_velocity": ("mm/s", 1e-3)},
    "large": {"head": ("m", 1.0), "frame": ("μm", 1e-6), "frame_force": ("kN", 1e3)},
}


@pytest.mark.parametrize("units", UNITS.values(), ids=UNITS)
def test_each_column_is_read_in_its_unit(tmp_path, units):
    headings = [f"{name} ({unit})" for name, (unit, _) in units.items()]
    motion = read_motion(file_of(tmp_path / "m.csv", ["time (s)", *headings]), 100.0, speed=70.0, span=60.0)
    for i, (name, (_, scale)) in enumerate(units.items()):
        np.testing.assert_allclose(getattr(motion, name), scale * (7 + i + np.arange(SHORTEST)), rtol=1e-12)
    write_motion(motion, tmp_path / "again.csv")
    again = read_motion(tmp_path / "again.csv", 100.0)
    for name in ("time", "head", "frame", "head_velocity", "frame_velocity", "frame_force", "head_force"):
        if (own := getattr(motion, name)) is not None:
            np.testing.assert_allclose(getattr(again, name), own, rtol=1e-9, atol=1e-12)
    assert motion.time_step == pytest.approx(0.01)
    assert (motion.start, motion.lift, motion.speed, motion.span) == (0.5, 100.0, 70.0, 60.0)


def test_what_is_not_measured_is_none_or_no_force(tmp_path):
    motion = read_motion(file_of(tmp_path / "m.csv", ["time (s)", "head (m)", "frame (m)"]), 100.0)
    assert motion.head_velocity is motion.frame_velocity is motion.contact_force is None
    assert not motion.frame_force.any()
    assert motion.frame_force.shape == motion.head_force.shape == (SHORTEST,)
    with pytest.raises(InputError, match=str(SHORTEST)):
        read_motion(file_of(tmp_path / "s.csv", ["time (s)", "head (m)", "frame (m)"], SHORTEST - 1), 100.0)


@pytest.mark.parametrize(("seconds", "apart"), [(3.0, 2 / 3), (20.0, 0.5)])
def test_pieces_of_a_spectrum_are_of_2_s_or_half_of_a_short_record(seconds, apart):
    random, step = np.random.default_rng(0), 0.005
    true = random.normal(0, 1, round(seconds / step))
    found = phases(true, true, step)
    assert found.frequency[0] == pytest.approx(apart)
    np.testing.assert_allclose(np.diff(found.frequency), apart)
    np.testing.assert_allclose(found.coherence, 1.0)
    np.testing.assert_allclose(found.delay, 0.0, atol=1e-12)
    unlike = phases(true, random.normal(0, 1, len(true)), step)
    assert unlike.coherence.mean() < 0.9, "of a single piece every coherence would be 1"
