"""What ``panto diagnose`` says of later passes over lines that were fitted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from panto_env.diagnosis import diagnose_records
from panto_env.fitting.fit import Fit
from panto_env.fitting.stored import knowledge
from panto_env.plant.line_condition import LINE_CONDITIONS
from panto_env.records.record import Record

SPEED = 235.0
"""Of later passes (km/h on the uniform line), at which nothing was fitted."""
LOST = 0.01
"""Share of the contact wire's tension that is lost."""
LATER = (
    "healthy, called so",
    "broken dropper, found in its place",
    "1 % of tension lost, line called changed",
)


def later(fit: Fit, passes: Callable[..., list[Record]], seed: int) -> dict[str, bool]:
    """Whether each of three later passes is diagnosed as what it is: over the line as it was, with one broken
    dropper, and with less tension.

    passes: records over the line of the fit, as ``coverage.records_of`` takes its last arguments. seed: of
    which dropper is broken, of the middle half of those compared.
    """
    known, built = knowledge(fit, "earlier"), LINE_CONDITIONS["as-built"]
    droppers = fit.of_kind("droppers")
    value = droppers[int(len(droppers) * np.random.default_rng(seed).uniform(0.25, 0.75))].value
    _, number, _, _, span = value.name.split()
    broken = built.model_copy(update={"broken_droppers": ((int(span), int(number)),)})
    slack = built.model_copy(update={"lost_contact_tension": LOST})
    healthy, other, changed = (
        diagnose_records(passes(condition=condition, speeds=(SPEED,), visit=visit), known)
        for visit, condition in enumerate((built, broken, slack), start=1)
    )
    places = [(each.kind, each.span, each.dropper) for each in other.findings]
    found = healthy.healthy, ("broken dropper", int(span), int(number)) in places, changed.changed
    return dict(zip(LATER, found, strict=True))
