"""Contact points and droppers near each other, beyond what the grid carries."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible import near as near_build
from panto_env.plant.catenary.flexible.arrays import NONE, REACH
from panto_env.plant.catenary.flexible.build import constants
from panto_env.plant.catenary.flexible.resolution import resolution
from panto_env.plant.catenary.flexible.static import hang
from panto_env.plant.numerics import Numerics, Runs

LINE = load_catenary("en50318-2002")


def built(line, spacing=0.3):
    numerics = Numerics(spacing=spacing, window=8)
    return constants(line, hang(line), line.spans, numerics, resolution(line, numerics, Runs()))


def with_positions(*positions):
    return LINE.model_copy(update={"droppers": LINE.droppers.model_copy(update={"positions": positions})})


@pytest.mark.parametrize(
    "line",
    [
        LINE,
        with_positions(0.5, 8.0, 16.0, 24.0, 30.0, 37.0, 45.0, 52.0, 59.5),
        load_catenary("re330-stitched"),
    ],
    ids=["usual", "near the masts", "spans that differ"],
)
def test_each_cell_finds_the_nearest_dropper(line):
    """Also beyond the masts, in the spans before and after."""
    line = line.model_copy(update={"spans": 12})
    whole = built(line)
    near, dx = whole.near, whole.spacing
    places = np.sort(line.layout(12).positions) / dx
    cells = near.number.shape[1]
    repeats = whole.scattered.mobility.shape[1] == 0
    first = 5 * cells if repeats else 0
    droppers = near.cell.size
    for cell in range(cells):
        away = np.abs(places - (first + cell + 0.5))
        nearest, number = away.argmin(), near.number[0, cell]
        if abs(np.floor(places[nearest] + 1e-9) - first - cell) > REACH:
            assert number == NONE
            continue
        further = (number + droppers) // droppers - 1 if repeats else 0
        own = number - further * droppers
        place = first + further * cells + near.cell[own] + near.place[own]
        assert abs(place - (first + cell + 0.5)) == pytest.approx(away[nearest], abs=1e-6)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:A grid of")
@pytest.mark.parametrize("catenary", ["en50318-2002", "sweden-st15"])
def test_slow_trains_pass_droppers_as_on_a_fine_grid(catenary, monkeypatch):
    """Without it sigma was wrong by several times as much."""
    given = {"catenary": catenary, "pantograph": "en50318-2002", "speed_kmh": 30.0, "record_droppers": False}
    given |= {"spans": 12, "distance": 4.5 * 65.0, "window": 8}
    true = simulate(**given, spacing=0.1, time_step=1e-2 / 80).summary((2, 4)).std
    ours = simulate(**given, spacing=0.3, time_step=4e-4).summary((2, 4)).std
    missing = near_build.missing_between
    monkeypatch.setattr(near_build, "missing_between", lambda *known: 0.0 * missing(*known))
    # Under another name, so that the line is built anew.
    line = load_catenary(catenary)
    given["catenary"] = line.model_copy(update={"name": f"{catenary}, on the grid alone"})
    without = simulate(**given, spacing=0.3, time_step=4e-4).summary((2, 4)).std
    assert ours == pytest.approx(true, rel=0.02)
    assert abs(without - true) > 3 * abs(ours - true)
