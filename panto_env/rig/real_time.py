"""A rig's computer against the wall clock: whether each step is done in time in a process of Python."""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .computer import RigComputer

SLEEP_UNTIL = 2e-4
"""Time before a deadline (s) until which the process sleeps; from then on it looks at the clock."""


@dataclass(frozen=True)
class Timing:
    """Times of a computer's steps, in one run against the clock."""

    interval: float  # s
    steps: Array  # (samples,): time that a step took (s)
    late: Array  # (samples,): how late it began (s)

    @property
    def missed(self) -> int:
        """Steps that were not done when the next one was due."""
        return int(np.count_nonzero(self.steps + self.late > self.interval))

    @property
    def headroom(self) -> float:
        """Intervals over the median step: how much more could be computed, were there no jitter."""
        return self.interval / float(np.median(self.steps))

    def of_step(self, share: float) -> float:
        """Time (s) within which this share of the steps was done."""
        return float(np.quantile(self.steps, share))


def against_the_clock(computer: RigComputer, seconds: float) -> Timing:
    """Step a computer at its interval for so long, under a force as of a pantograph, by the wall clock.

    At the line's end it begins anew. Python's garbage collector is off meanwhile, as a rig's program would
    have it. Raises InputError for a time without a step.
    """
    count, interval = round(seconds / computer.interval), computer.interval
    if count < 1:
        raise InputError(
            f"Against the clock a rig's computer must run for {interval:g} s or longer, a step of its own, "
            f"not for {seconds:g} s."
        )
    steps, late = np.zeros(count), np.zeros(count)
    force = 120 + 40 * np.sin(2 * np.pi * 1.2 * interval * np.arange(count))
    enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter() + interval
        for k in range(count):
            due = start + k * interval
            while (left := due - time.perf_counter()) > 0:
                if left > SLEEP_UNTIL:
                    time.sleep(left - SLEEP_UNTIL)
            if computer.ended:
                computer.reset()
            begin = time.perf_counter()
            computer.step(force[k])
            steps[k], late[k] = time.perf_counter() - begin, begin - due
    finally:
        if enabled:
            gc.enable()
    return Timing(interval, steps, late)
