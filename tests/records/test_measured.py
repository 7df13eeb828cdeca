"""Records made from a run, and the correction of strips' forces by their inertia."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.records.measured import measured
from panto_env.records.record_file import contact_force, read_record


def test_a_record_has_the_run_s_means(run):
    piece = measured(run, force_noise=0.0, position_error=2.0).longest
    assert piece.time_step == 0.002
    assert piece.force.mean() == pytest.approx(run.contact_force.mean(), rel=1e-3)
    np.testing.assert_allclose(piece.position - 2.0, run.speed * piece.time, atol=1e-6)
    same = measured(run, rate=1 / run.time_step, force_noise=0.0).longest  # at the run's own samples
    np.testing.assert_allclose(same.force, run.contact_force[1:-1][: len(same.force)], atol=1e-6)
    np.testing.assert_allclose(same.height, run.wire[1:-1][: len(same.height)], atol=1e-9)


def test_its_noise_and_its_mast(run):
    noisy, clean = measured(run, force_noise=3.0, seed=1).longest, measured(run, force_noise=0.0).longest
    assert (noisy.force - clean.force).std() == pytest.approx(3.0, rel=0.05)
    assert not np.array_equal(noisy.force, measured(run, force_noise=3.0, seed=2).longest.force)
    place = noisy.position[np.argmax(noisy.uplift)]
    assert place == pytest.approx(600, abs=10)
    assert noisy.uplift.max() == pytest.approx(run.uplift[:, run.support_position == 600.0].max(), rel=1e-3)


def test_runs_of_which_no_record_is_made(run):
    with pytest.raises(InputError, match="ended early"):
        measured(replace(run, terminated=True, ending="It left the line."))
    with pytest.raises(InputError, match="too short"):
        measured(run, rate=0.5)


def test_the_inertia_of_a_sinusoid():
    """Strips of mass m under a constant contact force: the sensors feel m a more."""
    time = 0.002 * np.arange(5000)
    upward = 40 * np.sin(2 * np.pi * 8 * time)
    sensors = 120 + 6.0 * upward
    columns = {"force_1": 0.5 * sensors, "force_2": 0.5 * sensors, "acceleration_1": upward}
    plain, notes = contact_force(columns, None)
    assert plain.std() == pytest.approx(6 * 40 / np.sqrt(2), rel=1e-3)
    assert "not corrected" in notes[0]
    right, notes = contact_force(columns, 6.0)
    np.testing.assert_allclose(right, 120, atol=1e-9)
    assert "6 kg" in notes[0]
    # gravity in the accelerometers, and two of them that share the mass
    tilted = columns | {"acceleration_1": 1.5 * upward + 9.81, "acceleration_2": 0.5 * upward - 0.2}
    np.testing.assert_allclose(contact_force(tilted, 6.0)[0], 120, atol=1e-9)


@pytest.mark.longer
def test_the_inertia_of_a_simulated_head(run, written):
    """A head whose upper 4 kg are above the sensors: they feel the contact force and its inertia."""
    upward = np.gradient(run.head_velocity, run.time_step)
    columns = {
        "time (s)": run.time,
        "position (m)": run.position,
        "force_1 (N)": 0.4 * (run.contact_force + 4 * upward),
        "force_2 (N)": 0.6 * (run.contact_force + 4 * upward),
        "acceleration_1 (g)": upward / 9.80665,
    }
    path = written(columns)
    away = [read_record(path, mass_correction=mass).longest.force - run.contact_force for mass in (None, 4.0)]
    assert away[0].std() > 10
    assert away[1].std() < 1e-6
    assert abs(away[1].mean()) < 0.2


def test_a_mass_that_cannot_be_used(columns, written):
    path = written(columns)
    with pytest.raises(InputError, match="no accelerations"):
        read_record(path, mass_correction=5.0)
    with pytest.raises(InputError, match="up to 50 kg"):
        read_record(path, mass_correction=500.0)
