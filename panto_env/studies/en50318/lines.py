"""Figures of flexible lines, those of the catalogue and drawn ones, at every speed beside converged ones."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import ceil
from pathlib import Path

import numpy as np

from ...analysis.simulation import simulate
from ...base.arrays import from_kmh, to_kmh
from ...base.errors import AccuracyWarning
from ...catalog import load_catenary, load_pantograph
from ...catalog.loader import available, load_family
from ...metrics.low_pass import low_pass
from ...metrics.trajectory import Trajectory
from ...plant.alignment import Spans
from ...plant.catenary.flexible.grid import nodes_per_span, stable
from ...plant.catenary.flexible.resolution import resolution
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.numerics import RUNS, Numerics, Runs
from ...plant.pantograph.schema import PantographData
from .reference import REFERENCE_MODEL

SPEEDS_KMH = (30.0, 100.0, 200.0, 250.0, 300.0, 350.0, 400.0)
HIGHEST = 0.95
"""Share of the wave speed up to which a line is run."""
SEEDS = range(1, 21)
"""Of the drawn lines."""
DRAWN_SPEEDS_KMH = (30.0, 100.0)
DRAWN_SHARES = (0.5, 0.62, 0.7, 0.78, 0.86, HIGHEST)
"""Speeds on drawn lines, as shares of the wave speed."""
FAMILIES = (Path(__file__).parent / "ordinary.toml", "high-speed")
"""Families of the drawn lines, of even and of odd seeds."""
LIMP, LIMP_BOTH = 4, 8
"""Each so many-th drawn line has a contact wire without bending stiffness, or two such wires."""
GRID, SLOW_GRID, SLOW_SHARE = 0.05, 0.1, 0.4
"""Spacing (m) of the figures that are taken as converged, and up to a share of the wave speed, where a finer
grid takes minutes and changes nothing."""
LONGEST_STEP = 1.25e-4
"""Their maximum time step (s)."""
ACCURACIES = (Numerics(), Numerics(accuracy="fast"))
OWN_PANTOGRAPH = {"benchmark-2015": "benchmark-2015"}
"""Pantographs that lines come with; all others are run with that of EN 50318."""
SPANS = (4, 9)
SLOW_KMH, SLOW_SPANS = 50.0, (2, 4)
"""Speed (km/h) below which fewer spans are evaluated, since they take long, and these spans."""
WINDOW = 12
"""Spans about the train, of all runs: the window's error is not looked at here."""


@dataclass(frozen=True)
class LineCase:
    """A pantograph on a line at a speed."""

    name: str
    line: FlexibleCatenaryData
    pantograph: PantographData
    speed_kmh: float
    drawn: bool = False

    @property
    def share(self) -> float:
        """The speed as a share of the wave speed."""
        return from_kmh(self.speed_kmh) / self.line.contact_wire.wave_speed


@dataclass(frozen=True)
class LineCheck:
    """Figures of one line at one speed beside converged ones; None where a run ended early."""

    catenary: str
    pantograph: str
    speed_kmh: float
    share: float  # of the wave speed
    drawn: bool
    accuracy: str
    spacing: float  # grid (m)
    time_step: float  # s
    warned: bool  # whether a warning says that figures may be wrong
    mean: float | None = None  # force, converged (N)
    converged: float | None = None  # standard deviation (N)
    std: float | None = None  # change (%)
    max: float | None = None  # change (% of the mean force)
    min: float | None = None  # change (% of the mean force)
    contact_loss: float | None = None  # change (percentage points)


def catalogue_lines() -> Iterator[tuple[str, FlexibleCatenaryData, PantographData]]:
    """Name, line and pantograph of each flexible line of the catalogue whose spans are alike."""
    for name in available("catenary"):
        line = load_catenary(name)
        if isinstance(line, FlexibleCatenaryData) and not line.sequence:
            yield name, line, _applied(OWN_PANTOGRAPH.get(name, REFERENCE_MODEL))


def catalogue_cases() -> Iterator[LineCase]:
    """Each flexible line of the catalogue at each speed."""
    for name, line, pantograph in catalogue_lines():
        highest = HIGHEST * to_kmh(line.contact_wire.wave_speed)
        for speed in (*(speed for speed in SPEEDS_KMH if speed < highest), highest):
            yield LineCase(name, line, pantograph, speed)


def drawn_cases(seed: int) -> Iterator[LineCase]:
    """The line and the pantograph of a seed at each speed."""
    line, pantograph = draw(seed)
    wave_speed = to_kmh(line.contact_wire.wave_speed)
    for speed in (*DRAWN_SPEEDS_KMH, *(share * wave_speed for share in DRAWN_SHARES)):
        yield LineCase(f"seed {seed}", line, pantograph, speed, drawn=True)


def every_case() -> Iterator[LineCase]:
    """All lines at all their speeds."""
    yield from catalogue_cases()
    for seed in SEEDS:
        yield from drawn_cases(seed)


@cache
def draw(seed: int) -> tuple[FlexibleCatenaryData, PantographData]:
    """A line and a pantograph of the catalogue."""
    random = np.random.default_rng(seed)
    line, _ = load_family(FAMILIES[seed % len(FAMILIES)]).draw(random)
    limp = {"bending_stiffness": 0.0}
    if seed % LIMP == 0:
        line = line.model_copy(update={"contact_wire": line.contact_wire.model_copy(update=limp)})
    if seed % LIMP_BOTH == 0:
        line = line.model_copy(update={"messenger_wire": line.messenger_wire.model_copy(update=limp)})
    names = [name for name in available("pantograph") if _springy(load_pantograph(name))]
    return line, _applied(names[random.integers(len(names))])


def _springy(pantograph: PantographData) -> bool:
    return pantograph.contact_stiffness != "rigid" and not pantograph.hard_contact


def _applied(name: str) -> PantographData:
    """With its force applied as it is: the same at every accuracy."""
    return load_pantograph(name).model_copy(update={"force": "applied"})


def check_case(case: LineCase) -> list[LineCheck]:
    """One line at one speed, at each accuracy; a drawn one by default only."""
    true = _run(case, converged(case))
    checks = []
    for numerics in ACCURACIES[:1] if case.drawn else ACCURACIES:
        given = numerics.model_copy(update={"window": WINDOW})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            speed = from_kmh(case.speed_kmh)
            used = resolution(case.line, given, Runs((speed, speed)))
        ours = _run(case, given)
        check = LineCheck(
            catenary=case.name,
            pantograph=case.pantograph.name,
            speed_kmh=case.speed_kmh,
            share=case.share,
            drawn=case.drawn,
            accuracy=numerics.accuracy,
            spacing=used.spacing,
            time_step=used.time_step,
            warned=any(issubclass(each.category, AccuracyWarning) for each in caught),
        )
        checks.append(check if ours.terminated or true.terminated else _compared(check, ours, true))
    return checks


def converged(case: LineCase) -> Numerics:
    """The grid that is taken as converged, in double precision, with a step that is stable on it."""
    line, interval = case.line, RUNS.control_interval
    grid = GRID if case.share > SLOW_SHARE else SLOW_GRID
    spacing = line.stride / nodes_per_span(line, grid)
    steps = ceil(interval / LONGEST_STEP - 1e-9)
    while not stable(line, spacing, interval / steps):
        steps += 1
    return Numerics(spacing=grid, time_step=interval / steps, window=WINDOW, precision="double")


def _spans(speed_kmh: float) -> tuple[int, int]:
    return SLOW_SPANS if speed_kmh < SLOW_KMH else SPANS


def _run(case: LineCase, numerics: Numerics) -> Trajectory:
    distance = case.line.alignment().support(_spans(case.speed_kmh)[1] + 1)
    with warnings.catch_warnings(action="ignore"):
        return simulate(
            case.line,
            case.pantograph,
            case.speed_kmh,
            distance=distance,
            record_droppers=False,
            **numerics.model_dump(),
        )


def _compared(check: LineCheck, ours: Trajectory, true: Trajectory) -> LineCheck:
    spans = _spans(check.speed_kmh)
    a, b = (run.summary(spans) for run in (ours, true))
    highest, lowest = _extremes(ours, spans)
    true_highest, true_lowest = _extremes(true, spans)
    return LineCheck(
        **vars(check)
        | {
            "mean": b.mean,
            "converged": b.std,
            "std": 100 * (a.std / b.std - 1),
            "max": 100 * (highest - true_highest) / b.mean,
            "min": 100 * (lowest - true_lowest) / b.mean,
            "contact_loss": a.contact_loss - b.contact_loss,
        }
    )


def _extremes(run: Trajectory, spans: Spans) -> tuple[float, float]:
    """Maximum and minimum of the filtered force (N), also between samples at the limits of the spans.

    Where a limit cuts a peak, those of the samples differ by up to 2 % of the mean force between steps of 1
    and 0.1 ms, with the force between them the same.
    """
    force = low_pass(run.contact_force, run.time_step)
    at_limits = np.interp(run.alignment.limits(spans), run.position, force)
    inside = [*force[run.inside(spans)], *at_limits]
    return max(inside), min(inside)
