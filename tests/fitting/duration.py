"""How long a fit of four passes over 2 km takes, and over the time of simulating them.

python -m tests.fitting.duration
"""

from __future__ import annotations

from time import perf_counter

from panto_env import simulate
from panto_env.base.machine import cores
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.fitting.fit import fit
from panto_env.records.measured import measured

LINE, PANTOGRAPH, SPEEDS = "en50318-2002", "dsa380", (180.0, 200.0, 220.0, 250.0)  # km/h


def main() -> None:
    """Simulate, fit, and print the times."""
    simulate(LINE, PANTOGRAPH, SPEEDS[0], distance=100.0)  # kernels are compiled
    begin = perf_counter()
    line = {"line_condition": "as-built", "seed": 7, "spans": 46, "distance": 2000.0}
    trains = [simulate(LINE, PANTOGRAPH, speed, **line) for speed in SPEEDS]
    simulated = perf_counter() - begin
    sensors = {"force_noise": 2.0, "position_error": 0.4, "seed": 5}
    records = [measured(train, name=f"{train.speed_kmh:g} km/h", **sensors) for train in trains]
    begin = perf_counter()

    def working(doing: str) -> None:
        print(f"{perf_counter() - begin:.0f} s: {doing}", flush=True)

    found = fit(records, load_catenary(LINE), load_pantograph(PANTOGRAPH), working=working)
    whole, freed = perf_counter() - begin, len(found.problem.values)
    print(f"{len(found.found)} values compared, {freed} freed, settled: {found.solution.converged}")
    print(
        f"{whole:.0f} s on {cores()} cores, {whole / simulated:.0f} times as long as to simulate the passes"
    )


if __name__ == "__main__":
    main()
