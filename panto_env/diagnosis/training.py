"""Simulated passes over lines with drawn defects: what a diagnosis is trained on, and judged by."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.pool import in_processes
from ..analysis.simulation import simulate
from ..base.arrays import Array, Index
from ..base.extras import require
from ..base.files import write_whole
from ..catalog import load_catenary, load_pantograph
from ..metrics.figures import FIRST_SETTLED
from ..metrics.trajectory import Trajectory
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import LINE_CONDITIONS, LineCondition
from ..plant.pantograph.schema import with_scatter
from .features import (
    BROKEN,
    KINDS,
    LONG,
    OF_SORT,
    RAISED,
    SHORT,
    SPOT,
    SUNK,
    TENSION,
    TRAINED,
    WORN,
    Classifier,
    Evidence,
    Region,
    Sort,
    candidates,
    features,
    regions,
    threshold,
)
from .healthy import Healthy
from .passes import side_by_side

SEVERITIES: Mapping[str, tuple[float, ...]] = {
    BROKEN: (1.0,),
    LONG: (0.002, 0.005, 0.01),  # m
    SHORT: (0.002, 0.005, 0.01, 0.02),  # m
    RAISED: (0.01, 0.02, 0.05, 0.1),  # m
    SUNK: (0.01, 0.02, 0.05, 0.1),  # m
    SPOT: (0.5, 1.0, 2.0, 5.0, 10.0),  # kg
    WORN: (0.05, 0.1, 0.2, 0.3),  # of the section
    TENSION: (0.02, 0.05, 0.1, 0.2),  # of both wires
}
"""Kinds of defects, and how bad each is made. A dropper more than about 10 mm too long carries nothing and is
as good as broken."""
SPANS = 30
"""Of a simulated line."""
FIRST, BEYOND = FIRST_SETTLED + 2, SPANS - 5
"""Spans from which on, and before which, defects are drawn: away from both ends of what is judged."""
WORN_LENGTH = 15.0
"""Of a worn stretch (m)."""
SPEED_SCATTER = 0.002
"""Rms relative difference of speed between passes: half a km/h at 250 km/h."""
PANTOGRAPH_SCATTER = 0.05
"""Rms relative difference of the pantographs' masses, springs and dampers."""


@dataclass(frozen=True)
class Track:
    """A line of its own, as its irregularity and its droppers are drawn, under trains of one kind."""

    catenary: str
    pantograph: str
    speed_kmh: float
    seed: int  # of the line
    scatter: float = 5e-3  # rms error of its droppers' lengths (m)

    @property
    def data(self) -> FlexibleCatenaryData:
        """The line as designed."""
        data = load_catenary(self.catenary)
        assert isinstance(data, FlexibleCatenaryData)
        return data


@dataclass(frozen=True)
class Defect:
    """A defect of a line."""

    kind: str
    severity: float
    condition: Mapping[str, Any]  # what a line condition has for it
    position: float  # of its middle (m); nan of what is everywhere


def draw_defect(track: Track, kind: str, severity: float, span: int, random: np.random.Generator) -> Defect:
    """A defect at a place drawn in a span, counted from 1."""
    data = track.data
    alignment = data.alignment()
    begin, number = alignment.support(span - 1), 1 + int(random.integers(len(data.droppers.positions)))
    layout = data.layout(SPANS)
    at = layout.droppers[layout.index(span, number)].position
    if kind == TENSION:
        lost = {"lost_contact_tension": severity, "lost_messenger_tension": severity}
        return Defect(kind, severity, lost, float("nan"))
    if kind == BROKEN:
        return Defect(kind, severity, {"broken_droppers": [(span, number)]}, at)
    if kind in (LONG, SHORT):
        wrong = severity if kind == LONG else -severity
        return Defect(kind, severity, {"miscut_droppers": [(span, number, wrong)]}, at)
    if kind in (RAISED, SUNK):
        height = severity if kind == RAISED else -severity
        return Defect(kind, severity, {"raised_supports": [(span, height)]}, alignment.support(span))
    offset = float(random.uniform(0, alignment.length_at(begin)))
    if kind == SPOT:
        return Defect(kind, severity, {"hard_spots": [(span, offset, severity, 0.0)]}, begin + offset)
    stretch = [(span, offset, WORN_LENGTH, severity)]
    return Defect(kind, severity, {"worn_stretches": stretch}, begin + offset + WORN_LENGTH / 2)


def every_defect(track: Track, random: np.random.Generator, broken: int = 1) -> list[Defect]:
    """One of each kind and severity, and ``broken`` broken droppers, at places drawn."""
    drawn = [(kind, severity) for kind, each in SEVERITIES.items() for severity in each]
    drawn += [(BROKEN, 1.0)] * (broken - 1)
    return [draw_defect(track, *each, int(random.integers(FIRST, BEYOND)), random) for each in drawn]


def drive(track: Track, number: int, defects: tuple[Defect, ...] = ()) -> Trajectory:
    """One pass over a track, its number-th, of which speed and pantograph are drawn."""
    random = np.random.default_rng([track.seed, number])
    smooth = LINE_CONDITIONS["smooth"].model_dump() | {"dropper_scatter": track.scatter}
    for defect in defects:
        for key, value in defect.condition.items():
            smooth[key] = [*smooth[key], *value] if isinstance(value, list) else value
    data, pantograph = track.data, load_pantograph(track.pantograph)
    run = simulate(
        track.catenary,
        with_scatter(pantograph, PANTOGRAPH_SCATTER, random),
        track.speed_kmh * (1 + SPEED_SCATTER * random.standard_normal()),
        known_pantograph=pantograph,
        line_condition=LineCondition(**smooth),
        seed=track.seed,
        spans=SPANS,
        distance=data.alignment().support(SPANS - 2),
        window=0,  # for all: worn wire and hard spots want it
        accuracy="fast",
        record_droppers=False,
    )
    return replace(run, dropper_position=data.layout(SPANS).positions)


LINES = ("en50318-2002", "beijing-shanghai", "re250")
PANTOGRAPH = "dsa380"
SPEEDS_KMH = (160.0, 200.0, 240.0, 280.0)
SEEDS = (1, 2, 3, 4, 5, 6)
"""What the classifier sees; the study judges it on other speeds, lines, pantographs and seeds."""
HEALTHY, BROKEN_EACH = 8, 8
"""Of each track: healthy passes, and broken droppers; of other kinds there is one of each severity."""
HIDDEN, PENALTY, EPOCHS = 48, 0.5, 50
"""Of the network: units, weight decay, rounds. Chosen on lines of seeds 11 and 12, which no study sees."""
REPEATED = 2.0
"""How often an example of the most frequent kind is shown in a round; of others more, by the root of how much
rarer they are."""
NEAR = {Sort.DROPPER: 0.1, Sort.SUPPORT: 0.1, Sort.WIRE: 0.75}
"""Way (m) up to which a candidate is where the defect is; of worn wire, which is long, twice as far."""
UNLIKE = 2.0
"""Way (m) within which a candidate of another sort is neither right nor wrong."""


def examples(track: Track) -> tuple[Array, Index]:
    """Features, (n, features), and classes, (n,), of what defects on one track show."""
    random = np.random.default_rng([track.seed, round(track.speed_kmh)])
    defects = every_defect(track, random, BROKEN_EACH)
    runs = [drive(track, HEALTHY + k, (defect,)) for k, defect in enumerate(defects)]
    whole = [(defect, run) for defect, run in zip(defects, runs, strict=True) if not run.terminated]
    passes, reference = side_by_side(
        [run for _, run in whole], [drive(track, k) for k in range(HEALTHY)], track.seed
    )
    model = Healthy.of(reference)
    level = threshold(model.scores, passes.per_span, passes.span)
    shown = []
    for k, (defect, _) in enumerate(whole):
        evidence, _ = model.score(passes.only(k), level)
        for region in regions(evidence):
            if defect.kind in KINDS and abs(
                evidence.position[region.peak] - defect.position
            ) < 0.75 * evidence.alignment.length_at(defect.position):
                shown.append(_learn_from(evidence, region, defect))
    features_of, classes = zip(*shown, strict=True)
    return np.concatenate(features_of), np.concatenate(classes)


def _learn_from(evidence: Evidence, region: Region, defect: Defect) -> tuple[Array, Index]:
    """Candidates of a region that are right or wrong for sure, and their classes."""
    kept = []
    for place in candidates(evidence, region):
        apart = abs(place.position - defect.position)
        possible = defect.kind in OF_SORT[place.sort]
        right = possible and apart < NEAR[place.sort] * (2 if defect.kind == WORN else 1)
        if possible or apart >= UNLIKE:
            kept.append((place, KINDS.index(defect.kind) + 1 if right else 0))
    places, classes = zip(*kept, strict=True)
    return features(evidence, region, list(places)), np.array(classes)


def fit(shown: Array, classes: Index, seed: int = 0) -> Classifier:
    """Train on features, (n, features), and classes, (n,). Raises InputError without scikit-learn.

    Rare kinds count for more than their share.
    """
    require("Training", "diagnosis", "sklearn")
    from sklearn.neural_network import MLPClassifier

    mean, scale = shown.mean(axis=0), shown.std(axis=0) + 1e-9
    counts = np.bincount(classes, minlength=len(KINDS) + 1)
    repeat = np.ones(len(classes), dtype=np.int64)
    for kind in range(1, len(counts)):
        repeat[classes == kind] = round(REPEATED * np.sqrt(counts[1:].max() / max(counts[kind], 1)))
    rows = np.repeat(np.arange(len(classes)), repeat)
    network = MLPClassifier((HIDDEN,), alpha=PENALTY, max_iter=EPOCHS, random_state=seed)
    network.fit((shown[rows] - mean) / scale, classes[rows])
    (inner, outer), (inner_bias, outer_bias) = network.coefs_, network.intercepts_
    return Classifier(mean, scale, inner, inner_bias, outer, outer_bias)


def save(classifier: Classifier, path: Path = TRAINED) -> None:
    """Write a classifier as plain arrays, whole or not at all."""
    with write_whole(path) as temporary:
        np.savez_compressed(
            temporary, **{name: value.astype(np.float32) for name, value in vars(classifier).items()}
        )


def tracks(seeds: Sequence[int] = SEEDS) -> list[Track]:
    """All tracks that are learned from."""
    return [Track(line, PANTOGRAPH, speed, seed) for line in LINES for speed in SPEEDS_KMH for seed in seeds]


def main(workers: int | None = None) -> None:
    """Simulate, train, write; workers: processes, by default one per core."""

    def report(done: int, every: int) -> None:
        print(f"{done} of {every} tracks", file=sys.stderr)

    found = in_processes([partial(examples, track) for track in tracks()], workers=workers, progress=report)
    shown, classes = (np.concatenate(each) for each in zip(*found, strict=True))
    save(fit(shown, classes))
    counts = np.bincount(classes, minlength=len(KINDS) + 1)
    print(
        f"{len(classes)} candidates, {counts[0]} with nothing there; "
        + ", ".join(f"{count} {kind}" for kind, count in zip(KINDS, counts[1:], strict=True))
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
