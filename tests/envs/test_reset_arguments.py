"""Seeds and options of ``reset``, each value that is accepted and each that is not; methods as documented."""

import inspect
from types import MappingProxyType

import numpy as np
import pytest

from panto_env import InputError
from panto_env.envs import PantographEnv, PantographVectorEnv
from panto_env.envs.episodes import checked_options, checked_seed, checked_seeds

SEEDS = [0, 1, np.int64(3), np.uint8(7), 2**70]
WRONG = [-1, np.int32(-2), 1.5, np.float64(2), "1", b"1", True, np.bool_(True), 1j, (1,)]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_seed_is_a_whole_number_from_0_up(seed):
    assert checked_seed(seed) == int(seed)
    assert type(checked_seed(seed)) is int
    assert checked_seeds(seed, 3) == [int(seed), int(seed) + 1, int(seed) + 2]
    assert checked_seeds([seed, None], 2) == checked_seeds((seed, None), 2) == [int(seed), None]


def test_no_seed_is_none():
    assert checked_seed(None) is None
    assert checked_seeds(None, 2) == [None, None]
    assert checked_seeds(np.array([4, 5]), 2) == [4, 5]


@pytest.mark.parametrize("seed", WRONG, ids=repr)
def test_anything_else_is_no_seed(seed):
    with pytest.raises(InputError, match=r"^seed must be a whole number from 0 up, or None, not .+\.$"):
        checked_seed(seed)
    several = (
        "seed must be a whole number from 0 up, or a list of 2 such numbers or None, one per lane, or None"
    )
    with pytest.raises(InputError, match=several):
        checked_seeds([0, seed], 2)
    if seed != (1,):
        with pytest.raises(InputError, match=several):
            checked_seeds(seed, 2)


@pytest.mark.parametrize("seeds", [(1,), [1, 2, 3], [], np.array([1]), np.array([])])
def test_there_is_a_seed_per_lane(seeds):
    with pytest.raises(InputError, match=f"seed must be a number or one per lane, 2, not {len(seeds)}"):
        checked_seeds(seeds, 2)


def test_options_are_a_dictionary_by_names_and_a_copy():
    given = {"speed_kmh": 250}
    assert checked_options(given) == checked_options(MappingProxyType(given)) == given
    assert checked_options(given) is not given
    assert checked_options(None) == checked_options({}) == {}


@pytest.mark.parametrize("options", [[("speed_kmh", 250)], "speed_kmh", {1: 250}, 0, []])
def test_anything_else_is_no_options(options):
    with pytest.raises(InputError, match="options must be a dictionary of arguments by name"):
        checked_options(options)


@pytest.mark.parametrize(
    ("kind", "method", "parameters"),
    [
        (PantographEnv, "reset", ["seed", "options"]),
        (PantographEnv, "step", ["action"]),
        (PantographEnv, "render", []),
        (PantographVectorEnv, "reset", ["seed", "options"]),
        (PantographVectorEnv, "step", ["actions"]),
        (PantographVectorEnv, "render", []),
        (PantographVectorEnv, "context", ["lane"]),
    ],
)
def test_methods_show_their_own_arguments_and_help(kind, method, parameters):
    """Decorated as they are: what `help` shows, and what wrappers and checkers read."""
    function = vars(kind)[method]
    assert list(inspect.signature(function).parameters) == ["self", *parameters]
    assert function.__name__ == method
    assert "alone" not in function.__qualname__
    assert len(function.__doc__) > 40
