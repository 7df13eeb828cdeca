"""The kernels' own source compiles for a GPU; without one, and where the compiler is installed."""

import numpy as np
import pytest

pytest.importorskip("numba_cuda", reason="numba-cuda is not installed; `make ptx` installs it apart")

from panto_env.backend.ptx import ptx_of
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible.links import pull_links
from panto_env.plant.catenary.flexible.wires import leapfrog
from panto_env.plant.contact import contact_force
from panto_env.plant.plant import Plant
from panto_env.plant.state import BLOCK_ROWS, CONTACTS
from panto_env.plant.step import step_blocks

LINES = {"en50318-2002": "en50318-2002", "ohl-three-span": "dsa350", "periodic-stiffness": "three-mass"}


def plant(line):
    return Plant(load_catenary(line), load_pantograph(LINES[line]))


def test_contact_law():
    assert "fma.rn.f64" in ptx_of(contact_force, *[1.0] * 7)


def test_leapfrog_and_links_of_the_flexible_line():
    built = plant("en50318-2002").model
    u, d, blend = built.wire.displacement[0, 0], built.wire.increment[0, 0], built.wire.blend[0]
    inertia, stencil = built.line.inertia[0], built.line.stencil[0]
    assert "f32" in ptx_of(leapfrog, u, d, blend, inertia, stencil)
    all_u, all_d = built.wire.all_displacement[0], built.wire.all_increment[0]
    past, now = built.wire.extension[0]
    static, change = built.line.link_static[0], built.wire.change[0]
    assert "sqrt" in ptx_of(pull_links, built.line, all_u, all_d, past, now, static, change)


@pytest.mark.parametrize("line", LINES)
def test_whole_step(line):
    ready = plant(line)
    blocks = np.zeros((CONTACTS, BLOCK_ROWS, ready.lanes_abreast))
    assert "fma.rn.f64" in ptx_of(step_blocks, *ready.arrays, blocks, 0, 1)
