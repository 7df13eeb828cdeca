"""Frames and plots are as they were: whoever changes one looks at it, and stores it anew.

python -m tests.render.test_stored_pictures   # writes stored/*.png anew
"""

from dataclasses import replace
from functools import partial
from io import BytesIO
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from panto_env.analysis.plots import plot_forces, plot_run
from panto_env.analysis.sweep_plots import plot_sweep

from ..metrics.test_summary import RUN

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

import cv2

from panto_env.render.picture import Picture

from .test_render import driven, moment

STORED = Path(__file__).with_name("stored")
SLIGHT = 40
"""Difference of a pixel's colour, of 255, that another processor's rounding may make at a line's edge."""
BOTH = {"actuator": {"place": "both"}, "steps": 400, "action": 0.6}
FRAMES = {
    "flexible": {"catenary": "en50318-2002", "line_condition": {"broken_droppers": [(6, 3), (6, 4)]}} | BOTH,
    "three-span": {"catenary": "ohl-three-span", "pantograph": "own-two-mass"},
    "stiffness": {"catenary": "periodic-stiffness", "pantograph": "three-mass", "action": -0.8},
}
ROW = {"catenary": "a line", "pantograph": "one", "system": "AC", "spans": "10-19", "terminated": False}


def frame(name):
    settings = {"line_condition": "new", "speed_kmh": 280} | FRAMES[name]
    return Picture(800, 450).draw(moment(driven(**settings)))


def pixels(figure):
    """A figure of Matplotlib as it is saved, on a coarse grid."""
    png = BytesIO()
    figure.savefig(png, dpi=70, format="png")
    return cv2.imdecode(np.frombuffer(png.getvalue(), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def rows():
    """A sweep over two parameters whose figures are made up."""
    for k, (policy, speed, mass) in enumerate(product(("passive", "pd"), (200.0, 300.0), (5.0, 7.0))):
        figures = {"mean": 120.0 + k, "std": 20.0 + 3 * k, "max": 180.0 + 9 * k, "min": 60.0 - 5 * k}
        figures |= {"statistical_max": 190.0 + 9 * k, "statistical_min": 50.0 - 6 * k}
        figures |= {"max_uplift": 0.04 + 0.003 * k, "contact_loss": 0.1 * k}
        yield ROW | figures | {"speed_kmh": speed, "mass": mass, "policy": policy}


def sweep(*names):
    kept = [row for row in rows() if "mass" in names or row["mass"] == 5.0]
    return plot_sweep(kept, names, {"speed_kmh": "speed (km/h)", "mass": "mass (kg)"})


def several():
    ended = replace(RUN, contact_force=1.5 * RUN.contact_force, catenary="another", terminated=True)
    return plot_forces((RUN, ended), ("p", "q"), (1, 3), "two runs")


PICTURES = {
    **{f"frame-{name}": partial(frame, name) for name in FRAMES},
    "run": lambda: pixels(plot_run(RUN, "all")),
    "runs": lambda: pixels(several()),
    "sweep": lambda: pixels(sweep("speed_kmh")),
    "maps": lambda: pixels(sweep("speed_kmh", "mass")),
}


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_as_it_was(name):
    now = np.asarray(PICTURES[name]()).astype(int)
    then = cv2.imread(str(STORED / f"{name}.png"))[..., ::-1].astype(int)
    assert now.shape == then.shape
    assert (np.abs(now - then).max(axis=2) > SLIGHT).sum() == 0


if __name__ == "__main__":
    STORED.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        cv2.imwrite(str(STORED / f"{name}.png"), np.ascontiguousarray(draw()[..., ::-1]))
