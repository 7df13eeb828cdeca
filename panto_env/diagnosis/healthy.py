"""What healthy passes of a line have in common, place by place, and how far a pass is from it.

A pass is the mean of the healthy ones, plus a few patterns along the whole line by which passes differ (speed
and pantograph: principal components), plus a residual. The residual, over its usual size there and whitened
along the line, is of size 1 where the line is healthy. Its energy in a window is the score.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..base.arrays import Array
from .features import Evidence
from .passes import Passes

WINDOW = 8.0
"""Length (m) over which the energy of the whitened residual is taken: about a dropper interval."""
MEMORY = 10.0
"""Distance (m) back along which the residual is predicted, to whiten it."""
SMOOTHED = 1.0
"""Distance (m) over which the residual's usual size is smoothed."""
MOST_PATTERNS = 4
SPANS_COUNT_AS = 4
"""Passes that the same place in other spans counts as, for the usual size of a residual."""
FLOOR = 0.1
"""Share of white noise that whitening reckons with: without, it would amplify what the 20 Hz filter left."""
QUIET = 0.25
"""Quantile of a pass' windows by which its level is taken: a defect disturbs its surroundings, not this."""
ROUNDS, FAR = 8, 2.0
"""Of robust regression on the patterns; residuals beyond so many standard deviations count less."""


@dataclass(frozen=True)
class Healthy:
    """What healthy passes over a line have in common, and how they differ."""

    mean: Array  # (places,): force (N)
    patterns: Array  # (patterns, places): by which passes differ (N)
    size: Array  # (places,): usual size of the residual, for a level of 1 (N)
    predictor: Array  # (memory,): of the residual by its past
    white: float  # rms of what the predictor leaves
    levels: Array  # (passes,): of healthy passes, each against the others (N)
    scores: Array  # (passes, judged): likewise
    lead: int  # places before those that are judged
    window: int  # places

    @classmethod
    def of(cls, passes: Passes) -> Self:
        """Learn from passes; each is also held against the others alone, to see what healthy ones score."""
        force, window = passes.force, max(1, round(WINDOW / passes.step))
        count = len(force)
        residual = np.array([_against(force[k], np.delete(force, k, axis=0)) for k in range(count)])
        levels = np.array([_level(each, window) for each in residual])
        levelled = residual / levels[:, None]
        size = _usual_size(levelled, passes)
        sizes = [_usual_size(np.delete(levelled, k, axis=0), passes) for k in range(count)]
        unit = np.array([own / _level(own, window) for own in residual / sizes])
        predictor = _predictor(unit, round(MEMORY / passes.step))
        left = _whiten(unit, predictor)
        return cls(
            mean=force.mean(axis=0),
            patterns=_patterns(force),
            size=size,
            predictor=predictor,
            white=float(left.std()),
            levels=np.array([_level(each / size, window) for each in residual]),
            scores=_windowed(left / left.std(), window)[:, passes.lead :],
            lead=passes.lead,
            window=window,
        )

    def score(self, passes: Passes, threshold: float) -> tuple[Evidence, Array]:
        """What passes show in the mean, and the level of each, (passes,) (N).

        What passes have in common that is not the line's, the error of the healthy mean, keeps its size in
        the mean of several: that is why the mean is levelled anew.
        """
        residual = np.array([_residual(each - self.mean, self.patterns, self.size) for each in passes.force])
        levels = np.array([_level(each / self.size, self.window) for each in residual])
        unit = (residual / levels[:, None]).mean(axis=0) / self.size
        left = _whiten(unit / _level(unit, self.window), self.predictor) / self.white
        score = _windowed(left, self.window)
        score[: self.lead] = 0.0
        evidence = Evidence(
            position=passes.position,
            residual=residual.mean(axis=0),
            score=score,
            threshold=threshold,
            alignment=passes.alignment,
            droppers=passes.droppers,
            speed=passes.speed,
            wave_speed=passes.wave_speed,
            level=float(levels.mean()),
        )
        return evidence, levels


def _against(force: Array, others: Array) -> Array:
    """Remainder of a healthy pass against others, as much as that of a pass that is none of all."""
    count = len(others)
    residual = _residual(force - others.mean(axis=0), _patterns(others), np.ones(len(force)))
    return np.asarray(residual * np.sqrt((1 + 1 / (count + 1)) / (1 + 1 / count)))


def _patterns(force: Array) -> Array:
    """The first principal components of passes, (patterns, places): half as many as there are passes."""
    _, _, along = np.linalg.svd(force - force.mean(axis=0), full_matrices=False)
    return np.asarray(along[: min(MOST_PATTERNS, len(force) // 2)])


def _residual(deviation: Array, patterns: Array, size: Array) -> Array:
    """A deviation (N) less what patterns explain of it; places far off hardly count (Huber's weights)."""
    weight, residual = np.ones(len(deviation)), deviation
    for _ in range(ROUNDS):
        weighted = patterns * weight / size**2
        share = np.linalg.lstsq(weighted @ patterns.T, weighted @ deviation, rcond=None)[0]
        residual = deviation - share @ patterns
        off = np.abs(residual) / size
        weight = np.minimum(1.0, FAR * 1.48 * np.median(off) / np.maximum(off, 1e-12))
    return residual


def _usual_size(residual: Array, passes: Passes) -> Array:
    """Rms of residuals, (passes, places), by place: here, weighted by the number of passes, and at the
    same place of all spans.
    """
    from scipy.ndimage import gaussian_filter1d  # slow to import

    energy, smooth = (residual**2).mean(axis=0), SMOOTHED / passes.step
    alike = gaussian_filter1d(energy.reshape(-1, passes.per_span).mean(axis=0), smooth, mode="wrap")
    here = gaussian_filter1d(energy, smooth, mode="nearest")
    share = len(residual) / (len(residual) + SPANS_COUNT_AS)
    return np.asarray(np.sqrt(share * here + (1 - share) * np.tile(alike, len(here) // passes.per_span)))


def _predictor(unit: Array, memory: int) -> Array:
    """Linear predictor of residuals, (passes, places), by their past: Yule-Walker's equations."""
    from scipy.linalg import solve_toeplitz  # slow to import

    places = unit.shape[1]
    lags = np.array([(unit[:, : places - k] * unit[:, k:]).mean() for k in range(memory + 1)])
    lags[0] *= 1 + FLOOR
    return np.asarray(solve_toeplitz(lags[:-1], lags[1:]))


def _whiten(unit: Array, predictor: Array) -> Array:
    from scipy.ndimage import convolve1d  # slow to import

    kernel = np.concatenate([np.zeros(len(predictor)), [1.0], -predictor])
    return np.asarray(convolve1d(unit, kernel, mode="constant"))


def _windowed(values: Array, window: int) -> Array:
    """Mean square in a window about each place."""
    from scipy.ndimage import uniform_filter1d  # slow to import

    return np.asarray(uniform_filter1d(values**2, window, mode="nearest"))


def _level(residual: Array, window: int) -> float:
    return float(np.sqrt(np.quantile(_windowed(residual, window), QUIET)))
