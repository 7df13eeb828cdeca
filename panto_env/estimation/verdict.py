"""Whether an estimate is to be believed, from its innovations.

The bounds are effect sizes, not those of a test: of thousands of samples a test refuses every real
pantograph. They are set from simulated records (own choice): parameters 5 % wrong at 150 to 350 km/h stay
well within; a sensor off by 10 % of scale, noise twice as large as said, a jump of 1 mm and a sensor dead for
80 ms lie beyond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.errors import beside
from .innovations import Consistency

NIS = (0.667, 1.5)
"""Of a whole record: innovations as large as expected, but for so much in their square."""
WINDOW_NIS = 2.5
"""Of any piece of it; where those of the whole record are larger than expected, as many times as large."""
CORRELATION = 0.6
"""Of normalised innovations some samples apart: more is motion that the model does not explain."""
SUSPENSION_ERROR = 20.0
"""Force (N) that the head's suspension may be wrong by in the mean: some 3 mm of most suspensions."""


class Test(NamedTuple):
    """A figure that an estimate is judged by: it is kept from ``low`` to ``high``, both included."""

    name: str
    value: float
    low: float
    high: float
    otherwise: str  # what is probably wrong where it does not, as a clause

    @property
    def kept(self) -> bool:
        """Whether the figure lies within its bounds."""
        return self.low <= self.value <= self.high

    @property
    def bounds(self) -> str:
        """The bounds as text."""
        return f"up to {self.high:.3g}" if self.low == 0 else f"{self.low:.3g} to {self.high:.3g}"

    @property
    def text(self) -> str:
        """The value as text, on its side of the bounds as text."""
        return beside(self.value, min(self.low, self.high, key=lambda bound: abs(bound - self.value)), ".3g")


class Verdict(NamedTuple):
    """Believe it or not, and why not."""

    tests: tuple[Test, ...]

    @property
    def believe(self) -> bool:
        """Whether all tests are kept."""
        return all(test.kept for test in self.tests)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Clauses; none where it is believed."""
        return tuple(
            f"{test.name}: {test.text}, not {test.bounds}: {test.otherwise}"
            for test in self.tests
            if not test.kept
        )


def window_bound(nis: float) -> float:
    """Maximum of a piece's squared innovations over those expected, with as many digits as are shown."""
    return float(f"{WINDOW_NIS * max(nis, 1.0):.3g}")


def judge(tested: Consistency, suspension_error: float) -> Verdict:
    """Judge by innovations and by the error (N) that the filter found of the suspension's mean force."""
    worst = int(np.argmax(tested.window_nis))
    more = "more noise than said, a sensor's scale, or a wrong pantograph"
    less = "less noise than said, so that the estimate is slower than it could be"
    return Verdict(
        (
            Test(
                "innovations squared, over those expected", tested.nis, *NIS, more if tested.nis > 1 else less
            ),
            Test(
                f"the same about {tested.window_time[worst]:.4g} s, where it is largest",
                float(tested.window_nis[worst]),
                0.0,
                window_bound(tested.nis),
                "a sensor jumps or fails there",
            ),
            Test(
                "their autocorrelation, the largest in size",
                tested.whiteness.largest,
                -CORRELATION,
                CORRELATION,
                "motion that the model does not explain, from a sensor's scale or a wrong pantograph",
            ),
            Test(
                "force of the head's suspension beyond what the lift leaves (N)",
                suspension_error,
                -SUSPENSION_ERROR,
                SUSPENSION_ERROR,
                "the lift, a spring or a zero of the heights is wrong, and with the lift the mean force",
            ),
        )
    )
