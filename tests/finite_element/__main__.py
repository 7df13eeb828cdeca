"""Both codes side by side: ``python -m tests.finite_element [--sections | --trains | --twin]``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.table import Table

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.numerics import Numerics
from panto_env.studies.en50318.reference import in_use

from . import simulation, twin
from .differences import at_rest
from .figures import Run, draw
from .figures import figures as figures_of
from .sections import Section, sections
from .trains import cases
from .windy import ALIKE, STRONG, WIND, by_both, compared

NAME = "en50318-2002"
OURS = (Numerics(), Numerics(spacing=0.125, time_step=2.5e-4, window=0, precision="double"))
FINITE_ELEMENTS = ((1.0, 1e-3), (0.5, 5e-4), (0.25, 2.5e-4))  # element (m), time step (s)


def main() -> None:
    """Print the figures of spans 5 and 6 at 250 and 300 km/h, by default and converged."""
    line, pantograph = load_catenary(NAME), load_pantograph(NAME)
    table = Table("km/h", "model", "grid (m)", "step (ms)", "F_m (N)", "σ (N)", "max (N)", "min (N)")
    for speed in (250.0, 300.0):
        for numerics in (in_use(each, speed) for each in OURS):
            figures = simulate(NAME, NAME, speed, distance=361.0, **numerics.model_dump()).summary((5, 6))
            values = (figures.mean, figures.std, figures.max, figures.min)
            row = (f"{value:.2f}" for value in values)
            table.add_row(
                f"{speed:g}",
                "finite differences",
                f"{numerics.spacing:.3g}",
                f"{1e3 * numerics.time_step:.3g}",
                *row,
            )
        for element, step in FINITE_ELEMENTS:
            result = simulation.simulate(
                line, pantograph, speed, element=element, time_step=step, distance=6.1 * line.span_length
            )
            theirs = figures_of(result)
            values = (theirs.mean, theirs.std, theirs.maximum, theirs.minimum)
            row = (f"{value:.2f}" for value in values)
            table.add_row(f"{speed:g}", "finite elements", f"{element:g}", f"{1e3 * step:g}", *row)
        table.add_section()
    Console().print(table)


def compare_at_rest(only: str) -> None:
    """Print the largest differences of both codes at rest, of sections that have a text in their name."""
    table = Table("section", "contact wire (mm)", "messenger (mm)", "droppers' forces (N)", "lengths (mm)")
    for name, section in sections().items():
        if only not in name:
            continue
        found = at_rest(section.line)
        values = (1e3 * found.contact, 1e3 * found.messenger, found.force, 1e3 * found.length)
        table.add_row(name, *(f"{value:.4f}" for value in values))
    if table.rows:
        Console().print(table)


def compare_sections(only: str, folder: Path) -> None:
    """Print the figures of passes by both codes, of those that have a text in their name, and draw them."""
    table = Table("section", "model", "F_m (N)", "σ (N)", "max (N)", "min (N)", "uplift per support (mm)")
    for name, (make, spans) in passes().items():
        if only not in name:
            continue
        runs = make()
        for model, run in runs.items():
            found = figures_of(run, spans)
            values = (found.mean, found.std, found.maximum, found.minimum)
            uplifts = " ".join(f"{each:.1f}" for each in found.uplifts_mm)
            table.add_row(name, model, *(f"{value:.2f}" for value in values), uplifts)
        table.add_section()
        draw({model: [run] for model, run in runs.items()}, spans, folder / f"{name}.png")
    Console().print(table)


def compare_trains(folder: Path, element: float | None = None) -> None:
    """Print the figures of each collector by both codes, and draw their forces in a folder.

    element: of the judge (m), each train's own by default.
    """
    names = "train", "collector", "model", "F_m (N)", "σ (N)", "max (N)", "min (N)", "CL (%)"
    table = Table(*names, "uplift per support (mm)")
    for name, case in cases().items():
        runs = {
            "finite differences": case.by_simulator(),
            "finite elements": case.by_finite_elements(element),
        }
        for number, own in enumerate(case.collectors):
            for model, run in runs.items():
                found = figures_of(run[number], case.spans)
                values = (found.mean, found.std, found.maximum, found.minimum, found.loss_percent)
                uplifts = "" if number else " ".join(f"{each:.1f}" for each in found.uplifts_mm)
                whose = f"{number + 1}: {own.pantograph.name}"
                table.add_row(name, whose, model, *(f"{value:.2f}" for value in values), uplifts)
        table.add_section()
        draw(runs, case.spans, folder / f"{name}.png")
    Console().print(table)


def compare_twins() -> None:
    """Print the figures of two contact wires with alternating droppers, and of one equivalent wire."""
    table = Table("km/h", "droppers (m)", "model", "F_m (N)", "σ (N)", "max (N)", "min (N)", "uplift (mm)")
    for name in ("σ of a wire (N)", "share of a wire (%)", "one wire alone (% of the way)"):
        table.add_column(name)
    for speed, spacing in twin.CASES:
        one = twin.section(speed, spacing)
        both = replace(one, line=twin.mirrored(twin.two_wires(one.line)))
        twins = twin.along_twins(one, twin.ALTERNATING)
        by_wire = twin.shared(twins, one.spans)
        own = (f"{by_wire.std:.2f}", f"{by_wire.first:.1f}", f"{by_wire.alone:.1f}")
        rows = {
            "finite differences, one wire": (one.by_simulator(), ()),
            "finite elements, one wire": (one.by_finite_elements(), ()),
            "finite differences, two wires": (both.by_simulator(), ()),
            "finite elements, two wires": (twins, own),
        }
        for model, (run, more) in rows.items():
            found = figures_of(run, one.spans)
            values = (found.mean, found.std, found.maximum, found.minimum)
            forces = (f"{value:.2f}" for value in values)
            table.add_row(f"{speed:g}", f"{spacing:g}", model, *forces, f"{found.uplift_mm:.1f}", *more)
        table.add_section()
    Console().print(table)


def passes() -> dict[str, tuple[Callable[[], dict[str, Run]], tuple[int, int]]]:
    """By name, what makes the runs of both codes, and the spans whose figures are compared."""

    def along(section: Section) -> dict[str, Run]:
        return {"finite differences": section.by_simulator(), "finite elements": section.by_finite_elements()}

    return {name: (partial(along, section), section.spans) for name, section in sections().items()} | {
        "gusts": (partial(by_both, ALIKE, STRONG, side_wind=WIND), compared(ALIKE))
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.finite_element", description=__doc__)
    parser.add_argument(
        "--sections", action="store_true", help="sections of unlike spans, and wind, with pictures"
    )
    parser.add_argument("--only", default="", help="of these, those that have this text in their name")
    parser.add_argument("--trains", action="store_true", help="several collectors, with pictures")
    parser.add_argument("--element", type=float, help="of trains (m), instead of each one's own")
    parser.add_argument("--twin", action="store_true", help="two contact wires beside one equivalent wire")
    parser.add_argument("--output", type=Path, default=Path("runs/finite-element"), help="for the pictures")
    given = parser.parse_args()
    if given.sections:
        compare_at_rest(given.only)
        compare_sections(given.only, given.output)
    elif given.trains:
        compare_trains(given.output, given.element)
    elif given.twin:
        compare_twins()
    else:
        main()
