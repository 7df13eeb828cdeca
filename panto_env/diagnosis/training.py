"""Training of the classifier of kinds on simulated lines: ``python -m panto_env.diagnosis.training``.

It wants scikit-learn (``pip install panto-env[diagnosis]``), and writes ``kinds.npz`` beside this file.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from ..analysis.pool import in_processes
from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..base.files import write_whole
from .cases import Defect, Track, drive, every_defect
from .features import Candidate, Sort, candidates, features
from .healthy import Healthy
from .kinds import KINDS, OF_SORT, TRAINED, WORN, Classifier
from .passes import side_by_side
from .places import Evidence, Region, regions
from .threshold import threshold

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
    shown, classes = [], []
    for k, (defect, _) in enumerate(whole):
        evidence, _ = model.weigh(passes.only(k), level)
        for region in regions(evidence):
            if defect.kind in KINDS and abs(
                evidence.position[region.peak] - defect.position
            ) < 0.75 * evidence.alignment.length_at(defect.position):
                own, which = _learn_from(evidence, region, defect)
                shown.append(own)
                classes.append(which)
    return np.concatenate(shown), np.concatenate(classes)


def _learn_from(evidence: Evidence, region: Region, defect: Defect) -> tuple[Array, Index]:
    """Candidates of a region that are right or wrong for sure, and their classes."""
    kept: list[Candidate] = []
    classes: list[int] = []
    for place in candidates(evidence, region):
        apart = abs(place.position - defect.position)
        possible = defect.kind in OF_SORT[place.sort]
        right = possible and apart < NEAR[place.sort] * (2 if defect.kind == WORN else 1)
        if not right and (apart < UNLIKE and not possible):
            continue
        kept.append(place)
        classes.append(KINDS.index(defect.kind) + 1 if right else 0)
    return features(evidence, region, kept), np.array(classes)


def fit(shown: Array, classes: Index, seed: int = 0) -> Classifier:
    """Train on features, (n, features), and classes, (n,). Raises InputError without scikit-learn.

    Rare kinds count for more than their share.
    """
    try:
        from sklearn.neural_network import MLPClassifier
    except ImportError as error:
        raise InputError("Training wants scikit-learn: pip install 'panto-env[diagnosis]'.") from error
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
