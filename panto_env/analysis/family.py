"""The lines that a family draws under many seeds: whether each hangs, runs and is plausible."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from ..base.table import Alarm, Table
from ..base.units import to_kmh
from ..catalog.family import LineFamily
from ..control.lines import line_generator, on_drawn_line
from ..control.settings import run_settings
from ..plant.catenary.flexible import FlexibleCatenaryData
from ..plant.catenary.flexible.elasticity import elasticity, non_uniformity
from .pool import Progress, in_processes
from .simulation import simulate


@dataclass(frozen=True)
class DrawnLine:
    """A line drawn from a family, and a passive run on it at the highest speed of its trains."""

    seed: int
    draws: int  # until the line was taken
    milliseconds: float  # to draw it
    span_length: float  # m
    droppers: int  # of a span
    encumbrance: float  # m
    pre_sag: float  # m
    contact_tension: float  # kN
    messenger_tension: float  # kN
    wave_speed_kmh: float
    speed_kmh: float  # of the run
    force_deviation: float  # sigma over mean force (-); nan where the run ended early, as the next
    uplift: float  # m
    elasticity: float  # maximum (m/N)
    non_uniformity: float  # of the elasticity (%)
    ending: str  # where and why the run ended early; empty if it did not

    def outside(self, family: LineFamily) -> list[str]:
        """Names of the values that lie outside the family's bands; all of a run that ended early."""
        bands = family.plausible.model_dump(exclude={"pantograph"})
        return [name for name, (low, high) in bands.items() if not low <= getattr(self, name) <= high]


LABELS = {
    "draws": "draws until a line is taken",
    "milliseconds": "time to draw it (ms)",
    "span_length": "span (m)",
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


def drawn_line(family: LineFamily, seed: int) -> DrawnLine:
    """The line of a seed, the one that an environment with this seed has, and a run on it."""
    settings = run_settings({"catenary": family, "speed_kmh": (0.0, family.max_speed_kmh)})
    begun = time.perf_counter()
    drawn = on_drawn_line(settings, lambda: np.random.default_rng(seed))
    milliseconds = 1e3 * (time.perf_counter() - begun)
    line, (_, speed_kmh) = drawn.line, drawn.speed_kmh
    assert isinstance(line, FlexibleCatenaryData)
    own = line_generator(np.random.default_rng(seed))
    draws = 1 + next(k for k, one in enumerate(family.drawn(own, settings.speed_kmh)) if one is not None)
    run = simulate(line, family.plausible.pantograph, speed_kmh, record_droppers=False)
    figures = None if run.terminated else run.summary()
    _, yields = elasticity(line, run.nominal_force)
    return DrawnLine(
        seed=seed,
        draws=draws,
        milliseconds=milliseconds,
        span_length=line.span_length,
        droppers=len(line.droppers.positions),
        encumbrance=line.encumbrance,
        pre_sag=max(line.droppers.sag),
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
    family: LineFamily, seeds: Sequence[int], progress: Progress | None = None
) -> list[DrawnLine]:
    """The lines of all seeds, on all cores; with progress as ``in_processes`` reports it."""
    return in_processes([partial(drawn_line, family, seed) for seed in seeds], progress=progress)


def table(family: LineFamily, lines: Sequence[DrawnLine]) -> Table:
    """Minimum, median and maximum of each value, the family's band, and how many lines lie outside it."""
    outside = [one.outside(family) for one in lines]
    rows = []
    for name, label in LABELS.items():
        values = np.array([getattr(one, name) for one in lines], dtype=float)
        band, beyond = getattr(family.plausible, name, None), sum(name in each for each in outside)
        rows.append(
            (
                label,
                *(float(np.nanquantile(values, share)) for share in (0.0, 0.5, 1.0)),
                "" if band is None else f"{band[0]:g} to {band[1]:g}",
                "" if band is None else Alarm(beyond) if beyond else "0",
            )
        )
    title = f"{len(lines)} lines of family {family.name}"
    return Table(title, ("value", "minimum", "median", "maximum", "plausible", "lines outside"), rows)


def facts(family: LineFamily, lines: Sequence[DrawnLine]) -> list[dict[str, Any]]:
    """All lines as plain data, with what lies outside the family's bands."""
    return [asdict(one) | {"outside": one.outside(family)} for one in lines]
