"""Misspelt names: the nearest known name, as a clause for an error message."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence


def suggest(name: str, known: Sequence[str]) -> str:
    """A clause with the nearest known name, if any is near, and all of them."""
    return f"{hint(name, known)}known are {', '.join(known)}"


def listed(names: Sequence[str]) -> str:
    """Names as a clause that says what they are: "A, which is", or "A, B and C, which are"."""
    *others, last = names
    return f"{', '.join(others)} and {last}, which are" if others else f"{last}, which is"


def hint(name: str, known: Sequence[str]) -> str:
    """A question that names the nearest known name, or nothing if none is near."""
    near = nearest(name, known)
    return "" if near is None else f"did you mean {near}? "


def nearest(name: str, known: Sequence[str]) -> str | None:
    """The known name nearest to a misspelt one, or "'force_limit' or 'rate_limit'" for a word of several."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
    near = near or [each for each in known if name in re.split("[_-]", each)][:3]
    near = near or difflib.get_close_matches(name, known, n=1)
    return " or ".join(f"'{each}'" for each in near) or None
