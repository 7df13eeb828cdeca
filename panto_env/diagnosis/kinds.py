"""Which kind of defect it is, and at which candidate: a small neural network, kept as plain arrays.

scikit-learn trains it (``training.py``); here is only its sum. For each candidate
about a maximum of the score it estimates whether a defect is there, and of which kind; the surest counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from ..base.arrays import Array
from .features import Candidate, Sort, candidates, features
from .places import Evidence, Region

BROKEN, LONG, SHORT = "broken dropper", "dropper too long", "dropper too short"
RAISED, SUNK, SPOT = "raised support", "sunk support", "hard spot"
WORN, TENSION = "worn wire", "lost tension"
KINDS = (BROKEN, LONG, SHORT, RAISED, SUNK, SPOT, WORN)
"""Of defects that are somewhere: classes from 1 on; class 0 is that there is nothing just there."""
OF_SORT: Mapping[Sort, tuple[str, ...]] = {
    Sort.DROPPER: (BROKEN, LONG, SHORT),
    Sort.SUPPORT: (RAISED, SUNK),
    Sort.WIRE: (SPOT, WORN),
}
TRAINED = Path(__file__).with_name("kinds.npz")


class Answer(NamedTuple):
    """The surest kind and place."""

    kind: str
    place: Candidate
    shares: Mapping[str, float]  # of the kinds, each where it is surest; they add up to 1


@dataclass(frozen=True)
class Classifier:
    """A network of one hidden layer over standardised features."""

    mean: Array  # (features,)
    scale: Array  # (features,)
    inner: Array  # (features, hidden)
    inner_bias: Array  # (hidden,)
    outer: Array  # (hidden, classes)
    outer_bias: Array  # (classes,)

    @classmethod
    def load(cls, path: Path = TRAINED) -> Self:
        """From a file of arrays; nothing in it is run."""
        with np.load(path, allow_pickle=False) as arrays:
            return cls(*(arrays[field.name] for field in fields(cls)))

    def probabilities(self, shown: Array) -> Array:
        """Of all classes, (n, classes), by features, (n, features)."""
        hidden = np.maximum((shown - self.mean) / self.scale @ self.inner + self.inner_bias, 0.0)
        answer = hidden @ self.outer + self.outer_bias
        power = np.exp(answer - answer.max(axis=1, keepdims=True))
        return np.asarray(power / power.sum(axis=1, keepdims=True))

    def answer(self, evidence: Evidence, region: Region) -> Answer:
        """The surest kind and place of what a region shows."""
        places = candidates(evidence, region)
        share = self.probabilities(features(evidence, region, places))[:, 1:]
        possible = np.array([[kind in OF_SORT[place.sort] for kind in KINDS] for place in places])
        best = np.where(possible, share, 0.0)
        at, kind = np.unravel_index(int(best.argmax()), best.shape)
        each = best.max(axis=0)
        return Answer(KINDS[kind], places[at], dict(zip(KINDS, (each / each.sum()).tolist(), strict=True)))


@cache
def trained() -> Classifier:
    """The classifier that comes with the project."""
    return Classifier.load()
