"""What a picture draws, and where: places worked out by hand at ten pixels per metre, 820 x 720.

A canvas that keeps what it is told stands for the real one.
"""

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.plant.alignment import Alignment
from panto_env.plant.catenary.view import NOTHING, LineView
from panto_env.plant.state import Place
from panto_env.render import picture
from panto_env.render.layout import Layout, force_axis, lost
from panto_env.render.moment import Moment

BLUE, ORANGE, VERMILION = (0, 114, 178), (230, 159, 0), (213, 94, 0)
INK, QUIET, FAINT, METAL = (28, 37, 48), (105, 115, 126), (222, 227, 232), (70, 78, 88)
GROUND, TRAIN, RAW, SUPPORT = (250, 251, 252), (196, 204, 213), (186, 194, 203), (135, 144, 154)
HEAD, WIRE, ROOF, TOP, BOTTOM = 520.0, 313.2, 471.6, 536.4, 702.0
"""Column of the pantograph, and rows of height 0, the roof and the ends of the chart (px)."""


class Kept:
    """A canvas that keeps what it is told to draw; a word is ten pixels wide per letter."""

    def __init__(self):
        self.drawn = []

    def words(self, x, y, text, colour, size, *, bold=False, anchor="left"):
        self.drawn.append(("words", [x, y, size], (text, colour, bold, anchor)))
        return 10.0 * len(text)

    def line(self, points, colour, width=1.0):
        self.drawn.append(("line", np.asarray(points, dtype=float), (colour, width)))

    wire = line

    def shape(self, points, colour):
        self.drawn.append(("shape", np.asarray(points, dtype=float), colour))

    def box(self, left, top, width, height, colour):
        self.drawn.append(("box", [left, top, width, height], colour))

    def dot(self, x, y, radius, colour, edge=None):
        self.drawn.append(("dot", [x, y, radius], (colour, edge)))

    def fill(self, colour):
        self.drawn.append(("fill", [], colour))

    def told(self, kind):
        return [(places, rest) for what, places, rest in self.drawn if what == kind]


def drew(canvas, *expected):
    """Check all that was drawn, in its order: kind, numbers, and what is no number."""
    assert [(kind, rest) for kind, _, rest in canvas.drawn] == [(kind, rest) for kind, _, rest in expected]
    for (_, places, _), (_, wanted, _) in zip(canvas.drawn, expected, strict=True):
        np.testing.assert_allclose(np.asarray(places), np.asarray(wanted, dtype=float), atol=1e-9)


def moment(**other):
    """A pantograph of two masses at 100 m of spans of 40 m, 20 m behind a support."""
    places = np.arange(30.0, 100.5, 0.5)
    facts = {
        "title": "a title",
        "time": 2.5,
        "speed": 50.0,
        "position": 100.0,
        "alignment": Alignment.equal(40.0, 5),
        "line": NOTHING,
        "masses": np.array([9.0, 16.0]),
        "heights": np.array([0.02, 0.03]),
        "wire": 0.04,
        "places": places,
        "force": np.full(len(places), 150.0),
        "filtered": np.full(len(places), 120.0),
        "nominal_force": 100.0,
        "largest_force": 350.0,
        "standard": "a standard",
        "actuators": {},
        "force_limit": 100.0,
    }
    return Moment(**facts | other)


LAYOUT = Layout(820, 720, 40.0, 50, (0.0, 0.01))


def test_the_layout_in_pixels():
    assert LAYOUT.per_metre == pytest.approx(10.0)
    assert (LAYOUT.pantograph, LAYOUT.wire, LAYOUT.roof) == pytest.approx((HEAD, WIRE, ROOF))
    assert LAYOUT.chart == pytest.approx((TOP, BOTTOM))
    assert LAYOUT.margin == pytest.approx(61.5)
    assert LAYOUT.across(np.array([99.0, 100.0, 103.5]), 100.0) == pytest.approx([510.0, HEAD, 555.0])
    assert LAYOUT.up(np.array([0.0, 0.2, -0.1])) == pytest.approx([WIRE, WIRE - 100, WIRE + 50])
    assert LAYOUT.points([99.0], [0.2], 100.0) == pytest.approx(np.array([[510.0, WIRE - 100]]))
    # From 6 % below zero to 6 % above the maximum: 112 parts.
    part = (BOTTOM - TOP) / 112
    forces = LAYOUT.forces(np.array([0.0, 100.0, 50.0, 900.0, -900.0]), 100.0)
    assert forces == pytest.approx([BOTTOM - 6 * part, TOP + 6 * part, BOTTOM - 56 * part, TOP, BOTTOM])
    # Masses 0.55 of the way from wire to roof apart, each moved by its own height.
    assert LAYOUT.chain(np.array([0.02, 0.03])) == pytest.approx([WIRE - 10, WIRE + 0.55 * 158.4 - 10])
    assert LAYOUT.chain(np.array([0.0, 0.04])) == pytest.approx([WIRE, WIRE + 0.55 * 158.4 - 15])
    arrows = [LAYOUT.arrow(force, 100.0) for force in (25.0, -50.0, 100.0, 101.0, -400.0)]
    assert arrows == pytest.approx([19.8, -39.6, 79.2, 79.2, -79.2])
    one = Layout(820, 720, 40.0, 1, (0.0,))
    assert one.chain(np.array([0.5])) == pytest.approx([WIRE - 5])


def test_the_layout_of_a_moment():
    low, first = Layout.of(moment(), 820, 720), moment().heights
    assert (low.width, low.height, low.span) == (820, 720, 40.0)
    assert low.rest == pytest.approx((0.0, first[1] - first[0]))
    # 259.2 px above the wire for 0.35 m of ten pixels: 74 times, so 50.
    assert low.exaggeration == 50
    for height, exaggeration in ((0.3, 50), (0.52, 30), (0.864, 30), (0.8641, 20), (12.97, 1), (90.0, 1)):
        line = moment().line._replace(contact=np.array([0.0, height]))
        assert Layout.of(moment(line=line), 820, 720).exaggeration == exaggeration, height


def test_the_axis_in_steps_of_20_newtons():
    assert [force_axis(high, 60.0, 350.0) for high in (0, 120, 120.1, 239, 280.1)] == [
        120,
        120,
        140,
        240,
        350,
    ]
    np.testing.assert_array_equal(lost(np.array([-1.0, 0.0, 1e-9, 1.0])), [True, True, False, False])


def test_an_axis_has_five_lines_at_most_beside_that_of_zero():
    for axis, step in ((100.0, 20), (101.0, 50), (250.0, 50), (350.0, 100), (740.0, 200), (26_000.0, 20_000)):
        canvas = Kept()
        picture._draw_still(canvas, LAYOUT, moment(largest_force=1e5), axis)
        labels = [(x, y, text) for (x, y, _), (text, *_, anchor) in canvas.told("words") if " N" in text
                  and anchor == "right" and x < 61.5]  # fmt: skip
        wanted = list(range(0, int(axis) + 1, step))
        assert [text for *_, text in labels] == [f"{force} N" for force in wanted]
        assert [y for _, y, _ in labels] == pytest.approx(list(LAYOUT.forces(np.array(wanted), axis)))
        assert {round(x, 6) for x, *_ in labels} == {round(61.5 - 0.4 * 0.0222 * 720, 6)}
        lines = [(points, look) for points, look in canvas.told("line") if np.ptp(points[:, 0]) == 458.5]
        assert [points[0, 1] for points, _ in lines] == pytest.approx([y for _, y, _ in labels])
        assert [look for _, look in lines] == [(INK, 1.0)] + [(FAINT, 1.0)] * (len(wanted) - 1)


def test_what_stands_still_besides_the_axis():
    canvas, size = Kept(), 0.0222 * 720
    picture._draw_still(canvas, LAYOUT, moment(largest_force=150.0), 200.0)
    assert canvas.drawn[0] == ("fill", [], GROUND)
    (train, white, *signs), boxes = zip(*canvas.told("box"), strict=True)
    assert train == pytest.approx([0, ROOF, HEAD + 82, 19.44])
    assert white == pytest.approx([61.5, TOP, 458.5, BOTTOM - TOP])
    assert boxes == (TRAIN, (255, 255, 255), VERMILION)
    assert signs[0][2:] == pytest.approx([0.7 * 0.85 * size] * 2)
    words = {rest[0]: (places, rest[1:]) for places, rest in canvas.told("words")}
    assert words["a title"][0] == pytest.approx([12.3, 28.8, 1.35 * size])
    assert words["a title"][1] == (INK, True, "left")
    assert words["train"][0] == pytest.approx([8.2, ROOF + 9.72, 0.8 * size])
    assert words["train"][1] == (METAL, False, "left")
    assert words["a standard: 150 N"][0] == pytest.approx([HEAD, TOP - 0.75 * size, 0.85 * size])
    assert words["a standard: 150 N"][1] == (INK, False, "right")
    # Dashes of 7 px every 14 at the nominal force, and at the limit, which is on the axis.
    for force, colour in ((100.0, QUIET), (150.0, INK)):
        y = float(LAYOUT.forces(force, 200.0))
        level = [
            points[:, 0] for points, look in canvas.told("line")
            if look == (colour, 1.0) and np.allclose(points[:, 1], y)
        ]  # fmt: skip
        dashes = [x for x in level if np.ptp(x) < 8]
        assert [x[0] for x in dashes] == pytest.approx(list(61.5 + 14 * np.arange(33)))
        assert [np.ptp(x) for x in dashes] == pytest.approx([7.0] * 33)
    above = Kept()
    picture._draw_still(above, LAYOUT, moment(largest_force=201.0), 200.0)
    assert "a standard: 201 N, above" in [rest[0] for _, rest in above.told("words")]


def test_the_legend_from_left_to_right():
    """Signs are 1.8 letters wide, then the words, then 0.9 letters of space."""
    canvas, size = Kept(), 0.85 * 0.0222 * 720
    y, x = TOP - 0.75 * 0.0222 * 720, 61.5
    picture._draw_legend(canvas, LAYOUT, moment(), 400.0)
    expected = []
    for text, colour in (("contact force to 20 Hz", BLUE), ("raw", RAW)):
        expected += [("line", [(x, y), (x + 1.5 * size, y)], (colour, 2.4))]
        expected += [("words", [x + 1.8 * size, y, size], (text, QUIET, False, "left"))]
        x += 2.7 * size + 10 * len(text)
    expected += [("box", [x + 0.7 * size, y - 0.35 * size, 0.7 * size, 0.7 * size], VERMILION)]
    expected += [("words", [x + 1.8 * size, y, size], ("contact lost", QUIET, False, "left"))]
    x += 2.7 * size + 120
    for top in (-0.6, 0.1):
        ends = [(x + 1.1 * size, y + top * size), (x + 1.1 * size, y + (top + 0.45) * size)]
        expected += [("line", ends, (SUPPORT, 1.0))]
    expected += [("words", [x + 1.8 * size, y, size], ("support", QUIET, False, "left"))]
    expected += [("words", [HEAD, y, size], ("a standard: 350 N", INK, False, "right"))]
    drew(canvas, *expected)


@pytest.mark.parametrize(
    ("exaggeration", "high", "beside", "words"),
    [(50, 50.0, 25.0, "heights × 50"), (2, 2.0, 6.7952, "heights × 2"), (1, 1.0, 5.7952, "heights to scale")],
)
def test_the_scale_is_ten_metres_long_and_ten_centimetres_high(exaggeration, high, beside, words):
    canvas, size, right = Kept(), 0.0222 * 720, 0.985 * 820
    picture._draw_scale(canvas, Layout(820, 720, 40.0, exaggeration, (0.0,)))
    drew(
        canvas,
        ("line", [(right - 100, 28.8), (right, 28.8)], (QUIET, 2)),
        ("words", [right - 50, 28.8 - 0.7 * size, 0.8 * size], ("10 m", QUIET, False, "middle")),
        ("line", [(right, 28.8), (right, 28.8 + high)], (QUIET, 2)),
        ("words", [right - 0.5 * size, 28.8 + beside, 0.8 * size], ("10 cm", QUIET, False, "right")),
        ("words", [right - 100 - size, 28.8, 0.9 * size], (words, QUIET, False, "right")),
    )


def test_a_mast_with_and_without_a_messenger():
    contact = np.array([(0.0, 300.0), (820.0, 320.0)])
    low, away = 310.0, 14.76  # in the middle; 0.018 of the width
    canvas = Kept()
    picture._draw_mast(canvas, LAYOUT, 410.0, contact, contact - (0.0, 200.0))
    drew(
        canvas,
        ("box", [410 - away - 4, 94.0, 8.0, ROOF - 110 + 16], FAINT),
        ("line", [(410 - away, 110), (410, 110)], (METAL, 2)),
        ("line", [(410 - away, 144), (410, 110)], (METAL, 1.5)),
        ("line", [(410 - away, low - 22), (410, low)], (METAL, 1.5)),
        ("dot", [410, 110, 3], (GROUND, METAL)),
    )
    canvas = Kept()
    picture._draw_mast(canvas, LAYOUT, 410.0, contact, None)
    (box, _), ((spring, look), (arm, arms)) = canvas.told("box")[0], canvas.told("line")
    assert box == pytest.approx([410 - away - 4, 254.0, 8.0, ROOF - 270 + 16])
    assert (look, arms) == ((METAL, 1.5), (METAL, 2))
    np.testing.assert_allclose(arm, [(410 - away, 270), (416, 270)])
    # A tenth straight, then eight turns from 15 to 85 % of the 40 px, a tenth straight.
    sides, heights = [410, 410, *[416, 404] * 4, 410, 410], [270, 274, *range(276, 305, 4), 306, 310]
    np.testing.assert_allclose(spring, np.column_stack([sides, heights]))


def test_the_wires_and_droppers_of_a_line():
    x = np.arange(60.0, 140.5, 0.5)
    line = LineView(
        x=x, contact=0 * x, messenger=0 * x + 0.4, supports=np.array([80.0, 120.0]),
        droppers=np.array([90.0, 110.0]), tops=np.array([0.4, 0.38]), bottoms=np.array([0.0, 0.02]),
        slack=np.array([False, True]), further=((np.array([95.0, 105.0]), np.array([0.2, 0.3])),),
    )  # fmt: skip
    canvas, size = Kept(), 0.85 * 0.0222 * 720
    picture._draw_line(canvas, LAYOUT, moment(line=line))
    masts = [box[0] for box, _ in canvas.told("box")]
    assert masts == pytest.approx([320 - 18.76, 720 - 18.76])
    lines = [(points, look) for points, look in canvas.told("line") if look[0] != METAL or len(points) > 2]
    upper, dropper, slack, contact = (each for each in lines if len(each[0]) != 2 or each[1][0] == QUIET)
    np.testing.assert_allclose(upper[0], np.column_stack([120 + 10 * (x - 60), 0 * x + WIRE - 200]))
    assert upper[1] == (METAL, 2)
    np.testing.assert_allclose(contact[0], np.column_stack([120 + 10 * (x - 60), 0 * x + WIRE]))
    assert contact[1] == (INK, 3)
    np.testing.assert_allclose(dropper[0], [(420, WIRE - 200), (420, WIRE)])
    assert dropper[1] == (QUIET, 1.0)
    assert slack[1] == (VERMILION, 2)
    np.testing.assert_allclose(slack[0][[0, 4, 8]], [(620, WIRE - 190), (627, WIRE - 100), (620, WIRE - 10)])
    assert len(slack[0]) == 9
    (further,) = [points for points, look in canvas.told("line") if look == (METAL, 1)]
    np.testing.assert_allclose(further, [(470, WIRE - 100), (570, WIRE - 150)])
    words = [(places, rest[:2]) for places, rest in canvas.told("words")]
    assert [rest for _, rest in words] == [
        ("contact wire", QUIET), ("messenger wire", QUIET), ("slack dropper", VERMILION)
    ]  # fmt: skip
    heights = [WIRE + size, WIRE - 200 - 1.2 * size, WIRE + 2.4 * size]
    np.testing.assert_allclose([places for places, _ in words], [(8.2, y, size) for y in heights])
    canvas = Kept()  # a messenger at the title has its name below that
    picture._name_parts(canvas, LAYOUT, np.array([(0.0, WIRE)]), np.array([(0.0, 55.0)]), False)
    assert [places[1] for places, _ in canvas.told("words")] == pytest.approx([WIRE + size, 0.085 * 720])


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
        picture._draw_rows(canvas, LAYOUT, ["a", "b", "c"], named=named)
        drew(
            canvas,
            *(("words", [x, TOP + 1.25 * k * size, size], (word, *look)) for k, word in enumerate("abc")),
        )
    assert all(low < high for low, high in pairwise(picture.STEPS))
