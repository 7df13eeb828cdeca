"""A line of your own, written as TOML: simulated, checked against the standards, and at several speeds.

    python examples/line_from_toml.py --plot line.png

printed that it keeps EN 50367 and EN 50119 at 250 km/h (sigma 32.0 N, twice the uplift 144 mm), and

    200 km/h: mean 108.8 N, sigma 18.9 N
    220 km/h: mean 116.9 N, sigma 25.4 N
    240 km/h: mean 125.8 N, sigma 32.7 N
    260 km/h: mean 135.5 N, sigma 35.6 N
    280 km/h: mean 146.0 N, sigma 38.8 N
"""

from __future__ import annotations

import argparse
from pathlib import Path

from panto_env import Trajectory, simulate
from panto_env.analysis.plots import save
from panto_env.analysis.sweep import Row, sweep
from panto_env.analysis.sweep_plots import plot_sweep

LINE = Path(__file__).with_name("my_line.toml")
PANTOGRAPH, SPEED_KMH = "dsa380", 250.0
SPEEDS_KMH = (200.0, 220.0, 240.0, 260.0, 280.0)


def one_pass() -> Trajectory:
    """Record of one pass at the mean force that EN 50367 gives for the speed."""
    return simulate(LINE, PANTOGRAPH, SPEED_KMH, mean_force="en50367")


def over_speed() -> list[Row]:
    """One row of figures per speed, each at its own mean force."""
    return sweep({"speed_kmh": SPEEDS_KMH}, catenary=LINE, pantograph=PANTOGRAPH, mean_force="en50367")


def main() -> None:
    """Print the requirements at one speed and sigma at several; draw the latter."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", help="picture to write, as .png, .svg or .pdf")
    plot = parser.parse_args().plot
    for criterion in one_pass().compliance():
        if criterion.kept is not None:
            verdict = "kept" if criterion.kept else "broken"
            print(f"{criterion.heading}: {criterion.value:.3g}, {verdict}")
    rows = over_speed()
    for row in rows:
        print(f"{row['speed_kmh']:g} km/h: mean {row['mean']:.1f} N, sigma {row['std']:.1f} N")
    if plot is not None:
        save(plot_sweep(rows, ["speed_kmh"]), plot)


if __name__ == "__main__":
    main()
