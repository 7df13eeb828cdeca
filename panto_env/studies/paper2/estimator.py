"""The estimator's figures: the paper's Figs 11 and 12, and delay over frequency."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...base.arrays import Array
from ...base.plotting import ORANGE, legend_above, series_colour
from ...estimation.estimate import COHERENT, phases
from ...estimation.motion import Motion, measure
from ..study import Outcome, Report
from .estimation import (
    LAG,
    MISMATCH,
    OBSERVATIONS,
    SPEED_KMH,
    START,
    cases,
    comparisons,
    filtered,
    known_pantograph,
    noise_table,
    over_noise,
    over_speed_tables,
    parameter_information,
    parameters_table,
    run,
    ways_table,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SHOWN = 4.0
"""Seconds drawn: about five spans at 250 km/h. Own choice."""
HIGHEST = 20.0
"""Of the frequencies shown (Hz)."""


def figure_11_12(motion: Motion, force: Array, observation: str) -> Figure:
    """True and estimated contact force (N), (n,): Fig. 11 with velocities, Fig. 12 without."""
    from matplotlib.figure import Figure

    assert motion.contact_force is not None
    number = 11 + OBSERVATIONS.index(observation)
    shown = (motion.time >= START) & (motion.time <= START + SHOWN)
    figure = Figure(figsize=(9, 4), layout="constrained")
    axis = figure.subplots()
    axis.plot(motion.time[shown], motion.contact_force[shown], color=ORANGE, linewidth=2, label="true")
    axis.plot(motion.time[shown], force[shown], color="black", linewidth=0.8, label="estimated")
    axis.set(xlabel="time (s)", ylabel="contact force (N)", xlim=(START, START + SHOWN))
    words = f"as Fig. {number} of paper 2, from {observation}"
    figure.suptitle(f"{words}, {SPEED_KMH:g} km/h, 120 N, mismatch {100 * MISMATCH:g} %", fontsize="medium")
    legend_above(axis)
    axis.grid(color="0.9")
    return figure


def delay_plot(motion: Motion, forces: Mapping[str, Array]) -> Figure:
    """Delay by phase over frequency of estimates (N), (n,), by name; only where they are coherent."""
    from matplotlib.figure import Figure

    assert motion.contact_force is not None
    kept = slice(round(START / motion.time_step), None)
    figure = Figure(figsize=(8, 4.2), layout="constrained")
    axis = figure.subplots()
    for k, (name, force) in enumerate(forces.items()):
        found = phases(motion.contact_force[kept], force[kept], motion.time_step)
        late = np.where(found.coherence >= COHERENT, 1e3 * found.delay, np.nan)
        axis.plot(found.frequency, late, "o-", markersize=3, color=series_colour(k), label=name)
    axis.axhline(0, color="0.4", linewidth=0.8)
    axis.set(xlabel="frequency (Hz)", ylabel="late by (ms)", xlim=(0, HIGHEST))
    words = f"Delay by phase, {SPEED_KMH:g} km/h; gaps: less than half coherent"
    figure.suptitle(words, fontsize="medium")
    legend_above(axis, 3)
    axis.grid(color="0.9")
    return figure


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
