"""Why a fit is less sure than it says."""

from __future__ import annotations

from .fit import WHITE, Fit

STRANGE = 0.3
"""Share of a force that is left, by standard deviation, from which on the fit is called wrong. Own choice."""


def doubts(fit: Fit) -> list[str]:
    """Sentences on what makes the values of a fit, or their intervals, wrong or less reliable."""
    found = [*fit.problem.of_records, *fit.problem.notes]
    strange = [
        part.name
        for part, (before, after) in zip(fit.parts, fit.left, strict=True)
        if after > STRANGE * before
    ]
    if strange:
        found.append(
            f"The fit explains little of {', '.join(strange)}: it may be of another line or pantograph, or "
            "its positions may be wrong by half a span or more; the values mean nothing then."
        )
    unlike = [
        part.name for part, white in zip(fit.parts, fit.whiteness, strict=True) if white.probability < WHITE
    ]
    if unlike:
        found.append(
            f"What is left of {', '.join(unlike)} is not like noise: the model lacks something there, and "
            "intervals are too narrow."
        )
    if not fit.solution.settled:
        found.append("The fit has not settled; intervals are not to be relied on.")
    return found
