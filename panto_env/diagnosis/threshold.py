"""The score from which on a place is called defective: by false alarms per kilometre.

The maximum log score of a span is taken to have Gumbel's distribution, the limit of maxima of many values.
It is fitted to the spans of healthy passes, each held against the others, and reaches to spans rarer than any
of them. Where passes are few, another one may differ by more than they do from one another.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.arrays import Array

FALSE_ALARMS = 0.1
"""Per kilometre: one in 10 km."""
ENOUGH = 100
"""Healthy spans for a threshold whose false alarms are right within a factor of about two."""


def threshold(scores: Array, per_span: int, span: float, false_alarms: float = FALSE_ALARMS) -> float:
    """Score that healthy lines exceed so many times per kilometre.

    scores: (passes, places) of healthy passes; per_span: places in a span; span: its length (m).
    """
    from scipy.stats import gumbel_r  # slow to import

    maxima = np.log(scores.reshape(-1, per_span).max(axis=1))
    place, scale = gumbel_r.fit(maxima)
    return float(np.exp(gumbel_r.isf(_in_a_span(false_alarms, span), place, scale)))


def cautious_threshold(
    scores: Array, per_span: int, span: float, false_alarms: float = FALSE_ALARMS
) -> float:
    """As ``threshold``, but for a further pass: beyond the mean by more, the fewer the healthy passes are.

    Spans of one pass are alike, as its pantograph is: that part of the spread which lies between passes is
    known from no more values than there are passes. It counts for more as in a prediction interval, by
    Student's t over the normal quantile (a textbook's, recalled); the rest, from span to span, does not.
    """
    from scipy.stats import norm, t  # slow to import

    maxima = np.log(scores.reshape(len(scores), -1, per_span).max(axis=2))
    passes, middle = len(maxima), float(maxima.mean())
    exceeded = _in_a_span(false_alarms, span)
    longer = t.isf(exceeded, passes - 1) / norm.isf(exceeded) * math.sqrt(1 + 1 / passes)
    between = min(1.0, float(maxima.mean(axis=1).var(ddof=1) / maxima.var()))
    way = math.log(threshold(scores, per_span, span, false_alarms)) - middle
    return math.exp(middle + way * math.sqrt(1 + between * (max(1.0, longer) ** 2 - 1)))


def _in_a_span(false_alarms: float, span: float) -> float:
    """Probability of an alarm in a span (m), where so many per kilometre are Poisson's."""
    return -math.expm1(-false_alarms * span / 1e3)
