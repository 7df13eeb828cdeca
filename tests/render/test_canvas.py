"""Which pixels boxes, dots, wires and words cover."""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

from panto_env.render.canvas import Canvas, rgb, zigzag

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}


def test_a_box_a_dot_and_words_cover_the_pixels_they_should():
    canvas = Canvas(40, 30)
    canvas.fill((9, 8, 7))
    assert (canvas.pixels == (9, 8, 7)).all()
    canvas.box(3.4, 5.6, 10.0, 4.0, (255, 0, 1))
    inside = np.zeros((30, 40), dtype=bool)
    inside[6:10, 3:13] = True
    assert ((canvas.pixels == (255, 0, 1)).all(axis=2) == inside).all()
    canvas = Canvas(41, 41)
    canvas.dot(20, 20, 8, (0, 200, 0), (200, 0, 0))
    away = np.hypot(*(np.indices((41, 41)) - 20))
    assert (canvas.pixels[away < 7] == (0, 200, 0)).all()
    assert (canvas.pixels[(away > 8.6) & (away < 8.9)][:, 0] > 100).all()
    assert not canvas.pixels[away > 11.8].any()
    for anchor, x in (("left", 5.0), ("middle", 60.0), ("right", 115.0)):
        canvas = Canvas(120, 40)
        width = canvas.words(x, 20, "HHH", (255, 255, 255), 16, anchor=anchor)
        rows, columns = np.nonzero(canvas.pixels[..., 0] > 60)
        left = x - {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * width
        assert left <= columns.min() <= left + 4
        assert left + width - 4 <= columns.max() <= left + width
        assert rows.mean() == pytest.approx(20, abs=1.0)
        assert np.ptp(rows) == pytest.approx(0.73 * 16, abs=1.5)  # the height of a capital
    bold, thin = Canvas(120, 40), Canvas(120, 40)
    assert bold.words(5, 20, "HHH", (255, 255, 255), 16, bold=True) > thin.words(5, 20, "HHH", (255,) * 3, 16)
    assert rgb("#01fe80") == (1, 254, 128)


def test_a_wire_is_as_broad_as_its_thin_lines():
    for width, rows in ((1, [20]), (2, [19, 20]), (3, [19, 20, 21])):
        canvas = Canvas(60, 40)
        canvas.wire([(0, 20), (60, 20)], (255, 255, 255), width)
        lit = canvas.pixels[:, 30, 0].astype(float)
        assert (lit @ np.arange(40)) / lit.sum() == pytest.approx(20.0, abs=0.25)
        assert set(np.nonzero(lit > 200)[0]) <= set(rows) | {20, 21}
        assert lit[20] > 150


def test_a_spring_s_turns():
    points = zigzag(10.0, 100.0, 200.0, 3.0, 2)
    np.testing.assert_allclose(points[:, 0], [10, 10, 13, 7, 13, 7, 10, 10])
    np.testing.assert_allclose(points[:, 1], [100, 110, 115, 115 + 70 / 3, 115 + 140 / 3, 185, 190, 200])
