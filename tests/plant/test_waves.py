"""Waves ahead of a train, and grids that carry them."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible import waves
from panto_env.plant.catenary.flexible.grid import stencil_weights
from panto_env.plant.catenary.flexible.waves import carrying_grid, wave_ahead

LINE = load_catenary("en50318-2002")
WIRE = LINE.contact_wire


def limp(line):
    return line.model_copy(update={"contact_wire": WIRE.model_copy(update={"bending_stiffness": 0.0})})


@pytest.mark.parametrize("share", [0.1, 0.6, 0.95])
def test_without_bending_the_wave_ahead_has_a_closed_form(share):
    wire = limp(LINE).contact_wire
    speed = share * wire.wave_speed
    wave = wave_ahead(wire, speed, 20.0)
    assert 2 * math.pi / wave.number == pytest.approx((wire.wave_speed - speed) / 20.0)
    assert wave.omega == pytest.approx(wave.number * wire.wave_speed)
    assert wave.group == pytest.approx(wire.wave_speed)


def test_bending_makes_waves_longer_and_faster():
    stiff, soft = (wave_ahead(each.contact_wire, 100.0, 20.0) for each in (LINE, limp(LINE)))
    assert stiff.number < soft.number
    k = np.array([0.999, 1.001]) * stiff.number
    omega = np.sqrt((WIRE.tension * k**2 + WIRE.bending_stiffness * k**4) / WIRE.mass)
    assert stiff.group == pytest.approx(np.diff(omega)[0] / np.diff(k)[0], rel=1e-4)
    assert stiff.omega == pytest.approx(2 * math.pi * 20.0 + 100.0 * stiff.number)


def test_the_error_of_phase_is_that_of_the_grid():
    """The wave of the same frequency that the stencil itself has, on the grid of the limit."""
    speed = 0.8 * WIRE.wave_speed
    undamped = LINE.model_copy(
        update={"damping": LINE.damping.model_copy(update={"alpha": 0.0, "beta": 0.0})}
    )
    spacing = waves._phase_grid(undamped, speed)
    step = 0.3 * spacing / WIRE.wave_speed  # short, so that the error is of the bending term alone
    near, far = stencil_weights(WIRE, spacing, step)

    def frequency(k):
        response = 2 * near * (1 - math.cos(k * spacing)) + 2 * far * (1 - math.cos(2 * k * spacing))
        return math.acos(1 - response / 2) / step - k * speed - 2 * math.pi * waves.FILTER_HZ

    exact = wave_ahead(WIRE, speed, waves.FILTER_HZ).number
    on_grid = brentq(frequency, exact, 1.2 * exact)
    way = np.diff(LINE.droppers.positions).max()
    assert (on_grid - exact) * way == pytest.approx(waves.PHASE, rel=0.1)


def test_the_grid_goes_by_what_makes_waves_short():
    at = 0.7 * WIRE.wave_speed
    usual = carrying_grid(LINE, at)
    assert carrying_grid(LINE, 0.9 * WIRE.wave_speed) < usual
    assert carrying_grid(limp(LINE), at) < usual
    clamps = LINE.droppers.model_copy(update={"contact_clamp_mass": 0.4})
    assert carrying_grid(LINE.model_copy(update={"droppers": clamps}), at) < usual
    assert carrying_grid(LINE, WIRE.wave_speed) == 0
