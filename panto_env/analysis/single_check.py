"""A single wire or a rail at rest: how far it sags, and how it yields, in spans of each of its lengths."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.arrays import one_thread, to_kmh
from ..base.table import Table
from ..plant.catenary.flexible.as_run import non_uniformity
from ..plant.catenary.flexible.shape import solve_band
from ..plant.catenary.single import SingleData
from ..plant.catenary.single.model import Single, lower_diagonals
from ..plant.numerics import Numerics, Runs

SPANS, MIDDLE, ELEMENTS = 15, 7, 128
"""Spans of the line that stands for one without ends, the one that is looked at, elements of each."""


class SpanOfSingle(NamedTuple):
    """Spans of one length, in a line of nothing but such spans."""

    length: float  # m
    sag: float  # at mid-span below the supports (m)
    at_support: float  # uplift per newton there (m/N)
    at_middle: float  # and at mid-span (m/N)
    non_uniformity: float  # of the elasticity (%)
    first_frequency: float  # at which neighbouring spans swing against each other, over firm supports (Hz)


def spans_at_rest(line: SingleData) -> list[SpanOfSingle]:
    """Each length of the line's spans, the shortest first."""
    return [_at_rest(line, length) for length in sorted({*line.span_lengths} or {line.span_length})]


def _at_rest(line: SingleData, length: float) -> SpanOfSingle:
    alike = line.model_copy(update={"span_length": length, "span_lengths": (), "ramp": None})
    numerics = Numerics(spacing=length / ELEMENTS, window=0)
    model = Single(alike, lanes=1, collectors=1, spans=SPANS, numerics=numerics, runs=Runs((1.0, 1.0)))
    elements, wire = model.line.elements, line.contact_wire
    band = lower_diagonals(model.line, np.full(SPANS * elements, length / elements))
    band[0, 2 * elements : -2 : 2 * elements] += line.support.stiffness
    band[:, 0] = band[:, -2] = 0.0  # both ends are held
    band[0, [0, -2]], band[1, -3], band[2, -4], band[3, -5] = 1.0, 0.0, 0.0, 0.0
    nodes = MIDDLE * elements + np.arange(elements + 1)
    load = np.zeros((band.shape[1], len(nodes)))
    load[2 * nodes, np.arange(len(nodes))] = 1.0
    with one_thread():
        yields = np.diagonal(solve_band(band, load)[2 * nodes])
    k = math.pi / length
    frequency = k * math.sqrt((wire.tension + wire.bending_stiffness * k**2) / wire.mass) / (2 * math.pi)
    sag = -float(model.line.rest[nodes[elements // 2], 0])
    at_support, at_middle = float(yields[0]), float(yields[elements // 2])
    return SpanOfSingle(length, sag, at_support, at_middle, non_uniformity(yields), frequency)


def table_at_rest(line: SingleData, spans: list[SpanOfSingle]) -> Table:
    """These spans as a table to print."""
    wave = line.wave_speed
    limit = f"waves run at {to_kmh(wave):.0f} km/h" if math.isfinite(wave) else "bending carries its waves"
    columns = {
        "span (m)": lambda each: f"{each.length:g}",
        "sag (mm)": lambda each: f"{1e3 * each.sag:.1f}",
        "elasticity at support (mm/N)": lambda each: f"{1e3 * each.at_support:.4g}",
        "at mid-span (mm/N)": lambda each: f"{1e3 * each.at_middle:.4g}",
        "non-uniformity u (%)": lambda each: f"{each.non_uniformity:.1f}",
        "first frequency (Hz)": lambda each: f"{each.first_frequency:.2f}",
    }
    return Table.of(f"Line {line.name} at rest, away from its ends; {limit}", spans, columns)
