"""Compare how fast two versions of the project are on this machine, in turns.

``python -m tests.before.speed --before COMMIT [--rounds 9]`` times a commit and the working tree, or another
commit (``--after``). Each round starts a fresh process of either version, which warms up; then they run short
chunks of the same work one after the other, so that another load on the machine slows both alike.
"""

from __future__ import annotations

import argparse
import fnmatch
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from .compare import Version, installed
from .stopwatch import ROWS, Row

CHUNKS = 12  # of each version in a round
# Set-up uses NumPy's linear algebra, whose threads wait by spinning: on a busy machine that is all noise.
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
CLOCK = 0  # column of the seconds by the clock; the other one is of the processor
Seconds = NDArray[np.float64]
"""(chunks, 2, 2): of the older and the newer version, by the clock and of the processor."""


def one_round(name: str, versions: tuple[Version, Version], later_first: bool) -> Seconds:
    """Seconds of each chunk of both versions, in fresh processes."""
    with ExitStack() as stack:
        clocks = []
        for version in versions:
            clock = stack.enter_context(
                subprocess.Popen(
                    version.command("stopwatch.py", name),
                    env=version.environment() | ONE_THREAD,
                    cwd=version.empty,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            clocks.append(clock)
        for clock in clocks:
            _hear(clock)
        seconds = np.zeros((CHUNKS, 2, 2))
        for k in range(CHUNKS):
            first = (k + later_first) % 2
            for which in (first, 1 - first):
                clock = clocks[which]
                assert clock.stdin is not None
                clock.stdin.write("\n")
                clock.stdin.flush()
                seconds[k, which] = [float(each) for each in _hear(clock).split()]
        for clock in clocks:
            assert clock.stdin is not None
            clock.stdin.close()
    return seconds


def _hear(clock: subprocess.Popen[str]) -> str:
    assert clock.stdout is not None
    line = clock.stdout.readline()
    if not line:
        sys.exit(f"A process ended with {clock.wait()} before it was done.")
    return line


def _ratios(seconds: Seconds) -> NDArray[np.float64]:
    """How much faster the newer version is in a round, by the clock and of the processor.

    Two chunks that follow one another meet the machine in the same state, which may change a second later:
    so the median is of their ratios.
    """
    ratios: NDArray[np.float64] = np.median(seconds[:, 0] / seconds[:, 1], axis=0)
    return ratios


def _cells(row: Row, rounds: list[Seconds]) -> list[str]:
    speeds = row.amount / np.median(np.concatenate(rounds)[:, :, CLOCK], axis=0)
    ratio, ratio_of_processor = np.array([_ratios(seconds) for seconds in rounds]).T
    shown = (np.median(ratio), ratio.min(), ratio.max(), np.median(ratio_of_processor))
    told = [f"{speed:,.0f}" if speed >= 100 else f"{speed:.3g}" for speed in speeds]
    return [*told, row.unit, *(f"{each:.3f}" for each in shown)]


def main() -> None:
    """Measure row by row, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", required=True, help="commit of the older version")
    parser.add_argument("--after", help="commit of the newer version; the working tree unless given")
    parser.add_argument("--rounds", type=int, default=9, help="of fresh processes for every row")
    parser.add_argument("--only", default="*", help="measure the rows whose names this pattern matches")
    parser.add_argument("--keep", type=Path, help="folder to keep installations and kernels in")
    given = parser.parse_args()
    chosen = {name: row for name, row in ROWS.items() if fnmatch.fnmatch(name, given.only)}
    rounds: dict[str, list[Seconds]] = {name: [] for name in chosen}
    with installed(given.before, given.after, given.keep) as versions:
        # Round by round over all rows: a busy minute then spoils one round, not one row.
        for k in range(given.rounds):
            for name in chosen:
                rounds[name].append(one_round(name, versions, later_first=k % 2 == 1))
                ratio = _ratios(rounds[name][-1])[CLOCK]
                print(f"round {k + 1}: {ratio:.3f}  {name}", file=sys.stderr, flush=True)
    table = Table(
        title=f"Speed of {versions[1].title} over that of {versions[0].title}, {given.rounds} rounds"
    )
    table.add_column("")
    for heading in ("before", "after", "unit", "ratio, median", "lowest", "highest", "ratio, CPU"):
        table.add_column(heading, justify="left" if heading == "unit" else "right")
    for name, row in chosen.items():
        table.add_row(name, *_cells(row, rounds[name]))
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(table)
    console.print("Ratios above 1: the newer version is faster. By the clock, but the last: CPU time.")


if __name__ == "__main__":
    main()
