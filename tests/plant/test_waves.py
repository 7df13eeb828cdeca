"""Waves ahead of a train, and grids that carry them."""

import math

import numpy as np
import pytest

from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.grid import carrying_grid, wave_ahead

LINE = load_catenary("en50318-2002")
WIRE = LINE.contact_wire


def limp(line):
    return line.model_copy(update={"contact_wire": WIRE.model_copy(update={"bending_stiffness": 0.0})})


@pytest.mark.parametrize("share", [0.1, 0.6, 0.95])
def test_without_bending_the_wave_ahead_has_a_closed_form(share):
    wire = limp(LINE).contact_wire
    speed = share * wire.wave_speed
    assert 2 * math.pi / wave_ahead(wire, speed, 20.0) == pytest.approx((wire.wave_speed - speed) / 20.0)


def test_bending_makes_waves_longer():
    k, soft = (wave_ahead(each.contact_wire, 100.0, 20.0) for each in (LINE, limp(LINE)))
    assert k < soft
    omega = np.sqrt((WIRE.tension * k**2 + WIRE.bending_stiffness * k**4) / WIRE.mass)
    assert omega == pytest.approx(2 * math.pi * 20.0 + 100.0 * k)


def test_the_grid_goes_by_what_makes_waves_short():
    at = 0.7 * WIRE.wave_speed
    usual = carrying_grid(LINE, at)
    assert carrying_grid(LINE, 0.9 * WIRE.wave_speed) < usual
    assert carrying_grid(limp(LINE), at) < usual
    clamps = LINE.droppers.model_copy(update={"contact_clamp_mass": 0.4})
    assert carrying_grid(LINE.model_copy(update={"droppers": clamps}), at) < usual
    assert carrying_grid(LINE, WIRE.wave_speed) == 0
