"""What a GPU's kernel does in each lane of a tile, called on the processor for one lane after another."""

import numba
import numpy as np
import pytest

torch = pytest.importorskip("torch")

from panto_env.backend.compile import JIT, KERNEL_OPTIONS, OPTIONS  # noqa: E402
from panto_env.backend.cuda import PackedTiles, in_tile  # noqa: E402
from panto_env.control import on_device  # noqa: E402
from panto_env.control.on_device import BEGUN, RESULTS, control_unless_idle  # noqa: E402
from tests.envs.test_tensors import CASES, DEVICE, both, check_episodes, check_same  # noqa: E402

pytestmark = [
    pytest.mark.skipif(DEVICE == "cuda", reason="with a GPU tests/envs/test_tensors.py runs in tiles there"),
    pytest.mark.skipif(not JIT, reason="addresses are those of compiled kernels"),
]
TILE = 3
"""Trains in a tile here: seven are two tiles, and one that is not full."""


def one_after_another(columns):
    """A control step of all lanes as a GPU makes it, but from the last lane to the first."""
    packed, answers = PackedTiles(columns, 0, RESULTS), PackedTiles(columns, RESULTS, BEGUN)
    call = in_tile(control_unless_idle, packed.type, answers.type)

    @numba.njit(**KERNEL_OPTIONS, **OPTIONS)
    def all_lanes(arguments, apart, its, its_apart, lanes, size):
        for k in range(lanes - 1, -1, -1):
            call(arguments, apart, its, its_apart, k // size, k % size)

    def step():
        all_lanes(packed.address, packed.apart, answers.address, answers.apart, columns.lanes, columns.tile)

    return step


@pytest.mark.slow
@pytest.mark.parametrize("case", ["stiffness", "train"])
def test_tiles_give_what_arrays_give(case, monkeypatch):
    monkeypatch.setattr(on_device, "_tile", lambda lanes, device: TILE)
    monkeypatch.setattr(on_device, "_bound", one_after_another)
    name, settings = CASES[case]
    rows = (2 * TILE + 1) * len(settings.get("controlled", [1]))
    info, ours = check_episodes(*both(name, rows, settings), within=0.0)
    assert np.isfinite(info["figures"]["std"]).all()
    check_same(info["figures"], ours["figures"], within=0.0)
