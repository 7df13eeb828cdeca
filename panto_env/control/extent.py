"""Distance of a run, spans of its line, and the plant that is built for it."""

from __future__ import annotations

import math
from functools import partial

from ..base.errors import InputError, beside
from ..plant.catenary import CATENARIES
from ..plant.catenary.schema import MOST_SPANS
from ..plant.plant import Plant
from .cost import FEW_LANES, check_lanes
from .settings import RunSettings


def spans(settings: RunSettings) -> int | None:
    """Number of spans: as given, or as many as the distance needs, at least the line's own; None: its own."""
    line = settings.line
    if settings.spans is not None or settings.distance is None:
        more = 0 if line.ends else math.ceil(settings.settle)
        return line.spans + more if settings.spans is None and more else settings.spans
    before = settings.run_in + settings.settle
    last: int = math.ceil(line.alignment().in_spans(settings.distance + settings.train.length) + before)
    most, clear = (line.spans, 0) if line.ends else (MOST_SPANS, 1)  # a train may run up to a line's end
    if not line.ends and last >= line.spans:
        clear = CATENARIES[line.kind].clear_spans(line, settings.numerics, settings.runs, last)
    needed = last + clear
    if needed > most:
        longest = line.alignment().support(max(math.floor(most - clear - before), 0))
        behind = f", behind {before:g} spans before the run," if before else ""
        raise InputError(
            f"distance must be at most {longest:,g} m on line '{line.name}'{behind} not "
            f"{beside(settings.distance, longest, ',.6g')} m."
        )
    return max(line.spans, needed)


def whole_steps(control_interval: float, time_step: float) -> int:
    """Time steps in a control interval. Raises InputError where that is not a whole number."""
    steps = round(control_interval / time_step)
    if steps < 1 or abs(steps * time_step - control_interval) > 1e-9:
        raise InputError(
            f"control_interval must be a whole number of time steps of {1e3 * time_step:g} ms, "
            f"not {1e3 * control_interval:g} ms."
        )
    return steps


def new_plant(settings: RunSettings, lanes: int) -> Plant:
    """The plant of a run with a number of lanes. Raises InputError where they do not fit into memory."""
    make_plant = partial(
        Plant,
        settings.line,
        settings.train,
        spans=spans(settings),
        numerics=settings.numerics,
        runs=settings.runs,
        bilateral=settings.bilateral,
        varied=settings.pantograph_scatter > 0,
        drifting=settings.speed_drift > 0,
    )
    if lanes > FEW_LANES:
        check_lanes(lanes, FEW_LANES, make_plant(lanes=FEW_LANES).arrays)
    return make_plant(lanes=lanes)
