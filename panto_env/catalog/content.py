"""Identity of a line or a pantograph by its values: files of one name may hold different ones."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from ..base.checksums import remembered
from ..plant.catenary import CatenaryData
from ..plant.pantograph.schema import PantographData
from .loader import available, load_catenary, load_pantograph

WORDS = ("name", "description", "sources", "published")
"""Keys that say nothing of the values."""


@remembered
def content_of(entry: CatenaryData | PantographData) -> str:
    """SHA-256 of a line's or a pantograph's values, in hexadecimal.

    Values at their defaults are left out, so that a key that is added later changes nothing.
    """
    # By its own class, not a base's; a rig holds a line.
    values = _without_words(entry.model_dump(mode="json", exclude_defaults=True, serialize_as_any=True))
    return hashlib.sha256(json.dumps([type(entry).__name__, values], sort_keys=True).encode()).hexdigest()


def content_unless_catalogue(entry: CatenaryData | PantographData) -> str | None:
    """``content_of`` an entry, or None where the catalogue has it by its name, with the same values."""
    found = content_of(entry)
    return None if _content_in_catalogue(entry, entry.name) == found else found


def is_entry(entry: CatenaryData | PantographData, name: str, content: str | None) -> bool:
    """Whether a line or a pantograph is the one stored by its name and ``content_unless_catalogue``."""
    known = _content_in_catalogue(entry, name) if content is None else content
    return known == content_of(entry)  # None where it was a file's: there is nothing to know its values by


def _content_in_catalogue(entry: CatenaryData | PantographData, name: str) -> str | None:
    """``content_of`` the catalogue's entry of a name, of the kind of ``entry``; None where it has none."""
    line = isinstance(entry, CatenaryData)
    if name not in available("catenary" if line else "pantograph"):
        return None
    return content_of(load_catenary(name) if line else load_pantograph(name))


def _without_words(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: _without_words(value) for key, value in values.items() if key not in WORDS}
    return values
