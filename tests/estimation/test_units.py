"""Units of a motion's file, each by its factor, and pieces of a record's spectrum."""

import numpy as np
import pytest

from panto_env import InputError
from panto_env.base.record_columns import LENGTHS, TIME
from panto_env.estimation.estimate import phases
from panto_env.estimation.motion import COLUMNS, FORCES, SHORTEST, SPEEDS, read_motion

FACTORS = {"m": 1.0, "mm": 1e-3, "m/s": 1.0, "mm/s": 1e-3, "N": 1.0, "kN": 1e3}
FACTORS |= dict.fromkeys(("um", "µm", "μm"), 1e-6)


def file_of(path, headers, count=SHORTEST):
    rows = [",".join(headers)]
    rows += [
        ",".join([f"{0.5 + 0.01 * k:.2f}", *(f"{7 + k + i}" for i in range(len(headers) - 1))])
        for k in range(count)
    ]
    path.write_text("\n".join(rows))
    return path


@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("force", FORCES)
def test_each_column_is_read_in_its_unit(tmp_path, length, speed, force):
    units = {"head": length, "frame": length, "head_velocity": speed, "frame_velocity": speed}
    units |= dict.fromkeys(("frame_force", "head_force", "contact_force"), force)
    path = file_of(tmp_path / "m.csv", ["time (s)", *(f"{name} ({unit})" for name, unit in units.items())])
    motion = read_motion(path, 100.0, speed=70.0, span=60.0)
    for i, (name, unit) in enumerate(units.items()):
        expected = FACTORS[unit] * (7 + i + np.arange(SHORTEST))
        np.testing.assert_allclose(getattr(motion, name), expected, rtol=1e-12)
    assert motion.time_step == pytest.approx(0.01)
    assert (motion.start, motion.lift, motion.speed, motion.span) == (0.5, 100.0, 70.0, 60.0)


def test_all_units_are_known_here():
    assert LENGTHS | SPEEDS | FORCES == FACTORS
    assert {name for name, column in COLUMNS.items() if column.required} == {"time", "head", "frame"}
    assert TIME.example in TIME.units


def test_what_is_not_measured_is_none_or_no_force(tmp_path):
    motion = read_motion(file_of(tmp_path / "m.csv", ["time (s)", "head (m)", "frame (m)"]), 100.0)
    assert motion.head_velocity is motion.frame_velocity is motion.contact_force is None
    assert not motion.frame_force.any()
    assert motion.frame_force.shape == motion.head_force.shape == (SHORTEST,)
    with pytest.raises(InputError, match=str(SHORTEST)):
        read_motion(file_of(tmp_path / "s.csv", ["time (s)", "head (m)", "frame (m)"], SHORTEST - 1), 100.0)


@pytest.mark.parametrize(("seconds", "apart"), [(1.0, 2.0), (3.0, 2 / 3), (4.0, 0.5), (20.0, 0.5)])
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
