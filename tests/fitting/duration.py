"""How long a fit of four passes over 2 km takes, by what it does, and over the time of simulating them.

python -m tests.fitting.duration
"""

from __future__ import annotations

from collections import defaultdict
from time import perf_counter

from panto_env import simulate
from panto_env.base.machine import cores
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.fitting.fit import fit
from panto_env.fitting.misfit import State
from panto_env.records.measured import measured

LINE, PANTOGRAPH, SPEEDS = "en50318-2002", "dsa380", (180.0, 200.0, 220.0, 250.0)  # km/h
DISTANCE, SPANS, SEED = 2000.0, 46, 7


def main() -> None:
    """Simulate, fit, and print the times."""
    simulate(LINE, PANTOGRAPH, SPEEDS[0], distance=100.0)  # kernels are compiled
    begin, trains = perf_counter(), []
    for speed in SPEEDS:
        train = simulate(
            LINE,
            PANTOGRAPH,
            speed,
            line_condition="as-built",
            seed=SEED,
            spans=SPANS,
            distance=DISTANCE,
        )
        trains.append(train)
    simulated = perf_counter() - begin
    records = [
        measured(train, force_noise=2.0, position_error=0.4, seed=5, name=f"{speed:g} km/h")
        for train, speed in zip(trains, SPEEDS, strict=True)
    ]
    spent: defaultdict[str, float] = defaultdict(float)
    doing, since = "preparing", perf_counter()

    def turn(to: str) -> None:
        nonlocal doing, since
        spent[doing] += perf_counter() - since
        doing, since = to.split(",")[0], perf_counter()

    def report(state: State, gain: float) -> None:
        turn("steps")
        print(f"step {state.steps}, {sum(spent.values()):.0f} s, expected gain {gain:.3g}", flush=True)

    found = fit(records, load_catenary(LINE), load_pantograph(PANTOGRAPH), report=report, working=turn)
    turn("end")
    whole, freed = sum(spent.values()), len(found.problem.fitting.values)
    ratio = whole / simulated
    print(f"{len(found.found)} values compared, {freed} freed, settled: {found.solution.settled}")
    print(f"{whole:.0f} s on {cores()} cores, {ratio:.0f} times as long as to simulate the passes")
    for name, seconds in spent.items():
        print(f"{name}: {seconds:.0f} s")


if __name__ == "__main__":
    main()
