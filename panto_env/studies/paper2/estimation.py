"""Paper 2's estimator (section 4.1): how well each method finds the contact force, and parameters.

The pantograph that the estimators know differs from the simulated one by 5 % rms in every mass, spring and
damper; sensors have the noise of the preset "realistic". Figures are medians over seeds of mismatch and
noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np

from ...analysis.pool import Progress, in_processes
from ...analysis.simulation import simulate
from ...base.arrays import Array
from ...base.plotting import ORANGE, legend_above, panels, series_colour
from ...base.table import Table, number
from ...catalog import load_pantograph
from ...estimation.estimate import BANDS, COHERENT, Score, estimate, phases, score
from ...estimation.force import FORCE_MODELS, RandomWalk, as_force_model
from ...estimation.model import PAPER2, EstimatorSettings
from ...estimation.motion import DISPLACEMENT_NOISE, VELOCITY_NOISE, Motion, measure
from ...estimation.parameters import (
    LIFT,
    Parameters,
    estimate_parameters,
    frame_parameters,
    information,
    parameter_names,
)
from ...estimation.unknown_input import inertia_corrected, unknown_input
from ...metrics.trajectory import Trajectory
from ...plant.pantograph.schema import PantographData, with_scatter
from ..study import Cell, Comparison, Figure, Outcome, Report, over, said, tabled

CATENARY, PANTOGRAPH = "en50318-2002", "own-two-mass"
"""The paper's line with both wires and droppers, and its rig's pantograph, static load 120 N."""
SPEEDS_KMH = (150.0, 200.0, 250.0, 300.0, 350.0)
SPEED_KMH = 250.0  # that of the paper's Figs 11 and 12
MISMATCH = 0.05
SEEDS = 3
TIME_STEP = 5e-4  # of the simulation (s): two steps to a sample
START = 2.0  # time (s) in which pass and filters forget their start
OBSERVATIONS = ("displacements and velocities", "displacements")
CUTOFFS = {OBSERVATIONS[0]: 80.0, OBSERVATIONS[1]: 50.0}
"""Low-pass of what has no filter's model (Hz): about the minimum error at all frequencies over all speeds."""
LAG = 0.1  # of the smoother (s)
FREE = 1e5  # intensity of a random walk (N/s^0.5) of which next to nothing is believed
NOISES = (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4)  # of displacements, rms (m)
SHOWN = 4.0  # seconds drawn: about five spans at 250 km/h. Own choice


@dataclass(frozen=True)
class Case:
    """One method to estimate the force of one pass, median over seeds."""

    speed_kmh: float
    condition: str
    observation: str
    method: str
    scores: tuple[Score, ...]  # by band
    least_correlation: tuple[float, ...]  # of any seed, by band


@cache
def run(speed_kmh: float, condition: str = "new") -> Trajectory:
    """A passive pass along the line."""
    given: dict[str, Any] = {"time_step": TIME_STEP, "line_condition": condition, "record_droppers": False}
    return simulate(CATENARY, PANTOGRAPH, speed_kmh, **given)


def known_pantograph(seed: int) -> PantographData:
    """The pantograph as an estimator knows it, not as it is."""
    return with_scatter(load_pantograph(PANTOGRAPH), MISMATCH, np.random.default_rng(seed))


def filtered(force_model: str, lag: float, motion: Motion, known: PantographData, observation: str) -> Array:
    """Contact force (N), (n,), by a Kalman filter with this belief, or a smoother."""
    settings = EstimatorSettings(observation=observation, force_model=as_force_model(force_model), lag=lag)
    return estimate(motion, known, settings).force


METHODS: dict[str, Callable[[Motion, PantographData, str], Array]] = {
    **{f"filter, {name}": partial(filtered, name, 0.0) for name in FORCE_MODELS},
    f"smoother, {1e3 * LAG:g} ms": partial(filtered, "random-walk", LAG),
    "unknown input": lambda motion, known, observation: unknown_input(
        motion, known, EstimatorSettings(observation=observation), cutoff=CUTOFFS[observation]
    ),
    "inertia-corrected": lambda motion, known, observation: inertia_corrected(
        motion, known, velocities=observation == OBSERVATIONS[0], cutoff=CUTOFFS[observation]
    ),
}
"""Contact force (N), (n,), with these observations: by belief, then by none, which needs a low-pass."""


def settled_scores(motion: Motion, force: Array) -> tuple[Score, ...]:
    """Of an estimate (N), (n,), once all has forgotten its start, by band."""
    assert motion.contact_force is not None
    kept = slice(round(START / motion.time_step), None)
    return tuple(score(motion.contact_force[kept], force[kept], motion.time_step, band) for band in BANDS)


def cases(
    speeds_kmh: Sequence[float] = SPEEDS_KMH, condition: str = "new", progress: Progress | None = None
) -> list[Case]:
    """Every method, with both sets of observations, at every speed, on all cores."""
    runs = {speed: run(speed, condition) for speed in speeds_kmh}
    keys = list(product(speeds_kmh, range(SEEDS)))
    jobs = [partial(_assess, measure(runs[speed], seed=seed), seed) for speed, seed in keys]
    found = dict(zip(keys, in_processes(jobs, progress=progress), strict=True))
    return [
        _median((speed, condition, *method), [found[speed, seed][method] for seed in range(SEEDS)])
        for speed, method in product(speeds_kmh, product(OBSERVATIONS, METHODS))
    ]


def _assess(motion: Motion, seed: int) -> dict[tuple[str, str], tuple[Score, ...]]:
    known = known_pantograph(seed)
    return {
        (observation, method): settled_scores(motion, METHODS[method](motion, known, observation))
        for observation, method in product(OBSERVATIONS, METHODS)
    }


def _median(which: tuple[float, str, str, str], seeds: Sequence[tuple[Score, ...]]) -> Case:
    scores, lowest = [], []
    for of_band in zip(*seeds, strict=True):
        medians = np.median([list(vars(each).values()) for each in of_band], axis=0)
        scores.append(Score(*medians.tolist()))
        lowest.append(min(each.correlation for each in of_band))
    return Case(*which, tuple(scores), tuple(lowest))


def over_noise(trajectory: Trajectory) -> Mapping[tuple[str, float], Score]:
    """Scores in 0 to 20 Hz by observation and noise of displacements (m), velocities' in proportion."""
    found, known = {}, known_pantograph(0)
    for noise in NOISES:
        noises: dict[str, Any] = {
            "displacement_noise": noise,
            "velocity_noise": noise / DISPLACEMENT_NOISE * VELOCITY_NOISE,
        }
        motion = measure(trajectory, **noises)
        for observation in OBSERVATIONS:
            force = estimate(motion, known, EstimatorSettings(observation=observation, **noises)).force
            found[observation, noise] = settled_scores(motion, force)[-1]
    return found


@dataclass(frozen=True)
class ParameterInformation:
    """Parameters as the extended filter found them, and how well a pass can determine them at all."""

    known: PantographData
    found: Parameters
    bounds: Mapping[str, float]  # minimum relative standard deviation of each alone, by name
    scale: float  # minimum relative standard deviation of all frame parameters and the lift by one factor


def parameter_information(trajectory: Trajectory) -> ParameterInformation:
    """Parameters by the extended filter, and how well the pass can determine each."""
    motion, true, known = measure(trajectory), load_pantograph(PANTOGRAPH), known_pantograph(0)
    settings = EstimatorSettings(observation=OBSERVATIONS[1])
    found = estimate_parameters(motion, known, settings)
    free = settings.model_copy(update={**PAPER2, "force_model": RandomWalk(intensity=FREE)})
    names = (*parameter_names(true), LIFT)
    single = np.diag(information(motion, true, free, names)) ** -0.5
    together = information(motion, true, free, (*frame_parameters(true), LIFT))
    bounds = dict(zip(names, single.tolist(), strict=True))
    scale = float(np.linalg.eigvalsh(together)[0] ** -0.5)
    return ParameterInformation(known=known, found=found, bounds=bounds, scale=scale)


def ways_table(cases: Sequence[Case]) -> Table:
    """Every method at the paper's speed, by band."""

    def by_band(what: str, cell: Callable[[Score], str]) -> list[tuple[str, Cell]]:
        def at(k: int) -> Cell:
            return lambda case: cell(case.scores[k])

        return [(f"{what}, 0–{band:g} Hz", at(k)) for k, band in enumerate(BANDS)]

    return tabled(
        f"The estimated force at {SPEED_KMH:g} km/h, mismatch {100 * MISMATCH:g} %, median of {SEEDS} seeds",
        [
            ("observations", "{.observation}"),
            ("method", "{.method}"),
            *by_band("correlation", lambda score: number(score.correlation, 4)),
            *by_band("rms error (N)", lambda score: number(score.rms, 2)),
            ("all", lambda case: number(case.scores[-1].whole_rms, 2)),
            ("mean error (N)", lambda case: number(case.scores[-1].bias, 2)),
            *by_band("late by (ms)", lambda score: number(1e3 * score.delay, 2)),
            *by_band("by phase (ms)", lambda score: number(1e3 * score.phase_delay, 2))[-1:],
        ],
        [case for case in cases if case.speed_kmh == SPEED_KMH],
        text_columns=2,
    )


def over_speed_tables(cases: Sequence[Case]) -> Iterator[Table]:
    """One table a quantity, in 0 to 20 Hz: methods and observations down, speeds across."""
    found = {(case.observation, case.method, case.speed_kmh): case.scores[-1] for case in cases}
    speeds = sorted({speed for *_, speed in found})
    methods = list(dict.fromkeys((observation, method) for observation, method, _ in found))
    headings = ("observations", "method", *(f"{speed:g} km/h" for speed in speeds))
    for words, name, scale, digits in (
        ("correlation with the true force", "correlation", 1.0, 4),
        ("rms error without its mean (N)", "rms", 1.0, 2),
        ("delay by cross-correlation (ms)", "delay", 1e3, 2),
    ):
        rows = [
            (*each, *(number(scale * getattr(found[*each, speed], name), digits) for speed in speeds))
            for each in methods
        ]
        yield Table(f"Estimated force, {words}, 0 to {BANDS[-1]:g} Hz", headings, rows, text_columns=2)


def noise_table(scores: Mapping[tuple[str, float], Score]) -> Table:
    """What noise does to delay and correlation in 0 to 20 Hz."""
    rows = []
    for noise in dict.fromkeys(noise for _, noise in scores):
        both = [scores[observation, noise] for observation in OBSERVATIONS]
        late = (number(1e3 * each.delay, 2) for each in both)
        rows.append((f"{1e3 * noise:g}", *late, *(number(each.correlation, 4) for each in both)))
    title = f"Noise, velocities' in proportion; {SPEED_KMH:g} km/h, 0 to 20 Hz"
    delays = ("noise of displacements (mm)", "delay, both (ms)", "delay, displacements (ms)")
    return Table(title, (*delays, "correlation, both", "correlation, displacements"), rows)


def parameters_table(estimated: ParameterInformation) -> Table:
    """True, known and found values, and the minimum uncertainty of each."""
    true, parameters = load_pantograph(PANTOGRAPH), estimated.found
    pairs = zip(parameters.values.tolist(), parameters.deviation.tolist(), strict=True)
    found = dict(zip(parameters.names, pairs, strict=True))
    rows = []
    for name, bound in estimated.bounds.items():
        key, _, place = name.partition(".")
        cells = ["–"] * 4
        if place:
            right, known = (float(getattr(each, key)[int(place) - 1]) for each in (true, estimated.known))
            cells = [f"{right:g}", f"{100 * (known / right - 1):+.2f}", "not determined", "–"]
            if name in found:
                value, deviation = found[name]
                cells[2:] = f"{100 * (value / right - 1):+.2f}", f"{100 * deviation:.2f}"
        rows.append((name, *cells, f"{100 * bound:.3g}"))
    rows.append(("frame and lift by one factor", "–", "–", "–", "–", f"{100 * estimated.scale:.3g}"))
    headings = ("parameter", "true", "known, error (%)", "found, error (%)", "± (%)", "alone, minimum ± (%)")
    title = "Parameters from one pass by the extended filter; ± is one standard deviation"
    return Table(title, headings, rows)


def comparisons(cases: Sequence[Case]) -> tuple[Comparison, ...]:
    """What the paper says of Figs 11 and 12, at 250 km/h and 120 N, in 0 to 20 Hz."""
    found = {(case.observation, case.method): case for case in cases if case.speed_kmh == SPEED_KMH}
    both, one = (found[observation, "filter, random-walk"] for observation in OBSERVATIONS)
    smoothed = found[OBSERVATIONS[1], "smoother, 100 ms"]
    note = f"mismatch {100 * MISMATCH:g} %, minimum of {SEEDS} seeds"
    return (
        said("estimator-both", both.least_correlation[-1], note=note),
        said("estimator-one", one.least_correlation[-1], note=note),
        said("estimator-delay", 1e3 * one.scores[-1].delay),
        said("estimator-delays", one.scores[-1].delay / both.scores[-1].delay),
        said("estimator-smoothed", smoothed.least_correlation[-1]),
    )


def figure_11_12(motion: Motion, force: Array, observation: str) -> Figure:
    """True and estimated contact force (N), (n,): Fig. 11 with velocities, Fig. 12 without."""
    assert motion.contact_force is not None
    shown = (motion.time >= START) & (motion.time <= START + SHOWN)
    time, (figure, axis) = motion.time[shown], panels((9, 4))
    axis.plot(time, motion.contact_force[shown], color=ORANGE, linewidth=2, label="true")
    axis.plot(time, force[shown], color="black", linewidth=0.8, label="estimated")
    axis.set(xlabel="time (s)", ylabel="contact force (N)", xlim=(START, START + SHOWN))
    words = f"as Fig. {11 + OBSERVATIONS.index(observation)} of paper 2, from {observation}"
    figure.suptitle(f"{words}, {SPEED_KMH:g} km/h, 120 N, mismatch {100 * MISMATCH:g} %", fontsize="medium")
    legend_above(axis)
    axis.grid(color="0.9")
    return figure


def delay_plot(motion: Motion, forces: Mapping[str, Array]) -> Figure:
    """Delay by phase over frequency of estimates (N), (n,), by name; only where they are coherent."""
    assert motion.contact_force is not None
    kept = slice(round(START / motion.time_step), None)
    figure, axis = panels((8, 4.2))
    for k, (name, force) in enumerate(forces.items()):
        found = phases(motion.contact_force[kept], force[kept], motion.time_step)
        late = np.where(found.coherence >= COHERENT, 1e3 * found.delay, np.nan)
        axis.plot(found.frequency, late, "o-", markersize=3, color=series_colour(k), label=name)
    axis.axhline(0, color="0.4", linewidth=0.8)
    axis.set(xlabel="frequency (Hz)", ylabel="late by (ms)", xlim=(0, 20))
    figure.suptitle(f"Delay by phase, {SPEED_KMH:g} km/h; gaps: less than half coherent", fontsize="medium")
    legend_above(axis, 3)
    axis.grid(color="0.9")
    return figure


def outcome(report: Report) -> Outcome:
    """Every method at every speed, over noise, which parameters a pass determines, and the figures."""
    report("estimator: a pass over the line", 0.0)
    trajectory = run(SPEED_KMH)
    every = cases(progress=over(report, "estimator: every way", 0.05, 0.8))
    report("estimator: noise", 0.8)
    scores = over_noise(trajectory)
    report("estimator: parameters", 0.9)
    parameters = parameter_information(trajectory)
    motion, known = measure(trajectory), known_pantograph(0)
    by_filter = {kind: filtered("random-walk", 0.0, motion, known, kind) for kind in OBSERVATIONS}
    late = {f"filter, {kind}": force for kind, force in by_filter.items()}
    smoothed = filtered("random-walk", LAG, motion, known, OBSERVATIONS[1])
    late[f"smoother of {1e3 * LAG:g} ms, {OBSERVATIONS[1]}"] = smoothed
    names = ("fig11-displacements-and-velocities", "fig12-displacements")
    drawn = [figure_11_12(motion, force, kind) for kind, force in by_filter.items()]
    return Outcome(
        "Paper 2, section 4.1: the contact force from the pantograph's motion",
        comparisons(every),
        (ways_table(every), *over_speed_tables(every), noise_table(scores), parameters_table(parameters)),
        dict(zip(names, drawn, strict=True)) | {"estimator-delay": delay_plot(motion, late)},
        {"estimator": [asdict(case) for case in every]},
    )
