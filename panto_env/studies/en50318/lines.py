"""Flexible lines, of the catalogue and drawn ones, at every speed: what grid, step, window and start do.

Figures stand beside converged ones, travelling windows beside a whole line, on which no wave from the far
anchor meets the train, and the default spans beside those of a long run.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
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
from ...metrics.figures import FIRST_SETTLED, LAST_USUAL
from ...metrics.low_pass import low_pass
from ...metrics.trajectory import Trajectory
from ...plant.alignment import Spans
from ...plant.catenary.flexible.grid import nodes_per_span, stable
from ...plant.catenary.flexible.resolution import resolution
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.numerics import RUNS, Numerics, Runs
from ...plant.pantograph.schema import PantographData
from .reference import REFERENCE_MODEL, WHOLE_LINE

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


WINDOWS = (5, 8, 12, 16, None)
"""Spans computed about the train; None: by default."""
WINDOW_SPEEDS_KMH = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
COMPARED = (FIRST_SETTLED, LAST_USUAL)
"""Spans on which windows are compared."""
START_SPEEDS_KMH = (100.0, 150.0, 200.0, 250.0, 300.0, 350.0)
FIRST_SPANS = (1, 4, 7, FIRST_SETTLED)
"""Where an evaluation might begin; each goes on to LAST_USUAL."""
SETTLED = (33, 62)
"""Spans of a long run that σ is compared with."""


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
    """Name, line and pantograph of each flexible line of the catalogue whose spans are alike.

    Lines with two contact wires are left out.
    """
    for name in available("catenary"):
        line = load_catenary(name)
        if isinstance(line, FlexibleCatenaryData) and not line.sequence and line.contact_wires == 1:
            yield name, line, _applied(OWN_PANTOGRAPH.get(name, REFERENCE_MODEL))


def drawn_cases(seed: int) -> Iterator[LineCase]:
    """The line and the pantograph of a seed at each speed."""
    line, pantograph = draw(seed)
    wave_speed = to_kmh(line.contact_wire.wave_speed)
    for speed in (*DRAWN_SPEEDS_KMH, *(share * wave_speed for share in DRAWN_SHARES)):
        yield LineCase(f"seed {seed}", line, pantograph, speed, drawn=True)


def every_case() -> Iterator[LineCase]:
    """All lines at all their speeds."""
    for name, line, pantograph in catalogue_lines():
        highest = HIGHEST * to_kmh(line.contact_wire.wave_speed)
        for speed in (*(speed for speed in SPEEDS_KMH if speed < highest), highest):
            yield LineCase(name, line, pantograph, speed)
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
    entries = {name: load_pantograph(name) for name in available("pantograph")}
    names = [
        name
        for name, entry in entries.items()
        if entry.contact_stiffness != "rigid" and not entry.hard_contact
    ]
    return line, _applied(names[random.integers(len(names))])


def _applied(name: str) -> PantographData:
    """With its force applied as it is: the same at every accuracy."""
    return load_pantograph(name).model_copy(update={"force": "applied"})


def check_case(case: LineCase) -> list[LineCheck]:
    """One line at one speed, at each accuracy; a drawn one by default only."""
    true = _run(case, converged(case))
    spans, speed = _spans(case.speed_kmh), from_kmh(case.speed_kmh)
    checks = []
    for numerics in ACCURACIES[:1] if case.drawn else ACCURACIES:
        given = numerics.model_copy(update={"window": WINDOW})
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            used = resolution(case.line, given, Runs((speed, speed)))
        ours, changes = _run(case, given), {}
        if not (ours.terminated or true.terminated):
            a, b = (run.summary(spans) for run in (ours, true))
            highest, lowest = _extremes(ours, spans)
            true_highest, true_lowest = _extremes(true, spans)
            changes = {
                "mean": b.mean,
                "converged": b.std,
                "std": 100 * (a.std / b.std - 1),
                "max": 100 * (highest - true_highest) / b.mean,
                "min": 100 * (lowest - true_lowest) / b.mean,
                "contact_loss": a.contact_loss - b.contact_loss,
            }
        check = LineCheck(
            case.name,
            case.pantograph.name,
            case.speed_kmh,
            case.share,
            case.drawn,
            numerics.accuracy,
            used.spacing,
            used.time_step,
            any(issubclass(each.category, AccuracyWarning) for each in caught),
            **changes,
        )
        checks.append(check)
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


def _extremes(run: Trajectory, spans: Spans) -> tuple[float, float]:
    """Maximum and minimum of the filtered force (N), also between samples at the limits of the spans.

    Where a limit cuts a peak, those of the samples differ by up to 2 % of the mean force between steps of 1
    and 0.1 ms, with the force between them the same.
    """
    force = low_pass(run.contact_force, run.time_step)
    at_limits = np.interp(run.alignment.limits(spans), run.position, force)
    inside = [*force[run.inside(spans)], *at_limits]
    return max(inside), min(inside)


@dataclass(frozen=True)
class WindowCheck:
    """A travelling window beside the whole line, changes relative to the whole line."""

    catenary: str
    speed_kmh: float
    asked: int | None  # None: by default
    window: int  # spans
    std: float  # of sigma (%)
    max: float  # of the maximum (% of the mean force)
    min: float  # of the minimum (% of the mean force)
    uplift: float  # of the largest uplift (%)
    rms: float  # difference of the low-passed contact force, rms (N)


def window_cases() -> Iterator[LineCase]:
    """Each flexible line of the catalogue at each of WINDOW_SPEEDS_KMH."""
    for speed in WINDOW_SPEEDS_KMH:
        for name, line, pantograph in catalogue_lines():
            if speed < HIGHEST * to_kmh(line.contact_wire.wave_speed):
                yield LineCase(name, line, pantograph, speed)


def check_windows(case: LineCase, windows: Sequence[int | None] = WINDOWS) -> list[WindowCheck]:
    """Windows on a line of the catalogue beside the whole line, over COMPARED."""

    def run(window: int | None) -> Trajectory:
        with warnings.catch_warnings(action="ignore"):  # of short windows: what they cost is the question
            return simulate(case.line, case.pantograph, case.speed_kmh, window=window, record_droppers=False)

    whole = run(WHOLE_LINE)
    true, inside = whole.summary(COMPARED), whole.inside(COMPARED)
    checks = []
    for window in windows:
        travelling = run(window)
        figures = travelling.summary(COMPARED)
        difference = low_pass(travelling.contact_force - whole.contact_force, whole.time_step)[inside]
        checks.append(
            WindowCheck(
                catenary=case.name,
                speed_kmh=case.speed_kmh,
                asked=window,
                window=travelling.identity.window or WHOLE_LINE,
                std=100 * (figures.std / true.std - 1),
                max=100 * (figures.max - true.max) / true.mean,
                min=100 * (figures.min - true.min) / true.mean,
                uplift=100 * (figures.max_uplift / true.max_uplift - 1),
                rms=float(np.sqrt(np.mean(difference**2))),
            )
        )
    return checks


@dataclass(frozen=True)
class StartCheck:
    """σ over spans ``first`` to ``last`` beside that of a long run, over all flexible lines at one speed."""

    speed_kmh: float
    lines: int
    first: int
    last: int
    rms: float  # error (%)
    worst: float  # error (%)


def check_start(speed_kmh: float, first_spans: Sequence[int] = FIRST_SPANS) -> list[StartCheck]:
    """One check for each first span: the reference pantograph on all flexible lines that bear this speed."""
    entries = [load_catenary(name) for name in available("catenary")]
    limit, errors_of_lines = from_kmh(speed_kmh) / HIGHEST, []
    for line in entries:
        if not isinstance(line, FlexibleCatenaryData) or line.ends or line.contact_wires > 1:
            continue  # one that ends does not go on for as long as is required
        if line.contact_wire.tension / line.contact_wire.mass <= limit**2:
            continue
        distance = line.alignment().support(SETTLED[1])
        run = simulate(line, REFERENCE_MODEL, speed_kmh, distance=distance, record_droppers=False)
        true = run.summary(SETTLED).std
        errors_of_lines.append([100 * (run.summary((k, LAST_USUAL)).std / true - 1) for k in first_spans])
    errors = np.array(errors_of_lines)
    return [
        StartCheck(
            speed_kmh=speed_kmh,
            lines=len(errors),
            first=first,
            last=LAST_USUAL,
            rms=float(np.sqrt(np.mean(errors[:, k] ** 2))),
            worst=float(np.abs(errors[:, k]).max()),
        )
        for k, first in enumerate(first_spans)
    ]
