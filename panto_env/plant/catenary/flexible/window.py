"""Spans of a line that a run needs: about the train, and beyond the end of its pass.

What a line sends back from beyond the window is missing. Waves come back from the farther, the slower the
train is, and first along the faster wire; so the share of that wire's wave speed decides how many spans are
enough. A whole line has an anchor at its far end, which reflects waves too: a line is long enough if the
train meets none of them before its pass ends.
"""

from __future__ import annotations

import math
import warnings

from ....base.arrays import to_kmh
from ....base.errors import AccuracyWarning, InputError
from ...numerics import Numerics, Runs
from ..schema import CLEAR, MOST_SPANS, Wire

ENOUGH = ((0.25, 32), (0.4, 24), (0.66, 16), (0.82, 8), (1.0, 4))
"""Up to a share of the faster wire's wave speed: spans about the train that make figures as of an endless
line, within 1 % of sigma, maximum and minimum within 1 % of the mean force (docs/validation.md)."""
FAST = 8
"""Maximum number of spans about a train for ``accuracy="fast"``."""
WITH_OVERLAPS = 10
"""Minimum number of spans about a train that passes overlaps, whose anchors send waves back: with 5 or 8 of
them sigma there is wrong by up to 13 or 6 %, with 10 by less than 1 %."""
STITCHED = 40
"""Spans about a slow train on a line with stitch wires, past whose supports waves travel far."""
UNLIKE_SHARE, UNLIKE = 0.58, 24
"""Share of the faster wire's wave speed up to which a line with stitch wires, or of unlike spans, needs more
spans than others, and how many: with 16 the minimum was wrong by 2.7 % of the mean force, sigma by 1.3 %."""
STITCHED_SHARE, STITCHED_ERROR = 0.45, 4
"""Share of the faster wire's wave speed below which a train there is slow, and even so many spans leave an
error in sigma; the error (%)."""
ERRORS = ((16, 3), (8, 5), (5, 15), (0, 60))
"""From a number of spans on: error (%) of figures where more are needed."""


def enough_spans(wires: tuple[Wire, Wire], runs: Runs, stitched: bool = False, unlike: bool = False) -> int:
    """Spans about the slowest train that are enough for figures of an endless line."""
    share = runs.speeds[0] / max(wire.wave_speed for wire in wires)
    if stitched and share < STITCHED_SHARE:
        return STITCHED
    enough = next((spans for limit, spans in ENOUGH if share <= limit), ENOUGH[-1][1])
    return max(enough, UNLIKE) if (stitched or unlike) and share <= UNLIKE_SHARE else enough


def window_of(
    wires: tuple[Wire, Wire],
    numerics: Numerics,
    runs: Runs,
    overlaps: bool = False,
    stitched: bool = False,
    unlike: bool = False,
) -> int:
    """Spans computed about the train; 0: the whole line. overlaps, stitched, unlike: whether the line has
    such, or spans that differ.

    Raises InputError for a given window where the wire itself has defects, or is blown upon before a run.
    """
    whole = any(each.hard_spots or each.worn_stretches or each.side_wind for each in runs.conditions)
    if whole and numerics.window:
        raise InputError(
            "A line with hard_spots, worn_stretches or side_wind is computed as a whole, not in a window "
            f"that travels with the train: leave out window={numerics.window}, or set it to 0."
        )
    if numerics.window is not None or whole:
        return numerics.window or 0
    enough = enough_spans(wires, runs, stitched, unlike)
    if numerics.accuracy != "full":
        enough = min(enough, FAST)
    return max(enough, WITH_OVERLAPS if overlaps else 0)


def clear_spans(
    wires: tuple[Wire, Wire], numerics: Numerics, runs: Runs, last: int, stitched: bool = False
) -> int:
    """Spans of a line beyond the ``last`` one of a pass that keep its far anchor's waves from the train.

    Waves and the train leave the line's start together. Raises InputError where a whole line would be too
    long.
    """
    window = window_of(wires, numerics, runs, stitched=stitched)
    if window:
        return max(CLEAR, window // 2)
    speed, fastest = runs.speeds[0], max(wire.wave_speed for wire in wires)
    if not 0 < speed < math.inf:
        return CLEAR  # refused later, in better words
    needed = math.ceil(last * (fastest + speed) / (2 * speed))
    if needed > MOST_SPANS:
        raise InputError(
            f"At {to_kmh(speed):.3g} km/h waves from a whole line's far anchor would meet the train unless "
            f"the line had {needed:,} spans, but {MOST_SPANS:,} are the maximum; leave out window=0, or give "
            "spans."
        )
    return max(CLEAR, needed - last)


def warn_if_slow(wires: tuple[Wire, Wire], runs: Runs) -> None:
    """Warn of slow trains on a line with stitch wires."""
    limit = STITCHED_SHARE * max(wire.wave_speed for wire in wires)
    if runs.speeds[0] < limit:
        warnings.warn(
            f"Waves travel far along a line with stitch wires: below {to_kmh(limit):.0f} km/h the standard "
            f"deviation may be wrong by up to about {STITCHED_ERROR} % in the default window of {STITCHED} "
            "spans; give window=0 for the whole line.",
            AccuracyWarning,
            stacklevel=4,
        )


def warn_if_short(wires: tuple[Wire, Wire], numerics: Numerics, runs: Runs) -> None:
    """Warn where a given window costs more than 1 % of the figures."""
    window, enough = numerics.window, enough_spans(wires, runs)
    if numerics.accuracy == "full" and window and window < enough:
        error = next(percent for spans, percent in ERRORS if window >= spans)
        warnings.warn(
            f"A window of {window} spans is too short at {to_kmh(runs.speeds[0]):.0f} km/h, where "
            f"{enough} are needed: standard deviation, maximum and minimum may be wrong by up to about "
            f"{error} %; leave out window.",
            AccuracyWarning,
            stacklevel=4,
        )
