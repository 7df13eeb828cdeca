"""Why a record is unlike a run or a line: it runs backwards, is of another pantograph, or in other units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..base.arrays import METRES_PER_SECOND, Array
from ..base.errors import InputError
from ..metrics.trajectory import Trajectory
from .record import Samples, Shift, find_shift

UNLIKE = 0.5
"""Correlation below which a run and a record are of different lines, so that figures agree by chance."""
USUAL = 0.8
"""Correlation below which something is wrong, or the line worn. Simulated records of eleven lines as built
correlate with a run on the line as designed by 0.82 to 0.96, worn ones by 0.61 to 0.94; trailing pantographs
with a run of one alone by 0.40 to 0.78, another line's by 0.08 to 0.60."""
BETTER = 0.1
"""How much more another reading of a record must correlate to be called the right one. Own choice."""
SUM = 1.5
"""Ratio of mean forces from which on they can't be of one pantograph under the same force. Own choice."""
PERIODIC, MORE, FEWEST = 0.3, 0.2, 8
"""Share of a force's variance that must repeat at another period to call that the spans', how much more than
repeats at their own, and how often it must do so. On equal spans, as built or worn, 0.63 to 0.92 repeat."""
PARTS = 64
"""Parts of a span whose mean forces are compared."""


def check_reading(
    samples: Samples, run: Trajectory, begin: float, end: float, near: float | None, found: Shift
) -> None:
    """Raise InputError where a record is clearly more like the run if it is read in another way.

    begin, end, near: as for ``find_shift``, which found the shift of the record as it is.
    """
    for words, others, than in _readings(samples, run):
        try:
            correlation = find_shift(others, than, begin, end, near).correlation
        except InputError:  # less than a span in common
            continue
        if correlation >= max(found.correlation + BETTER, UNLIKE):
            raise InputError(words.format(f"{correlation:.2f} instead of {found.correlation:.2f}"))


def _readings(samples: Samples, run: Trajectory) -> Iterator[tuple[str, Samples, Trajectory]]:
    """Other ways to read a record: what to say of each, the samples, and the run to hold them against."""
    pieces = samples.record.pieces
    ends = min(each.position[0] for each in pieces) + max(each.position[-1] for each in pieces)
    backwards = tuple(
        replace(each, position=ends - each.position[::-1], force=each.force[::-1])
        for each in reversed(pieces)
    )
    yield (
        "Read backwards the record correlates with {} with the run: the train may have run the other way, or "
        "the positions against it; turn the record's positions, or the line.",
        Samples(replace(samples.record, pieces=backwards)),
        run,
    )
    for number, other in enumerate(run.train[1:], start=2):
        yield (
            f"With pantograph {number} of the run's train the record correlates with {{}}: it may be of "
            "that one; compare the record of the first.",
            samples,
            other,
        )


def check_period(samples: Samples, length: float) -> None:
    """Raise InputError where the force repeats at 3.6 times the length (m) of equal spans, or a 3.6th.

    Nothing is found on unequal spans, where no period repeats.
    """
    position, force = samples.position, samples.in_place
    own = repeated(position, force, length)
    for factor, read, other in ((METRES_PER_SECOND, "km/h", "m/s"), (1 / METRES_PER_SECOND, "m/s", "km/h")):
        share = repeated(position, force, length * factor)
        if share >= max(PERIODIC, own + MORE) and np.ptp(position) >= FEWEST * length * factor:
            raise InputError(
                f"The force repeats every {length * factor:.3g} m, {factor:.3g} times the {length:.3g} m of "
                f"a span: positions were made from a speed in {read} as if it were in {other}; name the "
                f"unit: --unit speed={read}."
            )


def repeated(position: Array, force: Array, period: float) -> float:
    """Share of the variance of forces, (n,), N, at positions, (n,), m, that repeats with a period (m)."""
    part = (position / period % 1.0 * PARTS).astype(np.intp)
    count, total = np.bincount(part, minlength=PARTS), np.bincount(part, force, minlength=PARTS)
    met = count > 0
    mean = total[met] / count[met]
    return float(np.average((mean - force.mean()) ** 2, weights=count[met]) / force.var())


def doubts(found: Shift, ratio: float) -> list[str]:
    """Sentences on what is unusual: the correlation, and the ratio of the mean forces, record over run."""
    sentences = []
    if not 1 / SUM < ratio < SUM:
        sentences.append(
            f"The record's mean force is {ratio:.2g} times the run's: it may be the sum of two pantographs, "
            "or of only one strip of the head, or the run's static force may be another."
        )
    if found.correlation < USUAL:
        lead = "hardly resemble each other" if found.correlation < UNLIKE else "are less alike than usual"
        sentences.append(
            f"Record and run {lead} (correlation {found.correlation:.2f}; of a line as built it is 0.8 and "
            "more, of a worn one 0.6): the record may be of a trailing pantograph (simulate the train: "
            "--distances), of another pantograph, of another line, the shift beyond the search, or columns "
            "may be swapped."
        )
    return sentences
