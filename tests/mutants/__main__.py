"""``python -m tests.mutants``: break the source on purpose, place by place, and see that a test fails.

A mutant that no test notices must say in its list why it changes no figure that is printed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from queue import Queue

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .mutant import Mutant, load_mutants
from .report import Verdict, print_report
from .workbench import ROOT, Workbench

console = Console(stderr=True)
WIDTH = 160
"""Columns of the table where it is not printed to a terminal."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 where each mutant is noticed, or argued to be harmless and not noticed."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument(
        "words", nargs="*", help="only mutants with one of these in list, path or description"
    )
    parser.add_argument("-j", "--jobs", type=int, default=2, help="mutants at a time")
    parser.add_argument("--own", action="store_true", help="only the tests that a mutant's list names")
    parser.add_argument("--list", action="store_true", help="show them, and whether their texts are found")
    options = parser.parse_args(arguments)
    mutants = [mutant for mutant in load_mutants() if _asked_for(mutant, options.words)]
    if not mutants:
        parser.error("no mutant is called so")
    lost = [mutant for mutant in mutants if mutant.occurrences(ROOT) != 1]
    for mutant in mutants if options.list else lost:
        count = mutant.occurrences(ROOT)
        note = "" if count == 1 else f" [red]its text occurs {count} times[/red]"
        console.print(f"{mutant.path}: {mutant.breaks}{note}")
    if lost or options.list:
        return int(bool(lost))
    verdicts = _judge(mutants, max(1, options.jobs), options.own)
    if not verdicts:
        return 1
    return print_report(verdicts, Console() if sys.stdout.isatty() else Console(width=WIDTH))


def _asked_for(mutant: Mutant, words: Sequence[str]) -> bool:
    name = f"{mutant.area} {mutant.path} {mutant.breaks}"
    return not words or any(word in name for word in words)


def _judge(mutants: Sequence[Mutant], jobs: int, own: bool) -> list[Verdict]:
    """Verdicts in the mutants' order; none where tests fail on the source as it is."""
    ways = {mutant.plain for mutant in mutants}
    tests = {plain: _tests(mutant for mutant in mutants if mutant.plain == plain) for plain in ways}
    with tempfile.TemporaryDirectory(prefix="panto-mutants-") as folder, ThreadPoolExecutor(jobs) as pool:
        benches = [Workbench(Path(folder) / str(number)) for number in range(jobs)]
        for plain, some in tests.items():
            with console.status(f"{len(some)} tests or files on the source as it is"):
                for outcome in pool.map(lambda bench, t=some, p=plain: bench.check(t, p), benches):
                    if outcome.failed:
                        console.print(
                            f"The source as it is fails {outcome.failed}:\n{outcome.output[-4000:]}"
                        )
                        return []
        free: Queue[Workbench] = Queue()
        for bench in benches:
            free.put(bench)
        columns = (TextColumn("mutants"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        with Progress(*columns, TextColumn("{task.description}"), console=console) as progress:
            task = progress.add_task("", total=len(mutants))

            def judge(mutant: Mutant) -> Verdict:
                with _taken(free) as bench:
                    verdict = _verdict(bench, mutant, [] if own else tests[mutant.plain])
                progress.update(task, advance=1, description=f"{mutant.breaks}: {verdict.word}")
                if not console.is_terminal:
                    console.print(
                        f"{verdict.word} in {verdict.seconds:.0f} s: {mutant.path}: {mutant.breaks}"
                    )
                return verdict

            return list(pool.map(judge, mutants))


def _tests(mutants: Iterable[Mutant]) -> list[str]:
    return list(dict.fromkeys(test for mutant in mutants for test in mutant.tests))


@contextmanager
def _taken(free: Queue[Workbench]) -> Iterator[Workbench]:
    bench = free.get()
    try:
        yield bench
    finally:
        free.put(bench)


def _verdict(bench: Workbench, mutant: Mutant, tests: Sequence[str]) -> Verdict:
    """Its own tests first; where none of them fails, the others that run as its own do."""
    outcome = bench.judge(mutant, mutant.tests)
    if outcome.failed:
        return Verdict(mutant, outcome.failed, True, outcome.seconds)
    others = [test for test in tests if test not in mutant.tests]
    seconds = outcome.seconds
    if others:
        outcome = bench.judge(mutant, others)
        seconds += outcome.seconds
    return Verdict(mutant, outcome.failed, False, seconds)


if __name__ == "__main__":
    sys.exit(main())
