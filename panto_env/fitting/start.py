"""Where the simulated pass of a fit begins: at rest at the line's first support, or well before the records.

A simulated pass begins pressed to the wire at rest, and 20 spans on, its force is still 2.4 N off what it
settles to, 0.5 N after 40 (``en50318-2002``, ``dsa380``, 220 km/h). A measured train comes from elsewhere:
its pass has settled where the record begins. A record of a simulated pass has the start in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..records.record import Piece
from .measured import Measured, measured

LEAD = 48
"""Spans of the line as designed that a train has run where a record begins, if it has settled there."""
TELLING = 10
"""Spans from the line's first support on whose force tells whether a pass began there."""
GRID = 0.25
"""Distance of the places (m) that are tried for a record."""


def spans_before(
    pieces: Sequence[Piece],
    line: FlexibleCatenaryData,
    force_of: Callable[[Piece, Measured], Array],
) -> int:
    """Spans of the line before the simulated ones; below 0 where these begin before its first support.

    line: one that goes on as it is, before and behind its spans.
    force_of: of a train that begins at rest at the first support of the simulated line, as designed, at the
    places of a piece (N). Only pieces that begin in the line's first span can hold such a start: these are
    asked which of both they are more like. All others have settled.
    """
    span = line.span_length
    settled = math.floor(min(float(piece.position[0]) for piece in pieces) / span) - LEAD
    near = [piece for piece in pieces if piece.position[0] < span]
    alike = {0: 0.0, settled: 0.0}
    for piece in near:
        for before in alike:
            begin = max(float(piece.position[0]) - before * span, 0.0)
            try:
                own = measured(piece, before * span, (begin, begin + TELLING * span), span)
            except InputError:
                continue  # such a piece cannot be compared, and whoever asks says why
            alike[before] += rough_shift(own, force_of(piece, own), 0.5 * span)[1]
    return 0 if alike[0] > alike[settled] else settled


def rough_shift(own: Measured, force: Array, reach: float) -> tuple[float, float]:
    """By how much positions are short, roughly (m), and how measured and simulated force correlate there.

    force: simulated (N), at the places of ``own``; reach: how far to look (m).
    """
    trials = GRID * np.arange(-math.floor(reach / GRID), math.floor(reach / GRID) + 1)
    expected = own.coefficients(force)
    scores = []
    for trial in trials:
        seen = own.coefficients(own.force(float(trial)))
        scores.append(float(seen @ expected / np.linalg.norm(seen)))
    best = int(np.argmax(scores))
    return float(trials[best]), scores[best] / float(np.linalg.norm(expected))
