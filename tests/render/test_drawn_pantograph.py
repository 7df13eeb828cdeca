"""How a picture draws the pantograph, its actuators and the force, worked out by hand."""

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.plant.state import Place
from panto_env.render import picture
from panto_env.render.moment import Layout

from .recorded import (
    BLUE,
    BOTTOM,
    GROUND,
    HEAD,
    INK,
    LAYOUT,
    METAL,
    ORANGE,
    QUIET,
    RAW,
    ROOF,
    SUPPORT,
    TOP,
    VERMILION,
    WIRE,
    Kept,
    drew,
    moment,
)


def test_a_line_that_is_only_a_spring():
    canvas = Kept()
    picture._draw_line(canvas, LAYOUT, moment())
    (ceiling, one), (spring, two), (strip, three), *supports = canvas.told("line")
    y, high = WIRE - 20, 115.2
    np.testing.assert_allclose(ceiling, [(460, high), (580, high)])
    np.testing.assert_allclose(strip, [(486, y), (554, y)])
    assert (one, two, three) == ((METAL, 3), (METAL, 2), (INK, 3))
    np.testing.assert_allclose(spring[[0, 1, -2, -1], 1], high + (y - high) * np.array([0, 0.1, 0.9, 1]))
    assert len(spring) == 18
    assert np.ptp(spring[:, 0]) == pytest.approx(2 * 0.012 * 820)
    (words,) = canvas.told("words")
    assert words[0] == pytest.approx([440, high + 0.9 * 0.0222 * 720, 0.9 * 0.0222 * 720])
    assert words[1][1:] == (QUIET, False, "right")
    # 48 to 130 m are shown: supports at 80 and 120 m.
    np.testing.assert_allclose(
        [points for points, _ in supports], [[(x, ROOF - 26), (x, ROOF)] for x in (320, 720)]
    )
    assert {look for _, look in supports} == {(QUIET, 2)}


@pytest.mark.parametrize("last", [50.0, 0.0])
def test_a_pantograph_and_the_star_of_lost_contact(last):
    now = moment()
    now.force[-1] = last
    canvas = Kept()
    picture._draw_pantograph(canvas, LAYOUT, now)
    head, frame = WIRE - 10, WIRE + 0.55 * 158.4 - 10
    arms, spring, strip, *star = canvas.told("line")
    np.testing.assert_allclose(arms[0], [(520, frame), (572, (frame + ROOF) / 2), (506, ROOF)])
    assert arms[1] == (METAL, 4)
    assert canvas.told("box")[0][0] == pytest.approx([486, ROOF - 5, 40, 6])
    np.testing.assert_allclose(
        spring[0][[0, 1, -1]], [(520, head), (520, 0.9 * head + 0.1 * frame), (520, frame)]
    )
    assert (len(spring[0]), np.ptp(spring[0][:, 0]), spring[1]) == (12, 14.0, (METAL, 1.6))
    np.testing.assert_allclose(strip[0], [(484, head + 9), (494, head + 1), (546, head + 1), (556, head + 9)])
    assert strip[1] == (INK, 4)
    (dot,) = canvas.told("dot")
    assert dot[0] == pytest.approx([520, frame, 9.2])
    assert dot[1] == (METAL, GROUND)
    if last:
        assert not star
        return
    turns = np.pi / 4 * np.arange(8)
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    np.testing.assert_allclose(
        [points for points, _ in star], [[(520, head - 3) + r * way for r in (7, 20)] for way in ways]
    )
    assert {look for _, look in star} == {(VERMILION, 2.5)}
    # In a frame of half the height all of it is half as large.
    canvas, half = Kept(), Layout(820, 360, 40.0, 50, (0.0, 0.01))
    picture._draw_pantograph(canvas, half, now)
    ray = canvas.told("line")[3][0]
    np.testing.assert_allclose(ray - ray[0], [(0, 0), (6.5, 0)], atol=1e-9)
    assert ray[0, 0] == pytest.approx(523.5)


@pytest.mark.parametrize(
    ("place", "x", "y"), [(Place.HEAD, 420, WIRE - 10), (Place.FRAME, 456, WIRE + 77.12)]
)
@pytest.mark.parametrize("force", [50.0, -25.0, 10.0, 1.0])
def test_an_actuator_s_arrow(place, x, y, force):
    length = 0.792 * force
    wing = np.sign(force) * min(11, abs(length))
    canvas = Kept()
    picture._draw_actuators(canvas, LAYOUT, moment(actuators={place: force}))
    name = "head" if place is Place.HEAD else "frame"
    tip = y - length
    arrow = [
        ("line", [(x, y), (x, tip + 0.6 * wing)], (ORANGE, 5)),
        ("shape", [(x, tip), (x - 9, tip + wing), (x + 9, tip + wing)], ORANGE),
    ]
    words = f"actuator on the {name} {'+' if force > 0 else ''}{force:.0f} N"
    drew(
        canvas,
        ("line", [(x - 12, y), (x + 12, y)], (ORANGE, 2)),
        *(arrow if abs(length) > 1 else []),
        ("words", [x - 20, y, 0.0222 * 720], (words, (176, 110, 0), False, "right")),
    )


def test_the_force_lies_below_the_places_where_it_acted():
    now = moment()
    now.force[100] = 0.0  # at 80 m
    canvas, axis = Kept(), 200.0
    picture._draw_force(canvas, LAYOUT, now, axis)
    *dashes, raw, smooth = canvas.told("line")
    shown = now.places[now.places >= 54.15]  # 45.85 m fit in to the left
    x = 520 + 10 * (shown - 100)
    np.testing.assert_allclose(raw[0], np.column_stack([x, LAYOUT.forces(now.force[-len(x) :], axis)]))
    at = float(LAYOUT.forces(120.0, axis))
    np.testing.assert_allclose(smooth[0], np.column_stack([x, np.full(len(x), at)])[::-2])
    assert (raw[1], smooth[1]) == ((RAW, 1.0), (BLUE, 2.4))
    ((box, colour),) = canvas.told("box")
    assert box == pytest.approx([319, float(LAYOUT.forces(0.0, axis)) - 4, 3, 9])
    assert colour == VERMILION
    ((dot, look),) = canvas.told("dot")
    assert dot == pytest.approx([520, at, 5])
    assert look == (BLUE, GROUND)
    # The support at 80 m: dashes of 6 px every 11.
    tops = TOP + 11 * np.arange(16)
    np.testing.assert_allclose(
        [points for points, _ in dashes], [[(320, y), (320, min(y + 6, BOTTOM))] for y in tops]
    )
    assert {look for _, look in dashes} == {(SUPPORT, 1.0)}
    for count in (0, 1):
        canvas, few = Kept(), slice(len(now.places) - count, None)
        cut = {name: getattr(now, name)[few] for name in ("places", "force", "filtered")}
        picture._draw_force(canvas, LAYOUT, moment(**cut), axis)
        assert {look for _, look in canvas.told("line")} == {(SUPPORT, 1.0)}
        assert not canvas.told("dot")


def test_the_numbers_beside_the_chart():
    rows = picture._rows(moment(figures={"more": "text"}))
    assert rows == {
        "speed": "180 km/h",
        "place": "100 m, span 3",
        "time": "2.50 s",
        "contact force": "120 N",
        "nominal force (- - -)": "100 N",
        "more": "text",
    }
    assert picture._rows(moment(filtered=np.zeros(0)))["contact force"] == "–"
    size = 0.0222 * 720
    for named, x, look in ((True, HEAD + 24.6, (QUIET, False, "left")), (False, 807.7, (INK, True, "right"))):
        canvas = Kept()
        picture._draw_rows(canvas, LAYOUT, ["a", "b", "c"], 1.25 * size, named=named)
        drew(
            canvas,
            *(("words", [x, TOP + 1.25 * k * size, size], (word, *look)) for k, word in enumerate("abc")),
        )
    assert all(low < high for low, high in pairwise(picture.STEPS))
