"""Seeds by purpose, and those that a salt makes."""

import hashlib
import itertools

import pytest

from panto_baselines.benchmark.settings import (
    OTHER_SEED,
    SALTED,
    SEEDS,
    TEST,
    BenchmarkSettings,
    salt_hash,
    salted_seed,
)
from panto_env import InputError
from panto_env.base.settings import parse


def test_no_seed_has_two_purposes():
    ordered = sorted((*SEEDS.values(), SALTED), key=lambda seeds: seeds.start)
    assert all(one.stop <= other.start for one, other in itertools.pairwise(ordered))
    assert not any(TEST.start + OTHER_SEED in seeds for seeds in SEEDS.values())


def test_a_salted_seed_is_what_its_definition_says():
    first = int(hashlib.sha256(b"salt:0").hexdigest()[:16], 16)
    assert salted_seed("salt", 0) == 2**52 + first % 2**52
    assert float(salted_seed("salt", 0)) == salted_seed("salt", 0)  # exact in JSON
    assert salt_hash("salt") == hashlib.sha256(b"salt").hexdigest()


def test_seeds_of_a_salt_differ_from_those_of_another():
    seeds = [salted_seed(salt, number) for salt in ("salt", "pepper", "salt ") for number in range(1000)]
    assert len(set(seeds)) == 3000
    assert all(seed in SALTED for seed in seeds)
    assert 0.45 < sum(seed < 1.5 * 2**52 for seed in seeds) / 3000 < 0.55


def test_a_benchmark_draws_its_seeds_with_the_salt_only():
    given = parse(BenchmarkSettings, {"seeds": 3}, "the benchmark")
    assert given.drawn_seeds == given.seeds == (0, 1, 2)
    salted = parse(BenchmarkSettings, {"seeds": 3, "salt": "today"}, "the benchmark")
    assert salted.seeds == (0, 1, 2)
    assert salted.drawn_seeds == tuple(salted_seed("today", number) for number in range(3))
    with pytest.raises(InputError, match="key 'salt'"):
        parse(BenchmarkSettings, {"salt": ""}, "the benchmark")
