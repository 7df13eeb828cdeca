"""Names and values in one line, such as ``gain=0.5,places=[(4, 5)]``, for policies and presets."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

from .errors import InputError

TRUTH = {"true": True, "false": False}
"""As TOML writes them; Python's own are literals."""
OPENING, CLOSING, QUOTES = "([{", ")]}", "'\""


def parse_inline(text: str) -> dict[str, Any]:
    """Values by name from "name=value,name=value"; a value is a Python literal, true or false, or else
    a word.

    Commas within brackets and quotes belong to a value. Raises InputError where a part has no "=", or a
    name occurs twice.
    """
    values: dict[str, Any] = {}
    for part in filter(None, map(str.strip, _parts(text))):
        key, equals, value = part.partition("=")
        name = key.strip()
        if not (equals and name):
            raise InputError(f"'{part}' must read name=value.")
        if name in values:
            raise InputError(f"'{name}' is given twice.")
        word = value.strip()
        if word in TRUTH:
            values[name] = TRUTH[word]
            continue
        try:
            values[name] = ast.literal_eval(word)
        except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):  # not a literal
            values[name] = word
    return values


def _parts(text: str) -> Iterator[str]:
    """Parts between commas outside brackets and quotes."""
    depth, quote, begin = 0, "", 0
    for place, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in QUOTES:
            quote = letter
        elif letter == "," and depth <= 0:
            yield text[begin:place]
            begin = place + 1
        else:
            depth += (letter in OPENING) - (letter in CLOSING)
    yield text[begin:]
