"""Frames and plots are as they were: whoever changes one looks at it, and stores it anew.

python -m tests.render.test_stored_pictures   # writes stored/*.png anew
"""

from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

import cv2

from panto_env.render.picture import Picture

from ..marks import some_at_once
from .made_up_plots import PLOTS
from .test_render import driven, moment

STORED = Path(__file__).with_name("stored")
SLIGHT = 40
"""Difference of a pixel's colour, of 255, that another processor's rounding may make at a line's edge."""
FEW = 500
"""Pixels that it may make differ at all: the colour of a face, or of words, that changes changes more."""
BOTH = {"actuator": {"place": "both"}, "steps": 400, "action": 0.6}
FRAMES = {
    "flexible": {"catenary": "en50318-2002", "line_condition": {"broken_droppers": [(6, 3), (6, 4)]}} | BOTH,
    "three-span": {"catenary": "ohl-three-span", "pantograph": "own-two-mass"},
    "stiffness": {"catenary": "periodic-stiffness", "pantograph": "three-mass", "action": -0.8},
}


def frame(name):
    settings = {"line_condition": "new", "speed_kmh": 280} | FRAMES[name]
    return Picture(800, 450).draw(moment(driven(**settings)))


def pixels(plot):
    """A figure of Matplotlib as it is saved, on a coarse grid."""
    png = BytesIO()
    plot().savefig(png, dpi=60, format="png")
    return cv2.imdecode(np.frombuffer(png.getvalue(), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


PICTURES = {f"frame-{name}": partial(frame, name) for name in FRAMES}
PICTURES |= {name: partial(pixels, plot) for name, plot in PLOTS.items()}
QUICK = "frame-flexible", "frame-stiffness"


@pytest.mark.parametrize("name", some_at_once(PICTURES, QUICK, pytest.mark.longer))
def test_a_picture_is_as_it_was(name):
    now = np.asarray(PICTURES[name]()).astype(int)
    then = cv2.imread(str(STORED / f"{name}.png"))[..., ::-1].astype(int)
    assert now.shape == then.shape
    difference = np.abs(now - then).max(axis=2)
    assert (difference > SLIGHT).sum() == 0
    assert (difference > 0).sum() < FEW


def test_no_picture_is_stored_that_is_not_compared():
    assert {path.stem for path in STORED.glob("*.png")} == set(PICTURES)


if __name__ == "__main__":
    STORED.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        smallest = [cv2.IMWRITE_PNG_COMPRESSION, 9]
        cv2.imwrite(str(STORED / f"{name}.png"), np.ascontiguousarray(draw()[..., ::-1]), smallest)
