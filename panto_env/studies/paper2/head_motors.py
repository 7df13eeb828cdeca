"""Section 4.3 of paper 2 as a part of its study: Figs 14 and 15, and what frame, head and both buy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...base.plotting import legend_above, series_colour
from ..study import Comparison, Outcome, Report
from .motor_bench import BenchRun, bench_run, line_pass
from .motors import (
    BANDS,
    PLACES,
    MotorPass,
    at_force_limit,
    at_power,
    motor_pass,
    places_table,
    without_motors,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPEEDS_KMH = (250.0, 300.0)
WATTS, NEWTONS = 15.0, 50.0
"""Electrical power of all motors, and maximum force at each place, at which places are compared."""
BENCH_KMH, BENCH_GAINS = 250.0, (1.0, 2.0, 4.0)
HEAD_GAIN = 2.0
"""Of the proportional control on the whole pantograph, beside that of the bench (N/N)."""
LOW, MEDIUM = 0, (2, 3)
"""Bands, by their places in BANDS: what "low" and "medium" frequencies are taken to be."""
LARGE = 0.1
"""Share of the maximum harmonic from which on a harmonic counts as large."""
SHOWN = 3.0
"""Seconds of Fig. 14."""


def outcome(report: Report) -> Outcome:
    """Tables and statements on motors in the head and on the frame, and the bench's figures."""
    report("one collector on a bench", 0.0)
    record = line_pass(BENCH_KMH)
    bench = [bench_run(record, gain) for gain in (None, *BENCH_GAINS)]
    tables, numbers, powered = [], {}, {}
    for k, speed_kmh in enumerate(SPEEDS_KMH):
        report(f"motors at {speed_kmh:g} km/h", 0.1 + 0.45 * k)
        passive = without_motors(speed_kmh)
        at_watts = [at_power(speed_kmh, place, WATTS) for place in PLACES]
        at_newtons = [at_force_limit(speed_kmh, place, NEWTONS) for place in PLACES]
        gained = motor_pass(speed_kmh, "head", HEAD_GAIN, passive.figures.mean)
        powered[speed_kmh] = (passive, dict(zip(PLACES, at_watts, strict=True)))
        at = f"{speed_kmh:g} km/h"
        tables += [
            places_table(f"Motors at {at} that take {WATTS:g} W", passive, at_watts),
            places_table(f"Motors of at most {NEWTONS:g} N at {at}", passive, at_newtons),
            places_table(f"Proportional control at {at} by the head's motors", passive, [gained]),
        ]
        named = (
            (f"{WATTS:g} W", at_watts),
            (f"{NEWTONS:g} N", at_newtons),
            (f"gain {HEAD_GAIN:g}", [gained]),
        )
        numbers[at] = {"none": _plain(passive)} | {
            words: {one.place: _plain(one) for one in passes} for words, passes in named
        }
    return Outcome(
        title="Paper 2, section 4.3: motors in the head",
        comparisons=(*_statements(*powered[SPEEDS_KMH[0]]), *_bench_statements(bench)),
        tables=tuple(tables),
        plots={"fig14-15-bench": _plot(bench)},
        numbers={
            "motors": numbers,
            "bench": [
                {"gain": one.gain, "std": one.std, "bands": one.bands, "power": one.power} for one in bench
            ],
        },
    )


def _statements(passive: MotorPass, passes: dict[str, MotorPass]) -> tuple[Comparison, ...]:
    """The paper's words on where actuators work, at equal power."""
    changes = {place: _changes(passive, one) for place, one in passes.items()}
    medium = {place: max(change[k] for k in MEDIUM) for place, change in changes.items()}
    at = f"at {passive.speed_kmh:g} km/h and {WATTS:g} W"
    low, high = BANDS[LOW], (BANDS[MEDIUM[0]][0], BANDS[MEDIUM[-1]][1])
    words = {place: f"motors on the {place} {at}: change of the force" for place in ("frame", "head")}
    band = {"low": f"{low[0]:g}-{low[1]:g} Hz", "medium": f"{high[0]:g}-{high[1]:g} Hz, the worse half"}
    frame_words = "on the frame, effectiveness is limited to the low frequency range"
    head_words = "in the head suspension it is more effective in the medium frequency range"
    return (
        Comparison(
            f"{words['frame']}, {band['low']}", "%", changes["frame"][LOW], frame_words, -100.0, -20.0
        ),
        Comparison(f"{words['frame']}, {band['medium']}", "%", medium["frame"], frame_words, -10.0, 25.0),
        Comparison(f"{words['head']}, {band['medium']}", "%", medium["head"], head_words, -100.0, -20.0),
    )


def _bench_statements(bench: Sequence[BenchRun]) -> tuple[Comparison, ...]:
    free, controlled = bench[0], bench[2]
    note = f"gain {controlled.gain:g}; the paper prints neither the gain nor what the collector touched"
    words = "reduction of the contact force fluctuation with active control (Figs 14 and 15)"
    before, after = free.spectrum[1], controlled.spectrum[1]
    worst = float((after / np.maximum(before, 1e-9))[before > LARGE * before[1:].max()].max())
    return (
        Comparison(
            "σ on the bench, with control over without", "", controlled.std / free.std, words, 0.0, 0.9, note
        ),
        Comparison("the same of the large harmonic that is reduced least", "", worst, words, 0.0, 1.0, note),
    )


def _changes(passive: MotorPass, one: MotorPass) -> list[float]:
    """Change of the force's rms in each band (%)."""
    return [100 * (after / before - 1) for after, before in zip(one.bands, passive.bands, strict=True)]


def _plain(one: MotorPass) -> dict[str, object]:
    return {
        "gain": one.gain,
        "watts": one.power,
        "heat": one.heat,
        "bands": one.bands,
        "largest_force": one.largest_force,
        "figures": one.figures.as_dict(),
    }


def _plot(bench: Sequence[BenchRun]) -> Figure:
    """Fig. 14 and Fig. 15: contact force of the collector on the bench over time, and its spectrum."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), layout="constrained")
    over_time, over_frequency = figure.subplots(2, 1)
    for k, one in enumerate(bench):
        label = "without motor" if k == 0 else f"gain {one.gain:g}"
        style = {"color": "black" if k == 0 else series_colour(k), "linewidth": 1.2}
        shown = one.time < one.time[0] + SHOWN
        over_time.plot(one.time[shown] - one.time[0], one.force[shown], label=label, **style)
        frequency, amplitude = one.spectrum
        inside = (frequency > 0.2) & (frequency < BANDS[-1][1])
        over_frequency.plot(frequency[inside], amplitude[inside], **style)
    over_time.set(xlabel="time (s)", ylabel="contact force (N)", xlim=(0, SHOWN))
    over_frequency.set(xlabel="frequency (Hz)", ylabel="amplitude (N)", xlim=(0, BANDS[-1][1]))
    legend_above(over_time, 4)
    for axis in (over_time, over_frequency):
        axis.grid(color="0.92")
    figure.suptitle(
        f"One collector on a bench, line's motion at {BENCH_KMH:g} km/h, as Figs 14 and 15 of paper 2"
    )
    return figure
