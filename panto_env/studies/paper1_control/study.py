"""Paper 1's active control: its claims tested on a stand-in for its line."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..study import Outcome, Report
from .cases import SHOWN_SPEEDS, Case, all_cases, control
from .comparisons import comparisons
from .passes import Result, passive_at_mean, run_all
from .plots import all_plots
from .tables import all_tables


def run(report: Report) -> Outcome:
    """Run all passes, and put ours beside the paper's. Raises InputError where a worker dies."""
    results = run_all(all_cases(), lambda done, total: report("passes along the line", 0.9 * (done / total)))
    report("passive passes at the same mean force", 0.9)
    at_same_mean = {
        speed: passive_at_mean(speed, results[Case(speed, control())].figures.mean) for speed in SHOWN_SPEEDS
    }
    report("plots", 0.95)
    return Outcome(
        title="Paper 1, active control (section 5, Figs 13 to 18)",
        comparisons=comparisons(results),
        tables=all_tables(results, at_same_mean),
        plots=all_plots(results),
        numbers={
            "passes": [_plain(result) for result in results.values()],
            "pressed to the controlled mean": [_plain(result) for result in at_same_mean.values()],
        },
    )


def _plain(result: Result) -> dict[str, Any]:
    """One pass for the JSON."""
    return {
        **dataclasses.asdict(result.case),
        **result.figures.as_dict(),
        "raw_std": result.raw_std,
        "longest_loss": result.longest_loss,
        "once_per_span": abs(result.once_per_span),
        "bands": result.bands,
    }
