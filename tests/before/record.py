"""Run all cases with whatever version of the project is on PYTHONPATH, and write down what came out.

``python record.py OUT.json``; ``compare.py`` runs it with two versions. Cases use the public interface alone,
so that they run with both: ids of Gymnasium, ``panto_env.simulate``, names of the catalogue and of policies,
and the command ``panto``.
"""

from __future__ import annotations

import argparse
import fnmatch
import json
import os
import sys
import time
from collections.abc import Callable
from importlib.metadata import distribution, entry_points
from pathlib import Path
from typing import Any

import commands
import passes
import single
import vector
from tape import Tape

PACKAGES = ("panto_env", "panto_baselines", "panto_agents")
GROUPS = ("panto_env.policies", "panto_env.policy_loaders", "panto_env.commands")


def cases(quick: bool) -> dict[str, Callable[[Tape], None]]:
    """All cases by name, or all but the slow ones."""
    found = single.cases() | vector.cases() | passes.cases() | commands.cases()
    return found if quick else found | commands.slow_cases()


def check_origin(site: Path) -> None:
    """End the process unless all that was imported of the project, and all it offers, lies in ``site``."""
    found = [
        distribution("panto-env"),
        *(point.dist for group in GROUPS for point in entry_points(group=group)),
    ]
    places = [str(each.locate_file("")) for each in found if each]
    for name, module in sys.modules.items():
        if name.partition(".")[0] in PACKAGES and getattr(module, "__file__", None):
            places.append(str(module.__file__))
    wrong = [place for place in places if not Path(place).resolve().is_relative_to(site.resolve())]
    if wrong:
        sys.exit(f"{len(wrong)} parts are not from {site}, so that nothing is proved; first: {wrong[0]}")


def main() -> None:
    """Run the cases and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path, help="JSON file to write")
    parser.add_argument("--only", default="*", help="run the cases whose names this pattern matches")
    parser.add_argument("--quick", action="store_true", help="leave out the slow cases")
    parser.add_argument("--title", default="", help="what to call this version in the lines that it prints")
    given = parser.parse_args()
    output: Path = given.output.resolve()
    recorded: dict[str, Any] = {}
    chosen = {name: run for name, run in cases(given.quick).items() if fnmatch.fnmatch(name, given.only)}
    for number, (name, run) in enumerate(chosen.items(), start=1):
        start, tape, failure = time.perf_counter(), Tape(), None
        try:
            run(tape)
        except Exception as error:  # the other version may well run it
            failure = f"{type(error).__name__}: {error}"
        seconds = time.perf_counter() - start
        recorded[name] = tape.told() | {"seconds": seconds, "failure": failure}
        line = f"{given.title:>14} {number:4}/{len(chosen)} {seconds:6.1f} s  {name}"
        print(line if failure is None else f"{line}\n{failure}", file=sys.stderr, flush=True)
    check_origin(Path(os.environ["PYTHONPATH"]))
    output.write_text(json.dumps(recorded, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
