"""A line at rest, span by span: gradients, pre-sag, droppers and elasticity, with the limits of EN 50119.

Of a single wire or a rail: how far it sags, and how it yields, in spans of each of its lengths.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple, get_origin, get_type_hints

import numpy as np

from ..base.arrays import Array, one_thread, to_kmh
from ..base.table import Alarm, Table, number
from ..catalog.family import SOURCE, LineFamily, gradient_limits, gradients, highest_speed
from ..catalog.section import LineSection
from ..control.lines import line_generator, line_of_seed
from ..metrics.compliance import Criterion
from ..plant.catenary.flexible.as_run import elasticity, non_uniformity, per_span
from ..plant.catenary.flexible.parts import index_at
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.catenary.flexible.shape import solve_band
from ..plant.catenary.flexible.static import RestingDropper, droppers_at_rest, hang
from ..plant.catenary.single import SingleData
from ..plant.catenary.single.model import Single, lower_diagonals
from ..plant.numerics import Numerics, Runs
from .pool import Progress, in_processes
from .simulation import simulate


class SpanCheck(NamedTuple):
    """One span at rest; heights are those at its first support. One stands for all where all are alike."""

    number: int  # from 1
    begin: float  # position of its first support (m)
    length: float  # m
    encumbrance: float  # m
    contact_height: float  # over the nominal one (m)
    gradient: float  # from support to support (‰)
    change: float  # of gradient at its first support (‰), 0 at the line's first
    pre_sag: float  # maximum sag of the droppers (m)
    smallest_force: float  # in a dropper at rest (N)
    largest_force: float  # N
    smallest_elasticity: float  # m/N; nan in the first and the last of unlike spans
    largest_elasticity: float  # m/N
    non_uniformity: float  # of the elasticity (%)


@dataclass(frozen=True)
class LineCheck:
    """A line at rest."""

    line: FlexibleCatenaryData
    spans: list[SpanCheck]
    droppers: list[RestingDropper]
    places: Array  # of the elasticities, along the line or, where spans are alike, in one (m), (n,)
    elasticities: Array  # m/N, (n,)
    force: float  # with which they are computed (N)

    @property
    def in_span(self) -> tuple[float, float]:
        """Elasticity in mid-span and at a support (m/N), where spans are all alike."""
        middle = index_at(self.places, self.line.span_length / 2)
        return float(self.elasticities[middle]), float(self.elasticities[0])

    @property
    def largest_gradient(self) -> float:
        """Maximum gradient, up or down (‰)."""
        return max(abs(span.gradient) for span in self.spans)

    @property
    def largest_change(self) -> float:
        """Maximum change of gradient at a support (‰)."""
        return max(abs(span.change) for span in self.spans)

    def criteria(self, speed_kmh: float | None = None) -> list[Criterion]:
        """Gradients with their limits for a speed (km/h), if one is given; then values without limits."""
        steepest, change = self.largest_gradient, self.largest_change
        limits = (None, None) if speed_kmh is None else gradient_limits(speed_kmh)
        fastest = highest_speed(steepest, change)
        allowed = {0.0: "at no speed", np.inf: "at any speed"}.get(fastest, f"up to {fastest:g} km/h")
        name, note = "maximum change of gradient", f"{SOURCE}, allows these gradients {allowed}"
        forces = [each.static_force for each in self.droppers]
        yields = 1e3 * self.elasticities
        return [
            Criterion("gradient", "maximum gradient", "‰", _shown(steepest), None, limits[0], SOURCE),
            Criterion("gradient_change", name, "‰", _shown(change), None, limits[1], SOURCE, note),
            Criterion("pre_sag", "maximum pre-sag", "mm", 1e3 * max(each.pre_sag for each in self.spans)),
            Criterion("smallest_dropper_force", "minimum force of a dropper", "N", min(forces)),
            Criterion("largest_dropper_force", "maximum force of a dropper", "N", max(forces)),
            Criterion("largest_elasticity", "maximum elasticity", "mm/N", float(yields.max())),
            Criterion("smallest_elasticity", "minimum elasticity", "mm/N", float(yields.min())),
            Criterion(
                "non_uniformity", "non-uniformity of the elasticity", "%", non_uniformity(self.elasticities)
            ),
        ]


def check(line: FlexibleCatenaryData, force: float) -> LineCheck:
    """A line at rest, and its elasticity under a force (N). Raises InputError where it cannot hang."""
    hang(line)
    droppers = droppers_at_rest(line)
    places, elasticities = elasticity(line, force)
    layout = line.layout()
    spans, supports = layout.spans, layout.supports
    slopes, changes = gradients(layout.contact_heights, supports)
    parts = per_span(places, elasticities)
    inner = range(len(spans)) if not line.sequence else range(1, len(spans) - 1)
    yields = {k: parts[n if line.sequence else 0] for n, k in enumerate(inner)}
    found = []
    for k, span in enumerate(spans if line.sequence else spans[:1]):
        forces = [each.static_force for each in droppers if each.span == k + 1]
        part = yields.get(k, np.array([np.nan]))
        geometry = supports[k], span.span_length, span.encumbrance, span.contact_height
        changing = float(slopes[k]), float(changes[k]), max(span.droppers.sag)
        elastic = float(part.min()), float(part.max()), non_uniformity(part)
        found.append(SpanCheck(k + 1, *geometry, *changing, min(forces), max(forces), *elastic))
    return LineCheck(line, found, droppers, places, elasticities, force)


def span_tables(spans: Sequence[SpanCheck], name: Callable[[int], str] = str) -> list[Table]:
    """Two tables to print: where supports stand, and the spans at rest; name: of a span's number."""
    alike = "" if len(spans) > 1 else "; all spans are alike"

    def elasticities(each: SpanCheck) -> str:
        low, high = each.smallest_elasticity, each.largest_elasticity
        return "–" if np.isnan(low) else f"{1e3 * low:.3f} to {1e3 * high:.3f}"

    number_of = {"span": lambda each: name(each.number)}
    placed = number_of | {
        "from (m)": lambda each: f"{each.begin:g}",
        "length (m)": lambda each: f"{each.length:g}",
        "contact height (m)": lambda each: f"{each.contact_height:+.3f}",
        "encumbrance (m)": lambda each: f"{each.encumbrance:.3f}",
        "gradient (‰)": lambda each: f"{_shown(each.gradient):.2f}",
        "change of gradient (‰)": lambda each: f"{_shown(each.change):.2f}",
    }
    at_rest = number_of | {
        "pre-sag (mm)": lambda each: f"{1e3 * each.pre_sag:.0f}",
        "droppers (N)": lambda each: f"{each.smallest_force:.0f} to {each.largest_force:.0f}",
        "elasticity (mm/N)": elasticities,
        "its non-uniformity (%)": lambda each: number(each.non_uniformity),
    }
    titles = "Spans, and heights at the support where each begins", "Spans at rest"
    pairs = zip(titles, (placed, at_rest), strict=True)
    return [Table.of(f"{title}{alike}", spans, columns, 0) for title, columns in pairs]


def elasticity_table(checks: Sequence[LineCheck]) -> Table:
    """Elasticity of lines whose spans are all alike, with published figures in brackets."""
    rows = []
    for each in checks:
        line, uneven = each.line, non_uniformity(each.elasticities)
        middle, end = (1e3 * elasticity for elasticity in each.in_span)
        told = [getattr(line.published, key, None) or 0 for key in ("mid_span", "support", "non_uniformity")]
        pairs = zip((middle, end, uneven), np.multiply(told, (1e3, 1e3, 1)), strict=True)
        cells = (f"{own:#.3g} ({other:g})" if other else f"{own:#.3g}" for own, other in pairs)
        stiffness = 1e3 * line.span_length / middle  # N
        rows.append((line.name, *cells, f"{stiffness / sum(wire.tension for wire in line.every_wire):.2f}"))
    headings = ("mid-span (mm/N)", "support (mm/N)", "non-uniformity (%)", "span / (mid-span × tensions)")
    return Table("Elasticity (in brackets: published, see `panto list LINE`)", ("line", *headings), rows)


def _shown(value: float) -> float:
    """A gradient (‰) without the rounding of heights and lengths."""
    return round(value, 6) + 0.0


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


@dataclass(frozen=True)
class DrawnLine:
    """A drawn line and a passive run at its highest speed; means over spans where nothing else is said."""

    seed: int
    draws: Annotated[int, "draws until a line is taken"]
    milliseconds: Annotated[float, "time to draw it (ms)"]
    length: Annotated[float, "length of the line (m)"]
    span_length: Annotated[float, "span (m)"]
    shortest_span: Annotated[float, "shortest span (m)"]
    longest_span: Annotated[float, "longest span (m)"]
    gradient: Annotated[float, "maximum gradient (‰)"]
    gradient_change: Annotated[float, "maximum change of gradient (‰)"]
    droppers: Annotated[float, "droppers of a span"]
    encumbrance: Annotated[float, "encumbrance (m)"]
    pre_sag: Annotated[float, "pre-sag (m)"]
    contact_tension: Annotated[float, "tension of the contact wire (kN)"]
    messenger_tension: Annotated[float, "tension of the messenger (kN)"]
    wave_speed_kmh: Annotated[float, "wave speed (km/h)"]
    speed_kmh: Annotated[float, "highest speed of trains (km/h)"]
    force_deviation: Annotated[float, "σ / F_m at that speed"]  # nan where the run ended early, as the next
    uplift: Annotated[float, "uplift at a support at that speed (m)"]
    elasticity: Annotated[float, "maximum elasticity (m/N)"]
    non_uniformity: Annotated[float, "non-uniformity of the elasticity (%)"]
    ending: str  # where and why the run ended early; empty if it did not

    def outside(self, lines: LineFamily | LineSection) -> list[str]:
        """Names of the values that lie outside the bands; all of a run that ended early."""
        bands = lines.plausible.model_dump(exclude={"pantograph"})
        return [name for name, (low, high) in bands.items() if not low <= getattr(self, name) <= high]


_HINTS = get_type_hints(DrawnLine, include_extras=True)
LABELS: dict[str, str] = {
    name: hint.__metadata__[0] for name, hint in _HINTS.items() if get_origin(hint) is Annotated
}
OF_SECTIONS = ("length", "shortest_span", "longest_span", "gradient", "gradient_change")
"""Values that say nothing of a line whose spans are all alike."""


def drawn_line(lines: LineFamily | LineSection, seed: int) -> DrawnLine:
    """The line of a seed, the one that an environment with this seed has, and a run on it."""
    begun = time.perf_counter()
    line, (_, speed_kmh) = line_of_seed(lines, seed)
    milliseconds = 1e3 * (time.perf_counter() - begun)
    assert isinstance(line, FlexibleCatenaryData)
    drawn = lines.drawn(line_generator(np.random.default_rng(seed)), (0.0, lines.fastest_kmh))
    draws = 1 + next(k for k, one in enumerate(drawn) if one is not None)
    run = simulate(line, lines.plausible.pantograph, speed_kmh, record_droppers=False)
    figures = None if run.terminated else run.summary()
    _, yields = elasticity(line, run.nominal_force)
    layout, alignment = line.layout(), line.alignment()
    slopes, changes = gradients(layout.contact_heights, alignment.supports)
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
        droppers=float(np.mean([len(span.droppers.positions) for span in layout.spans])),
        encumbrance=float(np.mean(layout.encumbrances)),
        pre_sag=max(max(span.droppers.sag) for span in layout.spans),
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


def drawn_lines(
    lines: LineFamily | LineSection, seeds: Sequence[int], progress: Progress | None = None
) -> list[DrawnLine]:
    """The lines of all seeds, on all cores; with progress as ``in_processes`` reports it."""
    return in_processes([partial(drawn_line, lines, seed) for seed in seeds], progress=progress)


def table(lines: LineFamily | LineSection, found: Sequence[DrawnLine]) -> Table:
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


def facts(lines: LineFamily | LineSection, found: Sequence[DrawnLine]) -> list[dict[str, Any]]:
    """All lines as plain data, with what lies outside the bands."""
    return [asdict(one) | {"outside": one.outside(lines)} for one in found]
