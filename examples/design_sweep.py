r"""A sweep over two parameters of a design: the collector head's mass and the contact wire's tension.

    python examples/design_sweep.py --plot design.png

printed twelve designs, and at last "minimum sigma: 23.0 N, head 4 kg, tension 24 kN". The same as a command:

    panto sweep pantograph.masses.1=4:10:4 catenary.contact_wire.tension=16e3:24e3:3 \
      --speed 275 --mean-force 130 --plot design.png
"""

from __future__ import annotations

import argparse

from panto_env.analysis.plots import save
from panto_env.analysis.sweep import Row, sweep
from panto_env.analysis.sweep_plots import plot_sweep

HEAD, TENSION = "pantograph.masses.1", "catenary.contact_wire.tension"
MASSES, TENSIONS = (4.0, 6.0, 8.0, 10.0), (16e3, 20e3, 24e3)  # kg, N
SPEED_KMH = 275.0


def designs() -> list[Row]:
    """One row of figures per pair of values."""
    return sweep(
        {HEAD: MASSES, TENSION: TENSIONS},
        catenary="en50318-2002",
        pantograph="en50318-2002",
        speed_kmh=SPEED_KMH,
        mean_force=130.0,  # N, the same in all designs: one with a smaller mean would look better
    )


def main() -> None:
    """Print sigma of every design and the best one; draw them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", help="picture to write, as .png, .svg or .pdf")
    plot = parser.parse_args().plot
    rows = designs()
    for row in rows:
        print(f"head {row[HEAD]:g} kg, tension {row[TENSION] / 1e3:g} kN: sigma {row['std']:.1f} N")
    best = min(rows, key=lambda row: row["std"])
    print(f"minimum sigma: {best['std']:.1f} N, head {best[HEAD]:g} kg, tension {best[TENSION] / 1e3:g} kN")
    if plot is not None:
        save(plot_sweep(rows, [HEAD, TENSION]), plot)


if __name__ == "__main__":
    main()
