"""The kernels' own source compiles for a GPU; without one, and where the compiler is installed."""

from types import SimpleNamespace

import numba
import numpy as np
import pytest

pytest.importorskip("numba_cuda", reason="numba-cuda is not installed; `make ptx` installs it apart")
torch = pytest.importorskip("torch")

from panto_env.backend.cuda import (  # noqa: E402
    TILE,
    Columns,
    PackedTiles,
    compiled,
)
from panto_env.control import Task  # noqa: E402
from panto_env.control.on_device import BEGUN, RESULTS, arrays_of, control_unless_idle  # noqa: E402
from panto_env.control.settings import run_settings  # noqa: E402
from panto_env.envs import IDS  # noqa: E402
from panto_env.plant.pantograph.step import contact_force  # noqa: E402

COMPUTE_CAPABILITY = (9, 0)


@pytest.fixture(autouse=True)
def without_device(monkeypatch):
    """Called functions are compiled for the same GPU, although the machine has none."""
    from numba.cuda import dispatcher

    device = SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: device)


def columns(name, lanes):
    """Columns of lanes of an environment, in the processor's memory."""
    settings = run_settings(IDS[name])
    one, two = (arrays_of(Task(settings, lanes=count, keep_samples=False)) for count in (1, 2))
    return Columns(one, two, 2, lanes, TILE, torch.device("cpu"))


def test_contact_law():
    from numba import cuda

    law, types = contact_force.py_func, (numba.float64,) * 7
    ptx, _ = cuda.compile_ptx(law, types, device=True, cc=COMPUTE_CAPABILITY)
    assert "fma.rn.f64" in ptx


@pytest.mark.parametrize("name", IDS)
def test_whole_control_step(name):
    own = columns(name, TILE)
    packed, answers = PackedTiles(own, 0, RESULTS), PackedTiles(own, RESULTS, BEGUN)
    ptx = compiled(control_unless_idle, packed.type, answers.type, COMPUTE_CAPABILITY)
    assert ptx.count(".entry") == 1
    assert f".maxntid {TILE}" in ptx
    assert "fma.rn.f64" in ptx
    assert "call.uni" not in ptx  # every part stands in the place of its call


def test_packed_tiles():
    own = columns("PantographStiffness-v0", 3 * TILE)
    packed = PackedTiles(own, 0, RESULTS)
    words = packed._table.numpy()
    assert words.shape[0] == 3
    assert (words[:, 0] == packed.address + packed.apart * np.arange(3) + 8 * RESULTS).all()
    # The table of a task is the tuple of episodes' fourth field; its address moves on by a tile each time.
    table = own.tuples[7].table
    addresses = [table[tile].data_ptr() for tile in range(3)]
    assert all((words == address).any(axis=1).argmax() == tile for tile, address in enumerate(addresses))
