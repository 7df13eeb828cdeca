"""The rig of section 2 beside the line itself: Figs 5 to 8, and what the paper says of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from ...base.arrays import from_kmh
from ...base.errors import InputError
from ...base.table import Table
from ...catalog import load_pantograph
from ...metrics.low_pass import amplitudes
from ...rig.computer import Pair, compare, load_rig, rms
from ...rig.margins import with_values
from ...rig.report import pair_facts, plot_pairs, stability, stability_table
from ..study import Comparison, Outcome, Report, said

PANTOGRAPH, LINE, SPEED_KMH = "own-two-mass", "en50318-2002", 250.0
RIGS = ("rig", "rig-flexible")
SPEEDS_KMH = (150.0, 200.0, 250.0, 300.0)
VARIANTS: Mapping[str, dict[str, dict[str, Any]]] = {
    "as it stands": {},
    "no compensation": {"computer": {"compensation": "none"}},
    "compensation: prediction": {"computer": {"compensation": "prediction"}},
    "compensation: adaptive": {"computer": {"compensation": "adaptive"}},
    "cylinder of 30 Hz": {"cylinder": {"natural_frequency": 30.0}},
    "cylinder of 120 Hz": {"cylinder": {"natural_frequency": 120.0}},
    "cylinder of 40 Hz, compensated for as 60 Hz": {
        "cylinder": {"natural_frequency": 40.0},
        "computer": {"assumed_frequency": 60.0},
    },
    "the same, adaptive": {
        "cylinder": {"natural_frequency": 40.0},
        "computer": {"assumed_frequency": 60.0, "compensation": "adaptive"},
    },
    "delay of 0 ms": {"computer": {"delay": 0.0}},
    "delay of 3 ms": {"computer": {"delay": 3e-3}},
    "sampled every 0.5 ms": {"computer": {"interval": 5e-4, "delay": 5e-4}},
    "sampled every 2 ms": {"computer": {"interval": 2e-3, "delay": 2e-3}},
    "filter of 100 Hz": {"load_cell": {"filter_frequency": 100.0}},
    "filter of 200 Hz": {"load_cell": {"filter_frequency": 200.0}},
    "inertia of 0.2 kg not compensated for": {"load_cell": {"compensated_mass": 1.3}},
    "inertia of 1.5 kg not compensated for": {"load_cell": {"compensated_mass": 0.0}},
}
"""The rig with the flexible line, one part of it changed."""
HARMONICS = 12  # of the span, whose amplitudes a table shows
BELOW, ABOVE = (0.0, 5.0), (10.0, 20.0)  # bands (Hz) of the paper's statement on the spectrum


def pairs_at(speed_kmh: float = SPEED_KMH) -> dict[str, Pair]:
    """Each rig of the catalogue beside the paper's reference line."""
    return {name: compare(load_rig(name), LINE, PANTOGRAPH, speed_kmh) for name in RIGS}


def statements(pairs: Mapping[str, Pair]) -> tuple[Comparison, ...]:
    """The paper's words on Figs 5 to 8, of its own rig; then what its last sentence expects of droppers."""
    own, flexible = pairs["rig"], pairs["rig-flexible"]
    below, above = own.bands(edges=(BELOW, ABOVE))
    frequency, amplitude = amplitudes(own.signals("contact_force")[0], own.reference.time_step)
    inside = (frequency >= ABOVE[0]) & (frequency < ABOVE[1])

    def correlation(name: str) -> float:
        return float(np.corrcoef(*own.signals(name))[0, 1])

    def difference(name: str) -> float:
        true, ours = own.signals(name)
        return rms(ours - true) / rms(true)

    return (
        said("rig-head", correlation("head")),
        said("rig-frame", correlation("frame")),
        said("rig-force", difference("contact_force") / difference("head")),
        said("rig-below", below.rig / below.reference),
        said("rig-above", above.error),
        said("rig-passing", float(frequency[inside][np.argmax(amplitude[inside])])),
        said("rig-flexible", flexible.bands(edges=[(0.0, 20.0)])[0].error),
    )


def _followed(pair: Pair, **edges: Any) -> tuple[str, ...]:
    """Difference of the force by band (% of its rms), and up to which frequency (Hz) the rig follows it."""
    return *(f"{100 * band.error:.1f}" for band in pair.bands(**edges)), f"{pair.followed():g}"


def speeds_table(by_speed: Mapping[float, Mapping[str, Pair]]) -> Table:
    """What each rig follows over speed."""
    named = [(f"{speed:g}", name, pair) for speed, pairs in by_speed.items() for name, pair in pairs.items()]
    bands = (f"{band.low:g}-{band.high:g} Hz" for band in named[0][-1].bands())
    title = "Contact force on the rig: difference from the line itself, % of its rms by band"
    rows = [(speed, name, *_followed(pair)) for speed, name, pair in named]
    return Table(title, ("km/h", "rig", *bands, "followed to (Hz)"), rows, 2)


def variants_table() -> Table:
    """What limits the rig with the flexible line: one part of it changed at a time."""
    rows: list[tuple[str, ...]] = []
    for words, tables in VARIANTS.items():
        try:
            pair = compare(with_values(load_rig("rig-flexible"), tables), LINE, PANTOGRAPH, SPEED_KMH)
            rows.append((words, *_followed(pair, edges=((0.0, 10.0), (10.0, 20.0), (20.0, 40.0)))))
        except InputError:
            rows.append((words, "–", "–", "–", "the rig stops"))
    title = f"rig-flexible, one part changed, {SPEED_KMH:g} km/h: difference of the force, % of its rms"
    return Table(title, ("", "0-10 Hz", "10-20 Hz", "20-40 Hz", "followed to (Hz)"), rows)


def harmonics_table(pairs: Mapping[str, Pair]) -> Table:
    """Amplitudes of the first harmonics of the span, as Fig. 8 shows them."""
    first = next(iter(pairs.values())).reference
    once = from_kmh(SPEED_KMH) / first.alignment.mean_length
    runs = {LINE: first} | {name: pair.rig for name, pair in pairs.items()}
    found = np.column_stack([_harmonics(run, once) for run in runs.values()])
    rows = [
        (f"{(k + 1) * once:.2f}", *(f"{amplitude:.1f}" for amplitude in own)) for k, own in enumerate(found)
    ]
    return Table("Amplitude of the contact force's harmonics (N)", ("Hz", *runs), rows)


def _harmonics(run: Any, once: float) -> Any:
    """Amplitudes (N) of the harmonics of ``once`` (Hz), over whole periods."""
    force = run.contact_force[run.inside()]
    whole = round(np.floor(len(force) * run.time_step * once) / once / run.time_step)
    time = run.time_step * np.arange(whole)
    turns = np.exp(-2j * np.pi * np.outer(once * np.arange(1, HARMONICS + 1), time))
    return 2 / whole * np.abs(turns @ force[:whole])


def outcome(report: Report) -> Outcome:
    """Figs 5 to 8, and what limits the rig."""
    report("the rig beside the line", 0.0)
    pairs = pairs_at()
    report("the rig over speed", 0.1)
    by_speed = {speed: pairs if speed == SPEED_KMH else pairs_at(speed) for speed in SPEEDS_KMH}
    report("what limits the rig", 0.3)
    limits = variants_table()
    report("stability of the rig", 0.5)
    pantograph = load_pantograph(PANTOGRAPH)
    found = {name: stability(load_rig(name), pantograph, SPEED_KMH) for name in RIGS}
    # The delay that the loop bears by its frequency response over that which the simulation bears.
    margins = (
        said("rig-margin", each.linear.delay / each.delay, name=name, delay=1e3 * each.delay)
        for name, each in found.items()
    )
    of_stability = (stability_table(load_rig(name), each) for name, each in found.items())
    facts = {
        f"{speed:g} km/h": [pair_facts(pair) for pair in each.values()] for speed, each in by_speed.items()
    }
    return Outcome(
        title="Paper 2, section 3: the rig beside the line itself",
        comparisons=(*statements(pairs), *margins),
        tables=(harmonics_table(pairs), speeds_table(by_speed), limits, *of_stability),
        plots={"fig05-08-rig": plot_pairs(list(pairs.values()))},
        numbers={"rig": facts, "stability": {name: asdict(each) for name, each in found.items()}},
    )
