"""Seeds by purpose: no policy is judged on a line that it was trained, tuned or selected on."""

from __future__ import annotations

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


def check_seeds(seeds: Iterable[int], purpose: Purpose) -> None:
    """Raise InputError for a seed that is reserved for another purpose."""
    own = SEEDS[purpose]
    wrong = next((seed for seed in seeds if seed not in own), None)
    if wrong is not None:
        raise InputError(
            f"Seeds for {purpose} are {own[0]:,} to {own[-1]:,}, not {wrong}: a policy must be trained, "
            "selected and judged on different seeds."
        )
