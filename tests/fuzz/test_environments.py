"""Random environments under hostile hands end well: 12 here, 2000 in `make proofs`, of which CI runs 200."""

import os
import sys

import pytest

from panto_env.backend import JIT

pytest.importorskip("resource", reason="cases are forked, as only Unix can")
pytestmark = [
    pytest.mark.skipif(not JIT, reason="plain Python takes too long"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="cases are forked"),
]

FIRST = 50_000
"""Of the seeds that are tried. Each time the same ones: what fails here fails anywhere."""


def check(count, folder):
    from .environments import BAD, tried

    told = []
    ends = tried(range(FIRST, FIRST + count), folder, told.append)
    print(dict(ends))
    assert not told, "\n".join(told)
    assert not any(kind.startswith(BAD) for kind in ends)
    assert ends["finite"] > 0.3 * count  # else it is the generator that is refused


@pytest.mark.slow
def test_many(tmp_path):
    check(int(os.environ.get("CASES", "2000")), tmp_path)
