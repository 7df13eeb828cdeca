"""The estimator's tables, and the paper's statements beside ours."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ...base.table import Table
from ...catalog import load_pantograph
from ...estimation.estimate import BANDS, Score
from ...terminal import number
from ..study import Comparison
from .estimation import MISMATCH, OBSERVATIONS, PANTOGRAPH, SEEDS, SPEED_KMH, Case, ParameterInformation

QUANTITIES: dict[str, Callable[[Score], str]] = {
    "correlation with the true force": lambda score: number(score.correlation, 4),
    "rms error without its mean (N)": lambda score: number(score.rms, 2),
    "delay by cross-correlation (ms)": lambda score: number(1e3 * score.delay, 2),
}
"""What tables show over speed in 0 to 20 Hz, by their titles."""


def ways_table(cases: Sequence[Case]) -> Table:
    """Every way at the paper's speed, by band."""
    rows = []
    for case in cases:
        if case.speed_kmh != SPEED_KMH:
            continue
        last = case.scores[-1]
        rows.append(
            (
                case.observation,
                case.method,
                *(number(score.correlation, 4) for score in case.scores),
                *(number(score.rms, 2) for score in case.scores),
                number(last.whole_rms, 2),
                number(last.bias, 2),
                *(number(1e3 * score.delay, 2) for score in case.scores),
                number(1e3 * last.phase_delay, 2),
            )
        )
    bands = [f"0–{band:g} Hz" for band in BANDS]
    headings = (
        "observations",
        "method",
        *(f"correlation, {band}" for band in bands),
        *(f"rms error (N), {band}" for band in bands),
        "all",
        "mean error (N)",
        *(f"late by (ms), {band}" for band in bands),
        f"by phase (ms), {bands[-1]}",
    )
    title = (
        f"The estimated force at {SPEED_KMH:g} km/h, mismatch {100 * MISMATCH:g} %, median of {SEEDS} seeds"
    )
    return Table(title, headings, rows, text_columns=2)


def over_speed_tables(cases: Sequence[Case]) -> tuple[Table, ...]:
    """One table a quantity, in 0 to 20 Hz: methods and observations down, speeds across."""
    speeds = sorted({case.speed_kmh for case in cases})
    headings = ("observations", "method", *(f"{speed:g} km/h" for speed in speeds))
    found = {(case.observation, case.method, case.speed_kmh): case.scores[-1] for case in cases}
    ways = list(dict.fromkeys((case.observation, case.method) for case in cases))
    return tuple(
        Table(
            f"Estimated force, {title}, 0 to {BANDS[-1]:g} Hz",
            headings,
            [(*way, *(cell(found[*way, speed]) for speed in speeds)) for way in ways],
            text_columns=2,
        )
        for title, cell in QUANTITIES.items()
    )


def noise_table(scores: Mapping[tuple[str, float], Score]) -> Table:
    """What noise does to delay and correlation in 0 to 20 Hz."""
    noises = list(dict.fromkeys(noise for _, noise in scores))
    rows = []
    for noise in noises:
        each = [scores[observation, noise] for observation in OBSERVATIONS]
        delays, likeness = [1e3 * one.delay for one in each], [one.correlation for one in each]
        rows.append((f"{1e3 * noise:g}", *(number(x, 2) for x in delays), *(number(x, 4) for x in likeness)))
    sets = ("both", "displacements")
    headings = (
        "noise of displacements (mm)",
        *(f"delay, {name} (ms)" for name in sets),
        *(f"correlation, {name}" for name in sets),
    )
    return Table(f"Noise, velocities' in proportion; {SPEED_KMH:g} km/h, 0 to 20 Hz", headings, rows)


def parameters_table(estimated: ParameterInformation) -> Table:
    """True, known and found values, and the minimum uncertainty of each."""
    true = load_pantograph(PANTOGRAPH)
    found = dict(zip(estimated.found.names, estimated.found.values.tolist(), strict=True))
    deviation = dict(zip(estimated.found.names, estimated.found.deviation.tolist(), strict=True))
    rows = []
    for name, bound in estimated.bounds.items():
        key, _, place = name.partition(".")
        if not place:
            rows.append((name, "–", "–", "–", "–", f"{100 * bound:.3g}"))
            continue
        right, known = (float(getattr(each, key)[int(place) - 1]) for each in (true, estimated.known))
        known_error = f"{100 * (known / right - 1):+.2f}"
        if name in found:
            cells = (f"{100 * (found[name] / right - 1):+.2f}", f"{100 * deviation[name]:.2f}")
        else:
            cells = ("not determined", "–")
        rows.append((name, f"{right:g}", known_error, *cells, f"{100 * bound:.3g}"))
    rows.append(("frame and lift by one factor", "–", "–", "–", "–", f"{100 * estimated.scale:.3g}"))
    headings = ("parameter", "true", "known, error (%)", "found, error (%)", "± (%)", "alone, minimum ± (%)")
    return Table(
        "Parameters from one pass by the extended filter; ± is one standard deviation", headings, rows
    )


def comparisons(cases: Sequence[Case]) -> tuple[Comparison, ...]:
    """What the paper says of Figs 11 and 12, at 250 km/h and 120 N, in 0 to 20 Hz."""
    found = {
        (case.observation, case.method): case
        for case in cases
        if case.speed_kmh == SPEED_KMH and case.condition == "new"
    }
    both, one = (found[observation, "filter, random-walk"] for observation in OBSERVATIONS)
    smoothed = found[OBSERVATIONS[1], "smoother, 100 ms"]
    note = f"mismatch {100 * MISMATCH:g} %, minimum of {SEEDS} seeds"
    return (
        Comparison(
            "displacements and velocities: correlation", "", both.least_correlation[-1],
            "extremely satisfactory", 0.97, 1.0, note,
        ),
        Comparison(
            "displacements: correlation", "", one.least_correlation[-1], "still good", 0.9, 1.0, note
        ),
        Comparison(
            "displacements: delay", "ms", 1e3 * one.scores[-1].delay, "a certain delay", 3.0, 20.0,
            "by cross-correlation; the paper gives no figure",
        ),
        Comparison(
            "displacements: delay over that with velocities", "",
            one.scores[-1].delay / both.scores[-1].delay,
            "increased phase shift", 1.2, 10.0, "",
        ),
        Comparison(
            "displacements, smoothed: correlation", "", smoothed.least_correlation[-1],
            "delay does not affect diagnosis", 0.99, 1.0, "diagnosis may wait 100 ms, and then there is none",
        ),
    )  # fmt: skip
