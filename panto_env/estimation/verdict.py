"""Whether an estimate is to be believed, from its innovations.

The bounds are effect sizes, not those of a test: of thousands of samples a test refuses every real
pantograph. They are set from simulated records (own choice): parameters 5 % wrong at 150 to 350 km/h stay
well within; a sensor off by 10 % of scale, noise twice as large as said, a jump of 1 mm and a sensor dead for
80 ms lie beyond.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .innovations import Consistency

NIS = (1 / 1.5, 1.5)
"""Of a whole record: innovations as large as expected, but for so much in their square."""
WINDOW_NIS = 2.5
"""Of any piece of it."""
CORRELATION = 0.6
"""Of normalised innovations some samples apart: more is motion that the model does not explain."""
SUSPENSION_ERROR = 20.0
"""Force (N) that the head's suspension may be wrong by in the mean: some 3 mm of most suspensions."""


class Verdict(NamedTuple):
    """Believe it or not, and why not."""

    believe: bool
    reasons: tuple[str, ...]  # clauses; none where it is believed


def judge(tested: Consistency, suspension_error: float) -> Verdict:
    """Judge by innovations and by the error (N) that the filter found of the suspension's mean force."""
    reasons = []
    if tested.nis > NIS[1]:
        reasons.append(
            f"innovations are {tested.nis:.2g} times as large as expected (squared): more noise than said, a "
            "sensor's scale, or a wrong pantograph"
        )
    if tested.nis < NIS[0]:
        reasons.append(
            f"innovations are {tested.nis:.2g} times as large as expected (squared): less noise than said, "
            "so that the estimate is slower than it could be"
        )
    worst = int(np.argmax(tested.window_nis))
    if tested.window_nis[worst] > WINDOW_NIS * max(tested.nis, 1.0):
        reasons.append(
            f"about {tested.window_time[worst]:.4g} s they are {tested.window_nis[worst]:.2g} times as "
            "large: a sensor jumps or fails there"
        )
    if abs(tested.whiteness.largest) > CORRELATION:
        reasons.append(
            f"innovations resemble those before by {tested.whiteness.largest:.2f}: motion that the model "
            "does not explain, from a sensor's scale or a wrong pantograph"
        )
    if abs(suspension_error) > SUSPENSION_ERROR:
        reasons.append(
            f"the head's suspension carries {suspension_error:+.0f} N more than the lift leaves: the lift, a "
            "spring or a zero of the heights is wrong, and with the lift the mean force"
        )
    return Verdict(not reasons, tuple(reasons))
