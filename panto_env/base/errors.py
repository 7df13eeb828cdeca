"""The error for invalid input of any kind, and warnings about accuracy, unusual values and plug-ins."""

from __future__ import annotations

import difflib
import re
import reprlib
from collections.abc import Sequence
from typing import Any


class InputError(ValueError):
    """Invalid input (action, argument or file): one sentence that says what is wrong and what to do."""

    def __init__(self, message: str = "") -> None:
        """message: printable in one line, whatever it quotes, such as a damaged file or a broken name."""
        super().__init__(one_line(message))


class AccuracyWarning(UserWarning):
    """Figures are less accurate than usual: one sentence that says why and by how much."""


class PlugInWarning(UserWarning):
    """A plug-in of another package is left out: one sentence that says which one and why."""


class UnusualWarning(UserWarning):
    """A value is valid but far from any usual one, as a wrong unit or sign makes it: one sentence."""


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


LONGEST = 300
"""Maximum letters of a value that is shown whole."""
LONGEST_LINE = 1000
"""Maximum letters of a message that is shown whole: an input may be a whole file."""
shortly = reprlib.repr
"""A value as Python writes it, shortened to about 30 letters."""


def beside(value: float, limit: float, form: str) -> str:
    """A value beside a limit that it is compared with, in a format such as "+.1f" or ".3g".

    It has as many more digits as it takes to stand on its side of the limit: a value of 1.504 % is not shown
    as 1.5 %, more than 1.5 %. limit: as it is shown.
    """
    sign, digits, kind = re.fullmatch(r"([+,]*)\.(\d+)([fg])", form).groups()  # type: ignore[union-attr]
    for more in range(18):
        text = format(value, f"{sign}.{int(digits) + more}{kind}")
        rounded = float(text.replace(",", ""))
        if (rounded > limit, rounded < limit) == (value > limit, value < limit):
            return text
    return str(value)


def shown(value: Any) -> str:
    """A value as Python writes it, whole unless it is very long."""
    return _cut(repr(value), LONGEST)


def one_line(text: str) -> str:
    """A text that may quote anything, with its line ends and other controls escaped, not too long."""
    line = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)
    return _cut(line, LONGEST_LINE)


def _cut(text: str, longest: int) -> str:
    """A text whose middle is left out where it is very long."""
    return text if len(text) <= longest else f"{text[: longest // 2]}...{text[-longest // 3 :]}"
