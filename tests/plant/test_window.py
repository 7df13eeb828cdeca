import warnings

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.arrays import CONTACT
from panto_env.plant.catenary.flexible.build import at_rest, constants
from panto_env.plant.catenary.flexible.resolution import (
    STITCHED_ERROR,
    STITCHED_SHARE,
    clear_spans,
    resolution,
)
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.flexible.wires import along, lay_out, window_nodes
from panto_env.plant.catenary.schema import CLEAR
from panto_env.plant.numerics import Numerics, Runs
from panto_env.studies.en50318 import lines as windows

from .test_flexible import PRECISIONS, travel

STEP = 2e-3


def swinging(line, wire):
    """Energy (J) of both bare wires but for what bending holds."""
    u, d = along(wire.displacement[0]).astype(float), along(wire.increment[0]).astype(float)
    total = 0.0
    for w, (mass, tension) in enumerate(((1.35, 20e3), (1.07, 16e3))):
        total += mass * line.spacing * (d[w] ** 2).sum() / 2 / STEP**2
        total += tension * (np.diff(u[w]) ** 2).sum() / 2 / line.spacing
    return total


@PRECISIONS
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
    wire.travelled[0] = 10
    pulse = 0.05 * np.exp(-(((built.spacing * window_nodes(built.rows) - 210) / 5) ** 2))
    wire.displacement[0, CONTACT] = lay_out(pulse, built.rows, float)
    middle = 13.5 * line.span_length
    travel(built, wire, middle, 0.0, 0.0, np.zeros(1), np.zeros(3))
    before = swinging(built, wire)
    each_end_once = np.zeros(round(2.5 / STEP))
    travel(built, wire, middle, 0.0, 0.0, each_end_once, np.zeros(3))
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


def figures(**settings):
    """Over spans 10 to 19, as of a pass to the end of the twentieth."""
    line = load_catenary("beijing-tianjin")
    return simulate(line, speed_kmh=100.0, accuracy="fast", record_droppers=False, **settings).summary(
        (10, 19)
    )


def test_no_wave_from_the_far_anchor_meets_the_train_on_a_whole_line():
    """With eight spans beyond the pass, those of a window, sigma was 3.3 % high."""
    distance = load_catenary("beijing-tianjin").alignment().support(19)
    whole, endless = figures(window=0), figures(window=0, spans=150, distance=distance)
    assert whole.std == pytest.approx(endless.std, rel=1e-3)
    assert whole.max == pytest.approx(endless.max, abs=1e-3 * endless.mean)
    assert whole.min == pytest.approx(endless.min, abs=1e-3 * endless.mean)


def test_a_whole_line_is_as_long_as_the_train_is_slow():
    line, whole = load_catenary("en50318-2002"), Numerics(window=0)
    for kmh in (50.0, 100.0, 400.0):
        speed, wave = kmh / 3.6, max(wire.wave_speed for wire in line.wires)
        spans = 19 + clear_spans(line, whole, Runs((speed, speed)), 19)
        train_at_end, wave_back = 19 / speed, (2 * spans - 19) / wave
        assert train_at_end <= wave_back or spans == 19 + CLEAR
        assert (2 * spans - 21) / wave < train_at_end or spans == 19 + CLEAR  # and no longer than needed
    with pytest.raises(InputError, match=r"At 3 km/h waves from a whole line's far anchor .* 1,404 spans"):
        simulate(speed_kmh=3.0, window=0)


def test_wire_defects_make_a_line_whole_and_as_long():
    run = simulate(
        "beijing-tianjin",
        speed_kmh=100.0,
        line_condition={"worn_stretches": [(12, 10.0, 5.0, 0.1)]},
        accuracy="fast",
        record_droppers=False,
    )
    assert run.settings["spans"] > 19 + 40


def test_slow_trains_get_a_wider_window():
    line = load_catenary("re250")
    windows_by_speed = {
        kmh: resolution(line, Numerics(), Runs((kmh / 3.6, kmh / 3.6))).window for kmh in (30, 200, 250, 350)
    }
    assert windows_by_speed == {30: 32, 200: 24, 250: 16, 350: 16}
    assert resolution(line, Numerics(accuracy="fast"), Runs((10.0, 10.0))).window == 8


def test_a_window_that_costs_more_than_one_per_cent_is_warned_of():
    def said(line="re250", speed=200.0, **settings):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            simulate(line, speed_kmh=speed, distance=60.0, record_droppers=False, **settings)
        return [str(each.message) for each in caught if issubclass(each.category, AccuracyWarning)]

    (message,) = said(window=8)
    assert "A window of 8 spans is too short at 200 km/h, where 24 are needed" in message
    assert "wrong by up to about 5 %" in message
    for settings in ({}, {"window": 24}, {"window": 0}, {"accuracy": "fast"}, {"window": 8, "speed": 380.0}):
        assert not said(**settings), settings


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", list(windows.window_cases()), ids=lambda case: f"{case.name}, {case.speed_kmh:.0f}"
)
def test_default_window_agrees_with_the_whole_line(case):
    (check,) = windows.check_windows(case, [None])
    wires, bound = case.line.wires, 1
    if case.line.stitch_wire and case.speed_kmh / 3.6 < STITCHED_SHARE * max(
        wire.wave_speed for wire in wires
    ):
        bound = STITCHED_ERROR  # of which a warning tells
    assert abs(check.std) < bound
    assert max(abs(check.max), abs(check.min)) < bound  # % of the mean force
    assert abs(check.uplift) < 2
