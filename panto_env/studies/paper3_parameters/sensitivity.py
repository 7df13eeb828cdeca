"""How much each parameter matters: the change of σ and of amplitudes over the same share of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .passes import Influence, run_pass

SHARES = (0.10, 0.25, 0.50)
"""Each parameter is varied by plus and minus so much of its basic value."""
SHARE = 0.25
"""The share that the ranking is made with."""


@dataclass(frozen=True)
class Sensitivity:
    """Change from (1 - share) to (1 + share) times the basic value, over the basic figure (-)."""

    influence: str  # its key
    symbol: str
    share: float
    std: float  # of the contact force's σ
    swing: float  # of the contact force's maximum less minimum
    travel: float  # of the head displacement's maximum less minimum


def measure(influence: Influence, share: float, *, bilateral: bool) -> Sensitivity:
    """Central difference of one parameter's effect at 300 km/h."""
    low, base, high = (
        run_pass(influence.parameter, factor * influence.base, bilateral=bilateral)
        for factor in (1 - share, 1.0, 1 + share)
    )
    return Sensitivity(
        influence=influence.key,
        symbol=influence.symbol,
        share=share,
        std=float((np.std(high.force) - np.std(low.force)) / np.std(base.force)),
        swing=(high.swing - low.swing) / base.swing,
        travel=(high.travel - low.travel) / base.travel,
    )
