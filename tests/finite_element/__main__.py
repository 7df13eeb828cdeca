"""The flexible catenary beside finite elements: ``python -m tests.finite_element``."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.numerics import Numerics
from panto_env.studies.en50318.convergence import in_use

from . import simulation
from .figures import figures as figures_of

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


if __name__ == "__main__":
    main()
