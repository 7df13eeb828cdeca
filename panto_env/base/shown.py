"""Values as messages show them: of any size and kind, also those that Python can't write."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Callable
from typing import Any

LONGEST = 300
"""Letters of a value, or of a word, that is shown whole."""
LONGEST_LINE = 1000
"""Letters of a message that is told whole: what a user gave may be a whole file."""
_WORD = re.compile(r"\S+|\s+")
_CONTROLS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""What tells a terminal to do something, or turns the direction of writing; line ends are none of it."""


def shown(value: Any) -> str:
    """A value as Python writes it, whole unless it is very long."""
    return _cut(_written(repr, value), LONGEST)


def one_line(text: str) -> str:
    """A text that may quote anything, with its line ends and other controls escaped and long words cut."""
    line = "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)
    return _cut(_WORD.sub(lambda word: _cut(word[0], LONGEST), line), LONGEST_LINE)


def harmless(text: str) -> str:
    """A text in which a file that may be anyone's has no control over the terminal: they are escaped."""
    return _CONTROLS.sub(lambda control: repr(control[0])[1:-1], text)


def shortly(value: Any) -> str:
    """A value as Python writes it, shortened to some 30 letters."""
    return _written(reprlib.repr, value)


def _cut(text: str, longest: int) -> str:
    """A text whose middle is left out where it is very long."""
    return text if len(text) <= longest else f"{text[: longest // 2]}...{text[-longest // 3 :]}"


def _written(write: Callable[[Any], str], value: Any) -> str:
    try:
        return write(value)
    except Exception:  # a number of thousands of digits, or an object of anyone's
        return f"a value of type {type(value).__name__} that cannot be shown"
