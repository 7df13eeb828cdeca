"""Records of a measuring train side by side with healthy passes, which a fitted line gives.

Healthy passes are simulated on lines that the fit may mean: each with values drawn from what the fit knows,
and with the noise that its records had, seen by sensors with a gain and a zero of their own, as a fit expects
them. So what the fit does not know, or a sensor shows wrongly, is not taken for a defect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import ValidationError

from ..base.arrays import Array, from_kmh
from ..base.errors import InputError
from ..fitting.misfit import OWN, Part
from ..fitting.passes import Measured
from ..fitting.problem import problem
from ..fitting.solve import Fitting
from ..fitting.stored import Stored, turned
from ..fitting.values import FREE
from ..plant.alignment import Alignment
from ..plant.pantograph.schema import PantographData
from ..records.record import Record
from .passes import LEAD, SPEEDS, Passes, places_of, places_per_span

HEALTHY = 24
"""Healthy passes that are simulated: enough to know how much they differ."""
AWAY = 0.5
"""Distance (m) on each side of a record's rough place within which it is placed finely."""


def measured_passes(
    records: Sequence[Record], known: Stored, seed: int = 0
) -> tuple[Passes, Passes, tuple[str, ...]]:
    """Records to be judged, and healthy passes over the line of a fit, as ``Passes`` hold them; and notes.

    seed: of the healthy passes' lines and noise. Raises InputError for records of different speeds, for those
    that cover no two spans of the fit's stretch together, and as ``fitting.problem.problem`` does.
    """
    try:
        line = known.design
        pantograph = PantographData.model_validate_json(known.pantograph)
    except ValidationError as error:
        raise InputError(
            "The line or the pantograph of the fit is none that this version knows; fit the records anew."
        ) from error
    kinds = [kind for kind in FREE if any(value.kind == kind for value in known.values)]
    tolerances = {value.kind: value.tolerance for value in known.values if value.kind != "unevenness"}
    single, notes = _one_piece_each(records, known.compared)
    ready = problem(single, line, pantograph, free=kinds, tolerances=tolerances)
    parts, plan = ready.parts, ready.values.design
    speeds = np.array([part.measured.piece.speed_kmh for part in parts])
    if np.ptp(speeds) > SPEEDS * speeds.min():
        raise InputError(
            f"Records at {speeds.min():.4g} and {speeds.max():.4g} km/h cannot be judged together: speeds "
            f"may differ by {100 * SPEEDS:g} %."
        )
    before, alignment = ready.before, line.alignment(plan.first_span + plan.spans)
    first, per_span, position = _places(alignment, before, parts, known, float(speeds.mean()))
    random = np.random.default_rng(seed)
    mean, covariance = _values(ready, known)
    drawn = random.multivariate_normal(mean, covariance, HEALTHY, method="eigh")
    healthy, measured = np.zeros(0), []
    for part in parts:
        own = part.measured
        static, usual = _usual(ready, part, mean)
        seen = _finely(own, usual)
        if not healthy.size:
            gain, zero = (OWN[name] * random.standard_normal(HEALTHY) for name in ("gain", "zero"))
            variants = [ready.values.variant(x, static + z) for x, z in zip(drawn, zero, strict=True)]
            forces = own.coefficients(ready.sampled(part, variants)) * (1 + gain[:, None])
            forces += known.noise[own.band] * random.standard_normal(forces.shape)
            healthy = np.array([np.interp(position - before, own.place, own.back(each)) for each in forces])
        # What the first record's speed makes is the others', too: only what differs is the line's.
        away = np.interp(position - before, own.place, own.back(seen - usual))
        measured.append(healthy.mean(axis=0) + away)
    droppers, speed = plan.layout.positions + before, from_kmh(float(speeds.mean()))
    facts = (alignment, first, per_span, droppers, line.name, speed, line.contact_wire.wave_speed)
    both = Passes(np.array(measured), *facts), Passes(healthy, *facts)
    return *both, (*notes, *ready.of_records)


def _one_piece_each(
    records: Sequence[Record], stretch: tuple[float, float]
) -> tuple[list[Record], list[str]]:
    """Records of one piece each, that which covers most of a stretch (m), and what is left out so."""
    found, notes = [], []
    for record in records:
        if len(record.pieces) > 1:
            begin, end = stretch
            ways = [min(piece.position[-1], end) - max(piece.position[0], begin) for piece in record.pieces]
            longest = record.pieces[int(np.argmax(ways))]
            notes.append(
                f"{record.name} has {len(ways)} pieces, and a diagnosis takes one of each record: that from "
                f"{longest.position[0]:,.0f} to {longest.position[-1]:,.0f} m."
            )
            record = replace(record, pieces=(longest,))
        found.append(record)
    return found, notes


def _places(
    alignment: Alignment, before: float, parts: Sequence[Part], known: Stored, speed_kmh: float
) -> tuple[int, int, Array]:
    """Spans before the first place, places in a span, and positions (m) of all that records and fit share."""
    begin = max(known.compared[0], *(before + part.measured.place[0] for part in parts))
    end = min(known.compared[1], *(before + part.measured.place[-1] for part in parts))
    first, last = math.ceil(alignment.in_spans(begin) - 1e-6), math.floor(alignment.in_spans(end) + 1e-6)
    if last - first <= LEAD:
        raise InputError(
            f"Fit and records share {max(end - begin, 0.0):.0f} m from {begin:,.0f} m on; a diagnosis takes "
            "two whole spans: give records of the fit's stretch."
        )
    per_span = places_per_span(alignment.mean_length, speed_kmh)
    return first, per_span, places_of(alignment, first, per_span, (last - first) * per_span)


def _values(ready: Fitting, known: Stored) -> tuple[Array, Array]:
    """What a fit knows of the values of another one: means, (values,), and covariance.

    Of values that are not in it only the tolerance is known.
    """
    numbers = {value.name: number for number, value in enumerate(known.values)}
    values = ready.values.all
    own = np.array([numbers.get(value.name, -1) for value in values])
    there = np.flatnonzero(own >= 0)
    mean, covariance = np.zeros(len(own)), np.diag(ready.values.tolerances**2)
    mean[there] = known.difference[own[there]]
    covariance[np.ix_(there, there)] = known.covariance[np.ix_(own[there], own[there])]
    return turned(values, ready.before, mean, covariance)


def _usual(ready: Fitting, part: Part, mean: Array) -> tuple[float, Array]:
    """Static force (N) with which a simulated pass has the record's mean force, and its coefficients."""
    values = ready.values
    static = values.design.pantograph.static_force
    force = ready.sampled(part, [values.variant(mean, static)])[0]
    static += float(part.measured.force().mean() - force.mean())
    force = ready.sampled(part, [values.variant(mean, static)])[0]
    return static, part.measured.coefficients(force)


def _finely(own: Measured, usual: Array) -> Array:
    """Coefficients of a record at the place where it is most like the usual pass."""
    from scipy.optimize import minimize_scalar  # slow to import

    def away(shift: float) -> float:
        return float(np.sum((own.coefficients(own.force(shift)) - usual) ** 2))

    best = minimize_scalar(away, bounds=(-AWAY, AWAY), method="bounded")
    return own.coefficients(own.force(float(best.x)))
