"""Lines without droppers, and where the table of droppers is divided."""

import numpy as np
import pytest

from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.static import RestingDropper, dropper_table

LINES = {"ohl-three-span": "own-two-mass", "periodic-stiffness": "three-mass", "en50318-2002": "en50318-2002"}


@pytest.mark.parametrize("name", LINES)
def test_tension_is_recorded_of_every_dropper_and_only_on_request(name):
    given = {"catenary": name, "pantograph": LINES[name], "distance": 120.0}
    plant = Task(run_settings(given), lanes=2).plant
    droppers = len(plant.model.droppers)
    assert (droppers > 0) == (name == "en50318-2002")
    assert plant.samples(5).tension.shape == (2, 5, 0)
    assert plant.samples(5, tension=True).tension.shape == (2, 5, droppers)
    assert plant.samples(5).uplift.shape == (2, 5, len(plant.model.supports))
    assert plant.samples(5).rows.shape[:2] == (2, 5)
    if name != "periodic-stiffness":  # a massless line keeps no tension at all
        plant.start(np.arange(2), 50.0)
        tension = plant.model.rest_tension(0)
        assert tension.shape == (droppers,)
        assert (tension > 0).all()


def dropper(span, number):
    return RestingDropper(number, 5.0 * number, 0.0124, 1.23456, 123.44, 0.001234, span)


def test_a_line_is_drawn_below_the_last_dropper_of_each_span():
    places = [(1, 1), (1, 2), (1, 3), (2, 1), (3, 1), (3, 2)]
    made = dropper_table([dropper(*place) for place in places])
    assert made.section_ends == (2, 3)
    assert [row[:3] for row in made.rows[:2]] == [("1", "1", "5.000"), ("1", "2", "10.000")]
    assert made.rows[-1] == ("3", "2", "10.000", "12.4", "1.2346", "123.4", "1.23")
    assert made.title == "Droppers of all spans at rest, as designed"
    assert made.headings[:2] == ("span", "dropper")
    alike = dropper_table([dropper(1, 1), dropper(1, 2)])
    assert alike.section_ends == ()
    assert alike.rows[0] == ("1", "5", "12.4", "1.2346", "123.4", "1.23")
    assert alike.title == "Droppers of a span at rest, as designed"
    assert len(alike.headings) == len(made.headings) - 1 == 6
    assert "sag (mm)" in alike.headings
    assert "stretch at rest (mm)" in alike.headings
