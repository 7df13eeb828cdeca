"""Costs of a control step on small processors: `python -m tests.onboard_cost agent-any-line guarded:pd`.

With `--markdown` it prints the table of docs/onboard.md.
"""

from __future__ import annotations

import argparse

from panto_agents.onboard import exported
from panto_agents.onboard.cost import CLOCK, PROCESSORS, cost
from panto_env.base.table import Table
from panto_env.terminal import print_table

HEADINGS = (
    "policy",
    "processor",
    "program, bytes",
    "state, bytes",
    "stack, bytes",
    "instructions, mean",
    "instructions, worst",
    f"share at {CLOCK / 1e6:g} MHz",
)


def row(policy: str, processor: str, steps: int) -> tuple[str, ...]:
    """A row of the table: a policy on a processor, over a number of steps."""
    found = cost(exported(policy), processor, steps)
    counts = (found.program, found.state, found.stack, round(found.mean), found.worst)
    return policy, processor, *(f"{each:,}" for each in counts), f"{100 * found.share:.1f} %"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policies", nargs="+", help="names or model files")
    parser.add_argument("--steps", type=int, default=30, help="with readings that are drawn; 30 by default")
    parser.add_argument("--markdown", action="store_true", help="for a document")
    given = parser.parse_args()
    rows = (row(policy, processor, given.steps) for policy in given.policies for processor in PROCESSORS)
    table = Table("a control step", HEADINGS, tuple(rows))
    if given.markdown:
        print(table.markdown)
    else:
        print_table(table)


if __name__ == "__main__":
    main()
