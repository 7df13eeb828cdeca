"""Who rides on the line, and where each collector is."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control.settings import run_settings
from panto_env.plant.actuators import actuator_settings
from panto_env.plant.plant import Plant
from panto_env.plant.speed import DRIFT_ROWS, KNOT_ROWS, SpeedProfile, draw_drift
from panto_env.plant.train import Collector, Train

ONE = Train.of(load_pantograph("dsa380"))


@pytest.mark.parametrize("count", [0, 5])
def test_too_few_or_too_many_collectors_are_refused_in_a_sentence(count):
    with pytest.raises(InputError, match=f"must have 1 to 4 pantographs, not {count}"):
        Train(ONE.collectors * count)


def test_different_actuators_are_refused_in_a_sentence():
    other = replace(ONE.first, actuator=actuator_settings("realistic"), distance=50.0)
    with pytest.raises(InputError, match="must have the same actuator and sensors"):
        Train((ONE.first, other))


def test_settings_of_a_run_say_who_rides():
    settings = run_settings({"pantograph": "dsa250", "actuator": "realistic", "sensors": "realistic"})
    assert settings.train.collectors == (
        Collector(settings.pantograph, settings.actuator, settings.sensors, distance=0.0),
    )


PROFILE = SpeedProfile(over="time", points=[(0, 280), (0.2, 282), (0.5, 280)])


@pytest.mark.parametrize("drifting", [0, DRIFT_ROWS, DRIFT_ROWS + KNOT_ROWS * len(PROFILE.points)])
def test_kernels_and_python_agree_on_where_a_collector_is_behind_the_first(drifting):
    """A collector at some distance is there at every step: the record of a massless line is of its place."""
    behind = 25.0
    train = Train((replace(ONE.first, distance=behind),))
    plant = Plant(load_catenary("periodic-stiffness"), train, drifting=drifting)
    both = draw_drift(3.0, plant.time_step, np.random.default_rng(1)), PROFILE.rows(plant.time_step)
    drift = np.concatenate(both)[None, :drifting] if drifting else None
    plant.start(0, 80.0, drift=drift)
    assert plant.position(0, 0, 0)[0] == -behind
    samples = plant.samples(401)
    plant.advance_passively(400, samples)
    x = plant.position(0, np.arange(400) + 0.5)
    line = plant.catenary
    wave = np.cos(2 * np.pi * plant.alignment.in_spans(x))
    stiffness = line.mean_stiffness * (1 + line.stiffness_variation * wave)
    force, height = samples.rows[0, 1:, 0, 0], samples.rows[0, 1:, 0, 3]
    touching = force > 0
    assert touching.mean() > 0.5
    np.testing.assert_allclose(force[touching], (stiffness * height)[touching], rtol=1e-9)
