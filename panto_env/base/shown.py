"""Values as messages show them: of any size and kind, also those that Python can't write."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from typing import Any

LONGEST = 300
"""Letters of a value that is shown whole."""


def shown(value: Any) -> str:
    """A value as Python writes it, whole unless it is very long."""
    text = _written(repr, value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]}...{text[-LONGEST // 3 :]}"


def shortly(value: Any) -> str:
    """A value as Python writes it, shortened to some 30 letters."""
    return _written(reprlib.repr, value)


def _written(write: Callable[[Any], str], value: Any) -> str:
    try:
        return write(value)
    except Exception:  # a number of thousands of digits, or an object of anyone's
        return f"a value of type {type(value).__name__} that cannot be shown"
