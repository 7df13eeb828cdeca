import numpy as np
import pytest

from panto_env import simulate
from panto_env.backend import kernel
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.arrays import CONTACT
from panto_env.plant.catenary.flexible.build import at_rest, constants
from panto_env.plant.catenary.flexible.resolution import resolution
from panto_env.plant.catenary.flexible.segments import along, lay_out, window_nodes
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.protocol import advance_wire, end_step, place_contact
from panto_env.plant.numerics import WINDOW, Numerics, Runs
from panto_env.studies.en50318 import window as windows


@kernel
def wait(line, wire, x, steps):
    """Let a line swing for itself; x (m): anywhere in the window's middle."""
    for _ in range(steps):
        place_contact(line, wire, 0, 0, x)
        advance_wire(line, wire, 0)
        end_step(line, wire, 0)


STEP = 2.5e-3


def swinging(line, wire):
    """Energy (J) of both bare wires but for what bending holds."""
    u, d = along(wire.displacement[0]).astype(float), along(wire.increment[0]).astype(float)
    total = 0.0
    for w, (mass, tension) in enumerate(((1.35, 20e3), (1.07, 16e3))):
        total += mass * line.spacing * (d[w] ** 2).sum() / 2 / STEP**2
        total += tension * (np.diff(u[w]) ** 2).sum() / 2 / line.spacing
    return total


@pytest.mark.parametrize("precision", ["single", "double"])
def test_ends_let_waves_out(precision):
    """A pulse on bare wires leaves a window in the middle of a line; what is reflected is told."""
    line = load_catenary("en50318-2002")
    limp = line.droppers.model_copy(update={"stiffness": 1e-6})
    bare, numerics = (
        line.model_copy(update={"droppers": limp}),
        Numerics(precision=precision, accuracy="fast"),
    )
    chosen = resolution(bare, numerics, Runs())
    assert chosen.time_step == STEP
    built = constants(bare, solve(bare), 30, numerics, chosen)
    wire = at_rest(built, 1, 1)
    wire.first_span[0] = 10
    pulse = 0.05 * np.exp(-(((built.spacing * window_nodes(built.rows) - 210) / 5) ** 2))
    wire.displacement[0, CONTACT] = lay_out(pulse, built.rows, float)
    middle = 13.5 * line.span_length
    wait(built, wire, middle, 1)
    before = swinging(built, wire)
    wait(built, wire, middle, round(2.5 / STEP))  # 2.5 s: the pulse has met each end once
    assert swinging(built, wire) < 1e-5 * before


def test_runs_of_any_length_cost_the_same_and_stay_the_same():
    """Spans far along a line are as those near its start: nothing builds up in the window."""
    run = simulate(spans=120, distance=118 * 60.0, record_droppers=False)
    early, late = run.summary((20, 60)), run.summary((77, 117))
    assert late.std == pytest.approx(early.std, rel=0.01)
    assert late.mean == pytest.approx(early.mean, rel=0.002)


def test_window_is_the_whole_line_until_it_travels():
    window = simulate(spans=20, window=7, distance=230.0)
    whole = simulate(spans=20, window=0, distance=230.0)
    # Waves reach the window's end, 7 spans ahead, and what is missing there comes back, later.
    early = window.time < 7 * 60 / 122
    np.testing.assert_allclose(window.contact_force[early], whole.contact_force[early], atol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("catenary", "pantograph"), windows.LINES)
@pytest.mark.parametrize("speed", windows.SPEEDS_KMH)
def test_default_window_agrees_with_the_whole_line(catenary, pantograph, speed):
    (check,) = windows.check_windows(catenary, pantograph, speed, [WINDOW["full"]])
    assert abs(check.std) < 1
    assert abs(check.max) < 1
    assert abs(check.min) < 1  # % of the mean force
    assert abs(check.uplift) < 2
