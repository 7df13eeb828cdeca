"""Misspelt names: the nearest known names, as a clause for an error message."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence

MISSPELT = 0.8
"""Similarity from which a name is taken as a known one with a wrong letter, and not as a part of others."""


def suggest(name: str, known: Sequence[str]) -> str:
    """A clause with the nearest known names, if any are near, and all of them."""
    return f"{hint(name, known)}known are {', '.join(known)}"


def listed(names: Sequence[str]) -> str:
    """Names as a clause that says what they are: "A, which is", or "A, B and C, which are"."""
    *others, last = names
    return f"{', '.join(others)} and {last}, which are" if others else f"{last}, which is"


def hint(name: str, known: Sequence[str]) -> str:
    """A question that names the nearest known names, or nothing if none is near."""
    near = near_names(name, known)
    return f"did you mean {near}? " if near else ""


def near_names(name: str, known: Sequence[str]) -> str:
    """The known names that a wrong one may stand for, as "'force_limit' or 'rate_limit'"; "" for none.

    These are one that differs by a letter or two, those of which it is a word, or the most similar one.
    """
    near = difflib.get_close_matches(name, known, n=1, cutoff=MISSPELT)
    near = near or [each for each in known if _words(name) < _words(each)][:3]
    near = near or difflib.get_close_matches(name, known, n=1)
    return " or ".join(f"'{each}'" for each in near)


def _words(name: str) -> set[str]:
    return set(re.split(r"[^a-z0-9]+", name.lower()))
