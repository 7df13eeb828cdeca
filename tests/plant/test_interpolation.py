"""Plain arithmetic that kernels have in the place of a library's functions."""

import numpy as np
import pytest

from panto_env.backend import kernel
from panto_env.plant.functions import cosine_of_turns, sine_of_turns, stencil

pytestmark = pytest.mark.plain


@kernel
def sine_and_cosine(turns):
    return sine_of_turns(turns), cosine_of_turns(turns)


def test_cubics_are_interpolated_exactly():
    positions, spacing = np.random.default_rng(0).uniform(1, 9, 50), 0.25
    nodes = spacing * np.arange(60)
    first, weights = stencil(positions, spacing)
    for cubic in np.polynomial.Polynomial([1, -2, 0.5, 0.1]), np.polynomial.Polynomial([0, 0, 0, 1]):
        four = cubic(nodes)[first[:, None] + np.arange(4)]
        assert (weights * four).sum(axis=1) == pytest.approx(cubic(positions))
    between = positions / spacing - first
    assert ((between >= 1) & (between < 2)).all()


@pytest.mark.parametrize("name", ["sine", "cosine"])
def test_turns_are_numpy_s(name):
    theirs = {"sine": np.sin, "cosine": np.cos}[name]
    turns = np.random.default_rng(0).uniform(-3, 50, 200)
    assert [sine_and_cosine(each)[name == "cosine"] for each in turns] == pytest.approx(
        theirs(2 * np.pi * turns), abs=1e-13
    )
