"""The spans that the figures of a run cover: first to last, both included (EN 50318 takes 5 and 6).

By default these are the spans after the start has died out and, where a sequence of spans ends, before its
end is felt. The line's alignment knows their positions.
"""

from __future__ import annotations

import warnings
from typing import Any, Literal, TypeAlias

from ..base.errors import AccuracyWarning, InputError, shortly
from ..plant.alignment import Alignment, Spans
from ..plant.catenary.schema import CLEAR, MOST_SPANS

SpanChoice: TypeAlias = Spans | Literal["all"] | None
"""The first and the last span, "all" for the whole run, or None for those after the start has died out."""
FIRST_SETTLED = 10
"""First span after the start has died out: the waves about the train need time to build up. What is missing
falls by about a fifth per span at any speed; docs/validation.md shows the remaining error."""
LAST_USUAL = 19
"""Default last span of a run, so that ten are evaluated."""


def check_spans(spans: Any) -> None:
    """Raise InputError unless spans are two whole numbers from 1 up, in order."""
    pair = tuple(spans) if isinstance(spans, list | tuple) else ()
    whole = len(pair) == 2 and all(isinstance(each, int) for each in pair)
    if not (whole and 1 <= pair[0] <= pair[1] <= MOST_SPANS):
        raise InputError(
            f"spans must be two whole numbers, first and last, counted from 1 to {MOST_SPANS}, not "
            f"{shortly(spans)}."
        )


def in_words(spans: Spans | None) -> str:
    """The spans in the form of the command line: "10-19", or "all" for the whole run."""
    return "all" if spans is None else f"{spans[0]}-{spans[1]}"


def chosen_spans(
    choice: SpanChoice, distance: float, alignment: Alignment, ends: bool = False
) -> Spans | None:
    """First and last span of a choice, for a run of this distance (m); None for the whole run.

    ends: whether the line ends with its last span, whose anchor reflects waves: by default the spans in which
    the train meets these are left out, or, where no others are left, are evaluated with a warning. Raises
    InputError for an invalid choice, or where the run ends before its start has died out.
    """
    if choice == "all":
        return None
    if choice is not None:
        check_spans(choice)
        return choice
    settled = settled_spans(distance, alignment, ends)
    if settled is None:
        raise InputError(
            f"A run of {distance:g} m ends before its start has died out, which takes "
            f"{FIRST_SETTLED - 1} spans ({alignment.support(FIRST_SETTLED - 1):g} m); run further, or give "
            'the spans to evaluate, such as (5, 6), or "all".'
        )
    if not ends or alignment.spans - CLEAR >= FIRST_SETTLED:
        return settled
    warnings.warn(
        f"The line has only {alignment.spans} spans: in the last {CLEAR} its end reflects waves, which "
        "change the standard deviation by 1 to 5 %, maximum and minimum by 12 % of the mean force and more; "
        f"give the line {FIRST_SETTLED + CLEAR} spans or more, or give the spans to evaluate.",
        AccuracyWarning,
        stacklevel=3,
    )
    return settled


def settled_spans(distance: float, alignment: Alignment, ends: bool) -> Spans | None:
    """First and last default span of a run, as ``chosen_spans`` takes them; None where it is too short."""
    last = alignment.last_whole_span(distance, tolerance=1e-9)
    if last < FIRST_SETTLED:
        return None
    undisturbed = alignment.spans - CLEAR if ends else last
    return FIRST_SETTLED, min(last, undisturbed) if undisturbed >= FIRST_SETTLED else last
