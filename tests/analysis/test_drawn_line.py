"""A line drawn from a family: its values are those of the line that an environment with the seed has."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.family import drawn_line
from panto_env.analysis.parameters import check_name
from panto_env.analysis.sweep import sweep
from panto_env.catalog import load_catenary, load_family


def test_values_are_those_of_the_line_that_an_environment_has():
    family = load_family("high-speed")
    found = drawn_line(family, 3)
    env = gymnasium.make(
        "Pantograph-v0", catenary="family:high-speed", speed_kmh=(0.0, family.max_speed_kmh)
    ).unwrapped
    env.reset(seed=3)
    line = env.task.plant.catenary
    assert found.span_length == line.span_length
    assert found.droppers == len(line.droppers.positions)
    assert found.encumbrance == line.encumbrance
    assert found.pre_sag == max(line.droppers.sag)
    assert found.contact_tension == line.contact_wire.tension / 1e3
    assert found.messenger_tension == line.messenger_wire.tension / 1e3
    assert found.wave_speed_kmh == pytest.approx(
        3.6 * np.sqrt(line.contact_wire.tension / line.contact_wire.mass)
    )
    run = simulate(line, family.plausible.pantograph, found.speed_kmh, record_droppers=False).summary()
    assert found.force_deviation == run.std / run.mean
    assert found.uplift == run.max_uplift


def test_an_unknown_parameter_names_one_place_of_each_list():
    with pytest.raises(InputError) as told:
        check_name("catenary.nothing", load_catenary("en50318-2002"))
    known = str(told.value).partition("known are ")[2]
    assert "catenary.droppers.positions.1," in known
    assert "catenary.contact_wire.tension" in known
    assert "positions.2" not in known


def test_a_sweep_takes_one_condition():
    with pytest.raises(InputError, match="takes one condition of the line, not a list"):
        sweep({"speed_kmh": [200.0]}, line_condition=("new", "smooth"), workers=1)
