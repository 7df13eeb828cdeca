"""What a picture draws, and where: places worked out by hand at ten pixels per metre, 820 x 720.

A canvas that keeps what it is told stands for the real one.
"""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.plant.catenary.protocol import LineView
from panto_env.render import picture
from panto_env.render.moment import Layout, force_axis, lost

from .recorded import (
    BLUE,
    BOTTOM,
    FAINT,
    GROUND,
    HEAD,
    INK,
    LAYOUT,
    METAL,
    QUIET,
    RAW,
    ROOF,
    SUPPORT,
    TOP,
    TRAIN,
    VERMILION,
    WIRE,
    Kept,
    drew,
    moment,
)


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
