"""Where a fit is, in a file: read back as written, and only for the same fit."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env.fitting.misfit import State
from panto_env.fitting.stored import identity_of, keep, kept
from panto_env.records.record import Piece, Record

SETTINGS = {"free": ["droppers"], "tolerances": {"droppers": 0.01}, "line": "{}"}


@pytest.fixture
def record():
    x = np.arange(100.0)
    return Record("a", (Piece("", 0.002, 0.0, x, 120 + np.sin(x)), Piece("", 0.002, 1.0, x + 200, 120 - x)))


@pytest.fixture
def state():
    random = np.random.default_rng(0)
    return State(random.standard_normal(30), np.array([70.0, 71.0]), random.uniform(size=(2, 6)), 7)


def test_a_state_is_read_back_and_another_fit_s_is_not_taken(tmp_path, record, state):
    path, identity = tmp_path / "a.fit", identity_of([record], SETTINGS)
    keep(path, state, identity)
    keep(path, replace(state, steps=8), identity)
    found = kept(path, identity)
    assert found.steps == 8
    for name in ("x", "static_forces", "noise"):
        np.testing.assert_array_equal(getattr(found, name), getattr(state, name))
    one, two = record.pieces
    force = two.force.copy()
    force[50] += 1e-9
    for pieces in ((one, replace(two, force=force)), (one, replace(two, position=two.position + 1)), (one,)):
        assert kept(path, identity_of([replace(record, pieces=pieces)], SETTINGS)) is None
    for other in ({"tolerances": {}}, {"free": ["droppers", "tensions"]}):
        assert kept(path, identity_of([record], SETTINGS | other)) is None
    assert kept(path, identity_of([replace(record, name="b")], SETTINGS)) is not None  # the same samples


def test_a_damaged_file_is_not_taken(tmp_path, record, state):
    path, identity = tmp_path / "a.fit", identity_of([record], SETTINGS)
    assert kept(path, identity) is None
    keep(path, state, identity)
    whole = path.read_bytes()
    for content in (whole[:-9], b"", whole[:-5] + bytes([whole[-5] ^ 1]) + whole[-4:]):
        path.write_bytes(content)
        assert kept(path, identity) is None
