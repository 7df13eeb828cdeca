"""Static shape of a line whose spans differ, from end to end.

Both wires are solved along the whole line. Its ends are as if the line went on there, mirrored: at the
gradient of the outermost span, with half of a support's stiffness and load. A line of equal spans that are
symmetric has the shape of one span that repeats, up to its ends.
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from ....base.arrays import Array
from .beams import GRAVITY, LongWire
from .schema import FlexibleCatenaryData
from .shape import StaticShape, settled, stiffness_of, unloaded
from .spans import spans_of
from .stitched_static import StitchedMessenger
from .stitches import stitches_of


def settle_line(line: FlexibleCatenaryData) -> StaticShape:
    """The static shape of a whole line, its droppers in their order along it."""
    spans, contact_heights, encumbrances = spans_of(line)
    supports, heights = np.array(line.alignment().supports), np.array(contact_heights)
    tops = heights + np.array(encumbrances)  # of the messenger's supports without load
    counts = [len(span.droppers.positions) for span in spans]
    own = [slice(end - count, end) for end, count in zip(accumulate(counts), counts, strict=True)]
    x = np.concatenate(
        [begin + span.droppers.positions for begin, span in zip(supports, spans, strict=False)]
    )
    sag = np.concatenate([span.droppers.sag for span in spans])
    masts = np.arange(len(supports)) + np.append(0, np.cumsum(counts))  # nodes
    hung = np.delete(np.arange(len(supports) + len(x)), masts)
    breaks = np.zeros(len(supports) + len(x))
    breaks[masts], breaks[hung] = supports, x

    at_supports = (*spans, spans[-1])
    holding = np.flatnonzero([span.steady_arm.holds_wire for span in at_supports])
    held = np.concatenate([hung, masts[holding]])
    lower_heights = np.interp(x, supports, heights) - sag
    lower = LongWire(line.contact_wire, breaks, _end_slopes(supports, heights), np.zeros(len(breaks)))
    contact, lifts = lower.hang(held, np.append(lower_heights, heights[holding]), np.zeros(len(breaks)))
    lift = lifts[: len(x)]

    springs = np.zeros(len(breaks))
    springs[masts] = [span.support.stiffness for span in at_supports]
    springs[[0, -1]] /= 2
    slopes, stitches = _end_slopes(supports, tops), stitches_of(line)
    stitched = None
    if len(stitches.support):
        stitched = StitchedMessenger(
            line.messenger_wire, stitches, x, supports, springs[masts], (0.0, float(supports[-1])), slopes
        )
    upper = LongWire(line.messenger_wire, breaks, slopes, springs)
    raised = np.zeros(len(breaks))
    raised[masts] = springs[masts] * tops
    no_nodes = np.zeros(0, dtype=np.int64)

    def hang(pulled: Array) -> tuple[Array, Array]:
        """Unknowns above droppers that pull down (N), and heights of the droppers' upper ends (m)."""
        if stitched is not None:
            above = stitched.hang(tops, -pulled)
            return above, above[stitched.tops]
        forces = raised.copy()
        forces[hung] -= pulled
        above, _ = upper.hang(no_nodes, np.zeros(0), forces)
        return above, above[2 * hung]

    def of_droppers(key: str) -> Array:
        return np.repeat([getattr(span.droppers, key) for span in spans], counts)

    per_length = of_droppers("mass")
    below, over = of_droppers("contact_clamp_mass"), of_droppers("messenger_clamp_mass")

    def cut(length: Array) -> tuple[Array, tuple[Array, Array, Array]]:
        dropper_mass = per_length * length
        tension = lift + GRAVITY * (dropper_mass / 2 + below)
        above, ends = hang(tension + GRAVITY * (dropper_mass / 2 + over))
        loaded = ends - lower_heights
        new = [unloaded(span.droppers, loaded[k], tension[k]) for span, k in zip(spans, own, strict=True)]
        return np.concatenate(new), (above, tension, dropper_mass)

    first = np.repeat([span.encumbrance for span in spans], counts)
    length, (above, tension, mass) = settled(line.name, first, cut)
    stiffness = [stiffness_of(span.droppers, length[k]) for span, k in zip(spans, own, strict=True)]
    return StaticShape(
        contact=lower.profile(contact),
        messenger=upper.profile(above) if stitched is None else stitched.profile(above, repeats=False),
        arm_force=lifts[len(x) :],
        dropper_tension=tension,
        dropper_length=length,
        dropper_stiffness=np.concatenate(stiffness),
        dropper_mass=mass,
        spans=len(spans),
        ropes=() if stitched is None else stitched.shapes(above),
    )


def _end_slopes(supports: Array, heights: Array) -> tuple[float, float]:
    """Slopes of the straight lines between the first two and the last two supports."""
    slopes = np.diff(heights) / np.diff(supports)
    return float(slopes[0]), float(slopes[-1])
