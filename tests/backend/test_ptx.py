"""The kernels' own source compiles for a GPU; without one, and where the compiler is installed."""

import pytest

pytest.importorskip("numba_cuda", reason="numba-cuda is not installed; `make ptx` installs it apart")

from panto_env.backend.ptx import ptx_of
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.contact import contact_force
from panto_env.plant.plant import Plant
from panto_env.plant.step import step_lane
from panto_env.plant.train import Train

LINES = {"en50318-2002": "en50318-2002", "ohl-three-span": "own-two-mass", "periodic-stiffness": "three-mass"}


def plant(line):
    return Plant(load_catenary(line), Train.of(load_pantograph(LINES[line])))


def test_contact_law():
    assert "fma.rn.f64" in ptx_of(contact_force, *[1.0] * 7)


@pytest.mark.parametrize("line", LINES)
def test_whole_step(line):
    assert "fma.rn.f64" in ptx_of(step_lane, *plant(line).arrays, 0)
