"""Section 4.1 of paper 2 as a part of its study: Figs 11 and 12, and every other way to find the force."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial

from ...estimation.motion import measure
from ..study import Outcome, Report
from .estimation import (
    LAG,
    OBSERVATIONS,
    SPEED_KMH,
    cases,
    filtered,
    known_pantograph,
    over_noise,
    parameter_information,
    run,
)
from .estimation_plots import delay_plot, figure_11_12
from .estimation_tables import comparisons, noise_table, over_speed_tables, parameters_table, ways_table


def outcome(report: Report) -> Outcome:
    """Every way at every speed, over noise, which parameters a pass determines, and the figures."""
    report("estimator: a pass over the line", 0.0)
    trajectory = run(SPEED_KMH)
    every = cases(progress=lambda done, all_: report("estimator: every way", 0.05 + 0.75 * done / all_))
    report("estimator: noise", 0.8)
    scores = over_noise(trajectory)
    report("estimator: parameters", 0.9)
    parameters = parameter_information(trajectory)
    motion, known = measure(trajectory), known_pantograph(0)
    by_filter = {kind: filtered("random-walk", 0.0, motion, known, kind) for kind in OBSERVATIONS}
    smoothed = filtered("random-walk", LAG, motion, known, OBSERVATIONS[1])
    late = {f"filter, {kind}": force for kind, force in by_filter.items()}
    late[f"smoother of {1e3 * LAG:g} ms, {OBSERVATIONS[1]}"] = smoothed
    draw = partial(figure_11_12, motion)
    return Outcome(
        title="Paper 2, section 4.1: the contact force from the pantograph's motion",
        comparisons=comparisons(every),
        tables=(
            ways_table(every),
            *over_speed_tables(every),
            noise_table(scores),
            parameters_table(parameters),
        ),
        plots={
            "fig11-displacements-and-velocities": draw(by_filter[OBSERVATIONS[0]], OBSERVATIONS[0]),
            "fig12-displacements": draw(by_filter[OBSERVATIONS[1]], OBSERVATIONS[1]),
            "estimator-delay": delay_plot(motion, late),
        },
        numbers={"estimator": [asdict(case) for case in every]},
    )
