"""A record of a line as built, and a fit to it made ready, on a coarse grid in place of a fine one."""

from dataclasses import dataclass

import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.fitting import problem
from panto_env.plant.line_condition import LINE_CONDITIONS, DrawnLine, draw
from panto_env.plant.numerics import Numerics
from panto_env.records.measured import measured

LINE, PANTOGRAPH = "en50318-2002", "dsa380"
SPANS, SEED = 14, 3
BUILT = LINE_CONDITIONS["as-built"]


@dataclass(frozen=True)
class Truth:
    """Differences of the true line from its design."""

    drawn: DrawnLine

    def of(self, value):
        """The true difference of a value of a fit."""
        (*which, last) = value.index
        match value.kind:
            case "tensions":
                return self.drawn.tensions[last] - 1
            case "droppers":
                return self.drawn.scatter[last]
            case "supports":
                return self.drawn.heights[last]
            case "damping":
                return 0.0
        amplitude, _, phase = self.drawn.waves[which[0]]
        return amplitude * (np.cos, lambda angle: -np.sin(angle))[last](2 * np.pi * phase)


def record_of(**settings):
    """A record of 14 spans at 250 km/h, on a line of twice as many."""
    known = {"spans": 2 * SPANS, "distance": 60.0 * SPANS, "accuracy": "fast", "record_droppers": False}
    noise = {key: settings.pop(key) for key in ("force_noise", "position_error") if key in settings}
    return measured(simulate(LINE, PANTOGRAPH, 250.0, **known | settings), name="run", **noise)


@pytest.fixture(scope="package", autouse=True)
def coarse():
    """Forces of a fit are those of runs with accuracy="fast": as these tests' records, and twice as fast."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(problem, "NUMERICS", Numerics(accuracy="fast"))
        yield


@pytest.fixture(scope="package")
def design():
    return load_catenary(LINE)


@pytest.fixture(scope="package")
def pantograph():
    return load_pantograph(PANTOGRAPH)


@pytest.fixture(scope="package")
def truth():
    """What the record's line is."""
    return Truth(draw([BUILT], np.random.default_rng(SEED), 9 * 2 * SPANS, 2 * SPANS - 1))


@pytest.fixture(scope="package")
def record():
    """A record with a sensor's noise."""
    return record_of(line_condition=BUILT, seed=SEED)


@pytest.fixture(scope="package")
def ready(record, design, pantograph, coarse):
    """A fit to the record, made ready."""
    return problem.problem([record], design, pantograph)
