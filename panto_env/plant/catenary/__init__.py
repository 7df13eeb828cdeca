"""The catenaries: one folder per kind, with what it is made of, how it is built, and its step.

A new kind is a module with a schema, a ``CatenaryModel`` and its sources of the operations of ``protocol``,
and a line in ``CATENARIES``.
"""

from __future__ import annotations

from .flexible import FlexibleCatenary, FlexibleCatenaryData
from .periodic_stiffness import PeriodicStiffness, PeriodicStiffnessData
from .protocol import CatenaryKind, CatenaryModel
from .schema import CatenaryData
from .three_span import ThreeSpan, ThreeSpanData

__all__ = ["CATENARIES", "CatenaryData", "CatenaryKind", "CatenaryModel"]

CATENARIES: dict[str, CatenaryKind] = {
    "flexible": CatenaryKind(FlexibleCatenaryData, FlexibleCatenary),
    "three_span": CatenaryKind(ThreeSpanData, ThreeSpan),
    "periodic_stiffness": CatenaryKind(PeriodicStiffnessData, PeriodicStiffness),
}
"""Kinds by the word that a line's TOML file has under ``kind``."""
