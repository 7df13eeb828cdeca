"""Seeds by what they are for: none of those that a policy learnt from is among those that judge it."""

from __future__ import annotations

from panto_env.base.errors import InputError

TEST = range(0, 1000)
"""Of the benchmark: what is reported."""
SELECTION = range(1000, 2000)
"""Of choosing between what was trained or tuned."""
TRAINING = range(2000, 1_000_000)
"""Of training and tuning."""
PURPOSES = {"test": TEST, "selection": SELECTION, "training": TRAINING}


def check_seeds(seeds: range, purpose: str) -> None:
    """Raise InputError unless all of these seeds, of which there is one or more, are for this purpose."""
    own = PURPOSES[purpose]
    if not (seeds[0] in own and seeds[-1] in own):
        given = f"{seeds[0]}" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"
        raise InputError(
            f"Seeds for {purpose} are {own[0]:,} to {own[-1]:,}, not {given}: what a policy learns from, is "
            "chosen by and is judged on must differ."
        )
