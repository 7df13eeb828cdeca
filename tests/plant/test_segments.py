"""Segments abreast hold the same wires as one after the other would."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.backend import JIT, WIDTH, kernel, load_row
from panto_env.plant.catenary.flexible.arrays import PAD
from panto_env.plant.catenary.flexible.build import Sets
from panto_env.plant.catenary.flexible.wires import (
    along,
    lay_out,
    leapfrog,
    leapfrog_weakened,
    move,
    node_after,
    places,
    read,
    share_ends,
    shift_nodes,
    window_nodes,
)

pytestmark = pytest.mark.plain
ROWS = 7
NODES = window_nodes(ROWS)


@kernel
def _share(x, rows):
    share_ends(x, rows)


@kernel
def _leapfrog(u, d, inertia, deficit, stencil):
    leapfrog(u, d, inertia, deficit, stencil)


@kernel
def _weakened(u, d, inertia, deficit, stencil):
    leapfrog_weakened(u, d, inertia, deficit, stencil)


@kernel
def _shift(x, rows, count):
    shift_nodes(x, rows, count)


@kernel
def _read(x, row, rows, out):
    values = read(x, row, rows)
    for j in range(WIDTH):
        out[0, j] = 0.0
    move(out, 0, rows, values)


@kernel
def _move(x, row, rows, steps):
    move(x, row, rows, load_row(steps, 0))


@kernel
def _after(row, segment, count, all_rows, out):
    out[0], out[1] = node_after(row, segment, count, all_rows)


def random_wire(kind=np.float64):
    values = np.random.default_rng(0).normal(size=len(NODES))
    return values, lay_out(values, ROWS, kind)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_nodes_are_laid_out_and_found_again(kind):
    values, x = random_wire(kind)
    assert x.shape == (ROWS + 2 * PAD, WIDTH)
    np.testing.assert_array_equal(along(x), values.astype(kind))
    row, segment = places(np.array([-PAD, 0, ROWS - 1, ROWS, WIDTH * ROWS, WIDTH * ROWS + 1]), ROWS)
    np.testing.assert_array_equal(row, [0, PAD, PAD + ROWS - 1, PAD, PAD + ROWS, PAD + ROWS + 1])
    np.testing.assert_array_equal(segment, [0, 0, 0, 1, WIDTH - 1, WIDTH - 1])


@pytest.mark.parametrize("count", [0, 3, ROWS, ROWS + 3, 3 * ROWS])
def test_a_window_travels_by_any_number_of_nodes(count):
    values, x = random_wire()
    wanted = x.copy()
    x[:PAD, 1:] = x[-PAD:, :-1] = 9.0
    _share(x, ROWS)  # ends hold what the neighbours hold
    np.testing.assert_array_equal(x, wanted)
    _shift(x, ROWS, count)
    np.testing.assert_array_equal(along(x), np.append(values[count:], np.zeros(count)))
    kept = x.copy()
    _share(x, ROWS)
    np.testing.assert_array_equal(x, kept)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_rows_beyond_a_segment_are_those_of_the_next(kind):
    values, x = random_wire(kind)
    values = np.append(values, values[-1])
    for row in range(ROWS + 2 * PAD + 1):
        out = np.zeros((3, WIDTH), kind)
        if row >= PAD:
            x[:PAD, 1:] = x[-PAD:, :-1] = 9.0  # not up to date
        _read(x, row, ROWS, out)
        wanted = values[row + ROWS * np.arange(WIDTH)].astype(kind)
        np.testing.assert_array_equal(out[0], wanted)


def test_a_step_moves_the_nodes_that_are_read():
    """And none beyond the window's end."""
    for row in range(PAD, ROWS + 2 * PAD + 1):
        x = np.zeros((ROWS + 2 * PAD, WIDTH))
        steps = 1.0 + np.arange(WIDTH)[None]
        _move(x, row, ROWS, steps)
        wanted = np.zeros(len(NODES) + 1)
        wanted[row + ROWS * np.arange(WIDTH)] = steps[0]
        wanted[ROWS * WIDTH + PAD :] = 0.0
        inner = x[PAD:-PAD].T.ravel()
        np.testing.assert_array_equal(inner, wanted[PAD : PAD + ROWS * WIDTH])


def test_the_nodes_after_one():
    out = np.zeros(2, dtype=np.int64)
    for node in range(-1, WIDTH * ROWS - 1):
        row, segment = places(np.array(node), ROWS)
        for count in range(4):
            _after(int(row), int(segment), count, ROWS + 2 * PAD, out)
            if node + count < WIDTH * ROWS + PAD:
                assert tuple(out) == tuple(map(int, places(np.array(node + count), ROWS)))


def test_what_hangs_in_the_same_rows_goes_abreast():
    """Two things in the same rows of a segment, or on other wires, do not."""
    wires = np.array([[0, 1]] * 5 + [[1, 2]])
    sets = Sets(wires, np.array([3, 3, 3 + ROWS, 4, 4 + 2 * ROWS, 4 + 3 * ROWS]), ROWS)
    np.testing.assert_array_equal(sets.number, [0, 1, 0, 2, 2, 3])
    np.testing.assert_array_equal(sets.segment, [0, 0, 1, 0, 2, 3])
    np.testing.assert_array_equal(sets.row, PAD + np.array([3, 3, 4, 4]))
    np.testing.assert_array_equal(sets.wires[[0, 3]], [[0, 1], [1, 2]])
    table = sets.of(np.arange(12.0).reshape(6, 2), float, empty=-1.0)
    assert table.shape == (4, 2, WIDTH)
    np.testing.assert_array_equal(table[2, 1], [7, -1, 9, -1, -1, -1, -1, -1])


@pytest.mark.longer
@pytest.mark.skipif(not JIT, reason="slow in plain Python")
def test_any_window_that_has_not_travelled_gives_the_same_run():
    """However its segments lie to spans and droppers."""
    given = {"spans": 20, "distance": 55.0, "precision": "double"}
    reference = simulate(window=8, **given)
    for window in (3, 5, 7, 12, 0):
        run = simulate(window=window, **given)
        assert np.abs(run.contact_force - reference.contact_force).max() < 1e-3, window


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_leapfrog_is_that_of_the_whole_wire(loaded, kind):
    """With all nodes one after another; where stitch wires take tension, less what its slopes lose."""
    random = np.random.default_rng(1)
    values, steps, taken, masses = random.uniform(0.5, 1.0, (4, len(NODES)))
    here, beside, beyond, keep, lag = 0.5, -0.1, 0.02, 0.99, 0.2
    stencil = np.array([here, beside, beyond, keep, lag, 0.0], kind)
    inertia = lay_out(masses, ROWS, kind)[PAD : -PAD if loaded else PAD]
    new = values + steps
    pulling = new + lag * steps
    bend = np.diff(pulling, 2)
    force = np.convolve(bend, [beyond, beside, here, beside, beyond], mode="valid")
    lost = taken[1:] * np.diff(pulling)  # on each node from the one before
    weight = masses[PAD:-PAD] if loaded else 1.0
    for function, missing in ((_leapfrog, 0.0), (_weakened, (lost[:-1] - lost[1:])[PAD - 1 : 1 - PAD])):
        u, d, deficit = (lay_out(each, ROWS, kind) for each in (values, steps, taken))
        function(u, d, inertia, deficit, stencil)
        close = {"rtol": 1e-12 if kind is np.float64 else 1e-5, "atol": 1e-12 if kind is np.float64 else 1e-6}
        np.testing.assert_allclose(along(u), new, **close)
        wanted = keep * steps[PAD:-PAD] + weight * (force + missing)
        np.testing.assert_allclose(along(d)[PAD:-PAD], wanted, **close)
