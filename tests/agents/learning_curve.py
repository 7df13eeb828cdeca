"""σ against steps of trainings of one recipe: ``python -m tests.agents.learning_curve LOG [LOG ...]``.

Prints a table of the evaluations in TensorBoard logs (docs/tensorboard/*, or runs/*/tensorboard): the median
over the trainings, their range, and the median of the hours since the first round.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

RATIO, FIRST = "evaluation/std_ratio", "rollout/std_ratio"


def read(log):
    """Evaluations of one log: (steps, change of σ in %, hours since the first round)."""
    events = EventAccumulator(str(log)).Reload()
    began = events.Scalars(FIRST)[0].wall_time if FIRST in events.Tags()["scalars"] else None
    found = events.Scalars(RATIO)
    began = found[0].wall_time if began is None else began
    return [(each.step, 100 * (each.value - 1), (each.wall_time - began) / 3600) for each in found]


def table(logs):
    """Rows of the table: million steps, median and range of the change of σ (%), hours.

    Evaluations are paired by their order; raises ValueError where the trainings have more or fewer.
    """
    curves = [read(log) for log in logs]
    rows = []
    for evaluations in zip(*curves, strict=True):
        steps, changes, hours = (np.array(column) for column in zip(*evaluations, strict=True))
        rows.append(
            (np.median(steps) / 1e6, np.median(changes), changes.min(), changes.max(), np.median(hours))
        )
    return rows


def printed(rows):
    """The table in Markdown."""
    head = ["| million steps | Δσ (%) | from | to | hours |", "| ---: | ---: | ---: | ---: | ---: |"]
    return "\n".join(
        [*head, *("| {:.0f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} |".format(*row) for row in rows)]
    )


if __name__ == "__main__":
    sys.stdout.write(printed(table([Path(each) for each in sys.argv[1:]])) + "\n")
