"""Seeds by purpose: no policy is judged on a line that it was trained, tuned or selected on."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Literal

from panto_env.base.errors import InputError

TEST = range(1000)
SELECTION = range(1000, 2000)
TRAINING = range(2000, 1_000_000)
# Above the seeds under which the benchmark records its tapes (``controls.OTHER_SEED``).
DATA = range(2_000_000, 3_000_000)
Purpose = Literal["test", "selection", "training", "data"]
SEEDS: dict[Purpose, range] = {"test": TEST, "selection": SELECTION, "training": TRAINING, "data": DATA}
"""Ranges of seeds by purpose, disjoint: a seed draws a line, its pantograph and all noise."""

SALTED = range(2**52, 2**53)
"""Test seeds made with a salt: so many that nobody can try them all, and each an exact number in JSON."""


def check_seeds(seeds: Iterable[int], purpose: Purpose) -> None:
    """Raise InputError for a seed that is reserved for another purpose."""
    own = SEEDS[purpose]
    wrong = next((seed for seed in seeds if seed not in own), None)
    if wrong is not None:
        raise InputError(
            f"Seeds for {purpose} are {own[0]:,} to {own[-1]:,}, not {wrong}: a policy must be trained, "
            "selected and judged on different seeds."
        )


def salted_seed(salt: str, number: int) -> int:
    """The test seed that a salt makes of a number.

    These are the first 8 bytes of the SHA-256 of "salt:number", modulo the size of their range.
    """
    digest = hashlib.sha256(f"{salt}:{number}".encode()).digest()
    return SALTED.start + int.from_bytes(digest[:8], "big") % (SALTED.stop - SALTED.start)


def salt_hash(salt: str) -> str:
    """SHA-256 of a salt, which may be published before the salt itself: `printf %s SALT | sha256sum`."""
    return hashlib.sha256(salt.encode()).hexdigest()
