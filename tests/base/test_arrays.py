"""Arrays that take memory only where they are written to."""

import sys
from pathlib import Path

import numpy as np
import pytest

from panto_env.base.arrays import SPARSE, sparse_zeros


def resident() -> int:
    """Memory of this process (bytes)."""
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured as Linux shows it")
def test_a_number_in_each_row_takes_a_page_of_it():
    before = resident()
    array = sparse_zeros((500, 1 << 17))
    array[:, 1000] = 1.0
    assert array.sum(axis=1).tolist() == [1.0] * 500  # reading takes none
    assert resident() - before < array.nbytes / 20


@pytest.mark.parametrize("rows", [0, 3, SPARSE // 80])
def test_zeros_are_zeros_of_any_size(rows):
    array = sparse_zeros((rows, 10))
    assert array.shape == (rows, 10)
    assert array.dtype == np.float64
    assert not array.any()
    array[:] = 2.0
    assert (array == 2.0).all()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux gives more than it has")
def test_more_than_the_machine_has_is_given_where_little_is_written():
    array = sparse_zeros((20_000, 1 << 20))  # 168 GB
    array[::1000, 5] = 1.0
    assert array[::1000].sum() == 20.0
