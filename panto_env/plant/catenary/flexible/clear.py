"""How much line a pass needs beyond its end, by the wires' tension and ice: waves are faster in the cold."""

from __future__ import annotations

from ...numerics import Numerics, Runs
from . import window
from .fixed_wires import tensions_of_fixed
from .parts import Conductor
from .schema import FlexibleCatenaryData
from .stitches import stitched
from .tension import with_tension_left


def clear_spans(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs, last: int) -> int:
    """As ``CatenaryKind.clear_spans``; a whole line needs more of them for a slower train."""
    return window.clear_spans(_wires_in(data, runs), numerics, runs, last, stitched(data))


def warn_if_short(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs) -> None:
    """As ``CatenaryKind.warn_if_short``."""
    wires = _wires_in(data, runs)
    window.warn_if_short(wires, numerics, runs)
    if stitched(data) and numerics.accuracy == "full" and numerics.window is None:
        window.warn_if_slow(wires, runs)


def _wires_in(data: FlexibleCatenaryData, runs: Runs) -> tuple[Conductor, Conductor]:
    """The wires with their tension and ice in these runs."""
    condition = runs.conditions[0]
    if not (condition.temperature or condition.ice):
        return data.wires
    return with_tension_left(data, condition, tensions_of_fixed(data, condition)).wires
