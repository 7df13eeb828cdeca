"""The lines that a family or a section draws under many seeds: whether each hangs, runs and is plausible."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from ..base.arrays import to_kmh
from ..base.table import Alarm, Table
from ..catalog.en50119 import gradients
from ..catalog.family import LineFamily
from ..catalog.section import LineSection
from ..control.lines import line_generator, line_of_seed
from ..plant.catenary.flexible import FlexibleCatenaryData
from ..plant.catenary.flexible.elasticity import elasticity, non_uniformity
from ..plant.catenary.flexible.spans import spans_of
from .pool import Progress, in_processes
from .simulation import simulate

Drawn: TypeAlias = LineFamily | LineSection


@dataclass(frozen=True)
class DrawnLine:
    """A line drawn from a family or a section, and a passive run at the highest speed of its trains.

    Values of spans that differ are means where nothing else is said.
    """

    seed: int
    draws: int  # until the line was taken
    milliseconds: float  # to draw it
    length: float  # of the line (m)
    span_length: float  # m
    shortest_span: float  # m
    longest_span: float  # m
    gradient: float  # maximum, up or down (‰)
    gradient_change: float  # maximum, at a support (‰)
    droppers: float  # of a span
    encumbrance: float  # m
    pre_sag: float  # maximum (m)
    contact_tension: float  # kN
    messenger_tension: float  # kN
    wave_speed_kmh: float
    speed_kmh: float  # of the run
    force_deviation: float  # sigma over mean force (-); nan where the run ended early, as the next
    uplift: float  # m
    elasticity: float  # maximum (m/N)
    non_uniformity: float  # of the elasticity (%)
    ending: str  # where and why the run ended early; empty if it did not

    def outside(self, lines: Drawn) -> list[str]:
        """Names of the values that lie outside the bands; all of a run that ended early."""
        bands = lines.plausible.model_dump(exclude={"pantograph"})
        return [name for name, (low, high) in bands.items() if not low <= getattr(self, name) <= high]


LABELS = {
    "draws": "draws until a line is taken",
    "milliseconds": "time to draw it (ms)",
    "length": "length of the line (m)",
    "span_length": "span (m)",
    "shortest_span": "shortest span (m)",
    "longest_span": "longest span (m)",
    "gradient": "maximum gradient (‰)",
    "gradient_change": "maximum change of gradient (‰)",
    "droppers": "droppers of a span",
    "encumbrance": "encumbrance (m)",
    "pre_sag": "pre-sag (m)",
    "contact_tension": "tension of the contact wire (kN)",
    "messenger_tension": "tension of the messenger (kN)",
    "wave_speed_kmh": "wave speed (km/h)",
    "speed_kmh": "highest speed of trains (km/h)",
    "force_deviation": "σ / F_m at that speed",
    "uplift": "uplift at a support at that speed (m)",
    "elasticity": "maximum elasticity (m/N)",
    "non_uniformity": "non-uniformity of the elasticity (%)",
}
OF_SECTIONS = ("length", "shortest_span", "longest_span", "gradient", "gradient_change")
"""Values that say nothing of a line whose spans are all alike."""


def drawn_line(lines: Drawn, seed: int) -> DrawnLine:
    """The line of a seed, the one that an environment with this seed has, and a run on it."""
    begun = time.perf_counter()
    line, (_, speed_kmh) = line_of_seed(lines, seed)
    milliseconds = 1e3 * (time.perf_counter() - begun)
    assert isinstance(line, FlexibleCatenaryData)
    own = line_generator(np.random.default_rng(seed))
    draws = 1 + next(k for k, one in enumerate(lines.drawn(own, (0.0, lines.fastest_kmh))) if one is not None)
    run = simulate(line, lines.plausible.pantograph, speed_kmh, record_droppers=False)
    figures = None if run.terminated else run.summary()
    _, yields = elasticity(line, run.nominal_force)
    each, heights, encumbrances = spans_of(line)
    alignment = line.alignment()
    slopes, changes = gradients(heights, alignment.supports)
    return DrawnLine(
        seed=seed,
        draws=draws,
        milliseconds=milliseconds,
        length=alignment.length,
        span_length=alignment.mean_length,
        shortest_span=float(alignment.lengths.min()),
        longest_span=float(alignment.lengths.max()),
        gradient=float(np.abs(slopes).max()),
        gradient_change=float(np.abs(changes).max()),
        droppers=float(np.mean([len(span.droppers.positions) for span in each])),
        encumbrance=float(np.mean(encumbrances)),
        pre_sag=max(max(span.droppers.sag) for span in each),
        contact_tension=line.contact_wire.tension / 1e3,
        messenger_tension=line.messenger_wire.tension / 1e3,
        wave_speed_kmh=to_kmh(line.contact_wire.wave_speed),
        speed_kmh=speed_kmh,
        force_deviation=figures.std / figures.mean if figures else np.nan,
        uplift=figures.max_uplift if figures else np.nan,
        elasticity=float(yields.max()),
        non_uniformity=non_uniformity(yields),
        ending=run.ending,
    )


def drawn_lines(lines: Drawn, seeds: Sequence[int], progress: Progress | None = None) -> list[DrawnLine]:
    """The lines of all seeds, on all cores; with progress as ``in_processes`` reports it."""
    return in_processes([partial(drawn_line, lines, seed) for seed in seeds], progress=progress)


def table(lines: Drawn, found: Sequence[DrawnLine]) -> Table:
    """Minimum, median and maximum of each value, its band, and how many lines lie outside it."""
    outside = [one.outside(lines) for one in found]
    rows = []
    for name, label in LABELS.items():
        if name in OF_SECTIONS and not isinstance(lines, LineSection):
            continue
        values = np.array([getattr(one, name) for one in found], dtype=float)
        band, beyond = getattr(lines.plausible, name, None), sum(name in each for each in outside)
        rows.append(
            (
                label,
                *(float(np.nanquantile(values, share)) for share in (0.0, 0.5, 1.0)),
                "" if band is None else f"{band[0]:g} to {band[1]:g}",
                "" if band is None else Alarm(beyond) if beyond else "0",
            )
        )
    title = f"{len(found)} lines of {lines.kind} {lines.name}"
    return Table(title, ("value", "minimum", "median", "maximum", "plausible", "lines outside"), rows)


def facts(lines: Drawn, found: Sequence[DrawnLine]) -> list[dict[str, Any]]:
    """All lines as plain data, with what lies outside the bands."""
    return [asdict(one) | {"outside": one.outside(lines)} for one in found]
