"""Grid, time step and window of a flexible catenary: fine enough for the runs that it is built for.

A step is given by the speed as a share of the wave speed, and the grid is the finest that is stable with it:
near that limit waves of all lengths travel as on the wire. A coarse grid fails in two ways: the waves ahead
of a train are short (``grid.wave_ahead``), and a slow train passes a node every dx / v, with a ripple of the
force that the 20 Hz filter removes only while it is short. docs/validation.md compares the figures at every
speed, on every line, with converged ones.

What a line sends back from beyond the window is missing. Waves come back from the farther, the slower the
train is, and first along the faster wire, whose wave speed decides how many spans are enough. A whole line is
long enough if the train meets no wave from its far anchor before its pass ends.
"""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from ....backend import WIDTH
from ....base.arrays import to_kmh
from ....base.checksums import remembered
from ....base.errors import AccuracyWarning, InputError
from ...line_condition import ON_WIRE
from ...numerics import SAMPLES_PER_WAVE, Numerics, Runs
from ...pantograph.schema import HARD_DAMPING, HARD_STIFFNESS
from ..schema import CLEAR, MOST_SPANS, Wire
from .defects import with_tension_left
from .fixed_wires import tensions_of_fixed
from .grid import carrying_grid, finest_stable, nodes_per_span, stable
from .plan import pulled_arms
from .schema import FlexibleCatenaryData

STEPS = ((0.2, 1e-2 / 14), (0.45, 1e-2 / 8), (0.7, 1e-2 / 6), (0.86, 1e-2 / 8), (1.0, 1e-2 / 14))
"""Up to a share of the wave speed: a time step (s) that is short enough for one pantograph."""
STEPS_OF_TRAINS = ((0.2, 1e-2 / 14), (0.7, 1e-2 / 8), (0.86, 1e-2 / 12), (1.0, 1e-2 / 16))
"""The same for several, the second of which loses contact earlier."""
MARGINS = ((0.2, 1.6), (0.3, 1.3), (1.0, 1.06))
"""Up to a share of the wave speed: on its grid a step is stable that is so many times as long, and the finest
such grid is taken. Near their limit waves of all lengths travel on a grid as on the wire. Under a slow train
sigma is a few newtons, and near the limit it was wrong by up to 3 %."""
PER_DAMPING, MOST_DAMPED = 1.6, 2.0
"""Such a margin is at least 1 + this times beta / step, up to a maximum: damping acts a step late, and near
the limit of a line damped five times as much as usual the maximum was wrong by 4 % of the mean force."""
FINE = ((0.45, 0.3), (1.0, 0.2))
"""Up to a share of the wave speed: a grid (m) that is fine enough for shorter steps too."""
COARSEST = 0.45  # maximum grid (m)
NODES_HZ = 27.0
"""Minimum rate at which a train passes nodes (Hz): well above the 20 Hz to which forces are filtered."""
SLOWEST_HZ = 22.0  # rate of nodes (Hz) below which their ripple is in the filtered force
FINEST_GRID = 0.1  # grid (m) for the slowest trains, and the finest one that is taken for any
REACH = 1.2  # up to this multiple of the grid that carries the waves ahead, figures were within their bounds
NOT_CARRIED = (5, 4)
"""Errors beyond it, on the finest grid: of the standard deviation, maximum and minimum (%), and of the
contact-loss ratio (points)."""
LIMP, LIMP_STEP = 0.2, 0.6e-3
"""Grid (m) and time step (s) for a contact wire without bending stiffness, which kinks within a cell."""
LIMP_NODES = 0.2  # nodes to which a kink of another wire, sqrt(EI / T) wide, must spread
HARD_CONTACT_GRID = 0.15  # grid (m) for a hard contact
HARD_CONTACT_ERROR = 20
"""Error of the standard deviation (%) where a hard contact is lost, on ``HARD_CONTACT_GRID``."""
HARD_CONTACT_MEAN_ERROR = 5
"""Error of the mean (%) there, over a few spans: where contact is lost for half of the time, the bounces come
in a different order on a different grid."""
HARD_CONTACT_ON_CLAMPS = 1.25e-4
"""Time step (s) for a hard contact on clamps heavier than ``HEAVY_CLAMP``: with twice the step sigma was 24 %
wrong where contact is lost most of the time."""
HARD_CONTACT_STEP = 0.5
"""Longest step, of the time in which the wire's mass at a node swings by a radian on a hard contact: with 0.8
a contact of 1 MN/m chattered, and the standard deviation was four times too large."""
HARD_SPOT_GRID = 0.3
"""Grid (m) for a lumped mass on the wire, which throws the head off: on 0.4 m it lands at another place, and
the force over the spot was wrong by a tenth of what the spot does to it, here by a fiftieth."""
DEEP = 0.5e-3  # depth of wear waves (m) above which the grid must resolve the waves that they excite
SAMPLES_PER_SHALLOW_WAVE = 4
"""Time steps in which a train passes the shortest wave of the wire, unless wear waves are deep."""
DEEP_GRID = 0.125  # finest grid (m) for them, unless clamps are heavy
NODES_PER_WAVE = 4
"""Nodes per wave that runs ahead of the train at the rate at which it passes deep wear waves. With two, the
contact loss at every wear wave was wrong by up to 6 points of 29."""
CLAMPS = (
    (0.12, np.inf, np.inf),
    (0.25, np.inf, 1e-3),
    (0.5, 0.16, 8e-4),
    (1.0, 0.14, 7e-4),
    (np.inf, 0.1, 2.5e-4),
)
"""Up to a mass of a clamp (kg), which hangs on two nodes: a grid (m) that is fine enough, a time step (s)
that is short enough."""
HEAVY_CLAMP = 1.0
"""Mass of a clamp on the contact wire (kg) above which deep wear waves need the finest grid, and a hard
contact a shorter step."""
STITCHED_GRIDS = ((0.12, 0.12), (0.65, 0.25), (np.inf, 0.17))
"""Up to a share of the wave speed: a grid (m) that is fine enough for stitch wires. The messenger's tension
jumps at their clamps, between nodes; on 0.33 m sigma was wrong by 1.2 %, above 65 % on 0.25 m the maximum by
3 % of the mean force."""
TRAIN_ON_UNLIKE_SPANS = 0.2, 1e-2 / 16
"""Grid (m) and time step (s) for several pantographs where spans differ in length: on 0.36 m the maximum of
the second one was wrong by up to 4 % of the mean force, of the first one by 3 %, where contact is lost."""
FAST_GRIDS = ((0.6, 0.5), (0.72, 0.4), (1.0, 1 / 3))
"""Up to a share of the wave speed: the grid (m) for ``accuracy="fast"``."""
FAST_NODES_HZ = 40.0  # minimum rate at which a train passes nodes for ``accuracy="fast"`` (Hz)
FAST_STEPS = (2.5e-3, 2e-3)
"""Time steps (s) for ``accuracy="fast"``: the longer one where it is stable on the grid, else the shorter
one, on a coarser grid if necessary."""
FAST_SAMPLES_PER_WAVE = 3


class Resolution(NamedTuple):
    """Discretisation of a line; the coarsest one that is fine enough, where one is required."""

    spacing: float  # of the grid (m)
    time_step: float  # s
    window: int = 0  # spans computed about the train; 0: the whole line


def resolution(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs) -> Resolution:
    """Grid, time step and window: the given ones, or those for the accuracy, stable together.

    Warns where they are coarser than required for figures within the bounds that ``fine_enough`` states, and
    where no default is fine enough. Raises InputError where grid and step are not stable together, or waves
    of the wire are too short for the step.
    """
    found, cautions = _chosen(data, numerics, runs)
    for caution in cautions:
        warnings.warn(caution, AccuracyWarning, stacklevel=2)
    return found


@remembered
def _chosen(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs) -> tuple[Resolution, tuple[str, ...]]:
    fast, cautions = numerics.accuracy == "fast", list[str]()
    required = _fast(data, runs) if fast else fine_enough(data, runs, numerics.time_step)
    found = _stable(data, numerics, runs, required)
    runs.check_wave(found.time_step)
    if not fast:
        cautions += _coarse(data, found, required, runs)
    if runs.hard_contact:
        cautions.append(
            f"A contact stiffer than {HARD_STIFFNESS / 1e3:g} kN/m, or more damped than {HARD_DAMPING:g} "
            f"N s/m, excites waves too short for a grid of {found.spacing:.3g} m: where contact is "
            f"lost, the mean may be wrong by up to about {HARD_CONTACT_MEAN_ERROR} %, the standard deviation "
            f"by {HARD_CONTACT_ERROR} %, and the contact-loss ratio may be several times too large; compare "
            "with half the spacing."
        )
    passed = runs.speeds[0] / found.spacing
    if passed < SLOWEST_HZ:
        cautions.append(
            f"At {to_kmh(runs.speeds[0]):.3g} km/h a train passes {passed:.2g} nodes per second of a grid of "
            f"{found.spacing:.3g} m: the contact force has a numerical ripple of about 1 N at this rate."
        )
    return found, tuple(cautions)


def fine_enough(data: FlexibleCatenaryData, runs: Runs, time_step: float | None = None) -> Resolution:
    """The coarsest grid and the longest step, stable or not, that give figures within these bounds.

    time_step: the given one (s), if any, on whose grid the figures are. Beside a grid of 0.06 to 0.1 m sigma,
    maximum and minimum, of the mean force, were within 1 % in 95 % of 335 runs of all kinds up to 95 % of the
    wave speed, and in all within 3 % (``panto validate --lines``, docs/validation.md). Beyond 1 % were mostly
    runs that lose contact, above 70 % of the wave speed or with heavy clamps.
    """
    slow, quick = runs.speeds
    wave_speed = data.contact_wire.wave_speed
    steps = STEPS_OF_TRAINS if runs.train_length else STEPS
    longest = min(_by_share(steps, speed, wave_speed) for speed in runs.speeds)
    spacing = max(slow / NODES_HZ, FINEST_GRID)
    deep = [each.wear_wavelength for each in runs.conditions if each.wear_depth > DEEP]
    if deep:
        ahead = min(deep) * (wave_speed - quick) / quick
        spacing = min(spacing, max(ahead / NODES_PER_WAVE, DEEP_GRID))
        if _heavy(data):
            spacing = min(spacing, FINEST_GRID)
    if runs.hard_contact:
        spacing = min(spacing, HARD_CONTACT_GRID)
        longest = min(longest, HARD_CONTACT_ON_CLAMPS) if _heavy(data) else longest
        swing = math.sqrt(data.contact_wire.mass * spacing / runs.hard_contact)
        longest = min(longest, HARD_CONTACT_STEP * swing)
    if any(each.hard_spots or each.surface_bumps for each in runs.conditions):
        spacing = min(spacing, HARD_SPOT_GRID)
    kink = math.sqrt(data.contact_wire.bending_stiffness / data.contact_wire.tension)
    spacing = min(spacing, max(kink / LIMP_NODES, LIMP))
    if kink / LIMP_NODES < FINEST_GRID:
        longest = min(longest, LIMP_STEP)
    spacing = min(spacing, max(carrying_grid(data, quick), FINEST_GRID))
    if data.layout().stitched:
        spacing = min(spacing, _by_share(STITCHED_GRIDS, quick, wave_speed))
    needed = [_by_clamps(data)]
    if runs.train_length and data.sequence and np.ptp(data.alignment().lengths) > 0:
        needed.append(TRAIN_ON_UNLIKE_SPANS)
    for grid, step in needed:
        spacing, longest = min(spacing, grid), min(longest, step)
    samples = SAMPLES_PER_WAVE if deep else SAMPLES_PER_SHALLOW_WAVE
    longest = min(longest, runs.wave_step(samples))
    step = min(time_step or longest, runs.whole_part(longest))
    near_limit = finest_stable(data.wires, data.damping.beta, data.stride, _margin(data, runs, step) * step)
    fine = _by_share(FINE, quick, wave_speed)
    return Resolution(min(spacing, max(near_limit, fine), COARSEST), longest)


def _by_share(table: tuple[tuple[float, float], ...], speed: float, wave_speed: float) -> float:
    """Value of a table by shares of the wave speed; beyond the largest share, the last one."""
    return next((value for share, value in table if speed <= share * wave_speed), table[-1][1])


def _margin(data: FlexibleCatenaryData, runs: Runs, step: float) -> float:
    """How many times as long a step must be stable on the grid of this one (s)."""
    slow, quick = (speed / data.contact_wire.wave_speed for speed in runs.speeds)
    margin = _by_share(MARGINS, quick, 1.0)
    if slow <= MARGINS[1][0]:
        margin = max(margin, MARGINS[1][1])
    return max(margin, min(1 + PER_DAMPING * data.damping.beta / step, MOST_DAMPED))


def _heavy(data: FlexibleCatenaryData) -> bool:
    """Whether a clamp on the contact wire is a heavy one."""
    return any(span.droppers.contact_clamp_mass > HEAVY_CLAMP for span in data.layout(1).spans)


def _by_clamps(data: FlexibleCatenaryData) -> tuple[float, float]:
    """Grid (m) and time step (s) that the heaviest of the droppers' clamps requires."""
    droppers = [span.droppers for span in data.layout(1).spans]
    heaviest = max(max(each.contact_clamp_mass, each.messenger_clamp_mass) for each in droppers)
    return next((grid, step) for mass, grid, step in CLAMPS if heaviest <= mass)


def _fast(data: FlexibleCatenaryData, runs: Runs) -> Resolution:
    (longer, shorter), (slow, quick) = FAST_STEPS, runs.speeds
    spacing = _by_share(FAST_GRIDS, quick, data.contact_wire.wave_speed)
    spacing = min(spacing, max(slow / FAST_NODES_HZ, FINEST_GRID))
    if np.isfinite(runs.shortest_wave):
        spacing = min(spacing, FAST_GRIDS[-1][1])
    spacing = min(spacing, 2 * _by_clamps(data)[0])
    grid = data.stride / nodes_per_span(data, spacing)
    step = longer if stable(data, grid, longer, _lightest(runs)) else shorter
    return Resolution(spacing, min(step, runs.wave_step(FAST_SAMPLES_PER_WAVE)))


def _lightest(runs: Runs) -> float:
    worn = [share for condition in runs.conditions for *_, share in condition.worn_stretches]
    return 1 - max(worn, default=0.0)


def _stable(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs, required: Resolution) -> Resolution:
    """A stable resolution, with a whole number of nodes per span and of steps per control interval."""
    span, given = data.stride, numerics.spacing
    lightest, window = _lightest(runs), window_of(data, numerics, runs)
    window = window and window + spans_of_train(data, runs)
    finest = nodes_per_span(data, given or required.spacing)
    if numerics.time_step is None and (given is not None or numerics.accuracy == "full"):
        step = runs.whole_part(required.time_step)
        while not stable(data, span / finest, step, lightest):
            step = runs.whole_part(0.95 * step)
        return Resolution(span / finest, step, window)
    step = numerics.time_step or runs.whole_part(required.time_step)
    if given is not None and not stable(data, span / finest, step, lightest):
        raise InputError(
            f"A time step of {1e3 * step:g} ms is unstable on a grid of {span / finest:g} m "
            f"for line '{data.name}'; take a shorter step or a coarser grid."
        )
    for count in range(finest, 2 * WIDTH - 1, -WIDTH):
        if stable(data, span / count, step, lightest):
            return Resolution(span / count, step, window)
    raise InputError(f"A time step of {1e3 * step:g} ms is too long for line '{data.name}' on any grid.")


def spans_of_train(data: FlexibleCatenaryData, runs: Runs) -> int:
    """Spans by which the window is longer than one pantograph needs."""
    return math.ceil(runs.train_length / data.stride)


def _coarse(data: FlexibleCatenaryData, found: Resolution, required: Resolution, runs: Runs) -> list[str]:
    """What a grid or step means that is coarser than required, or that carries no waves ahead of a train.

    The expected error, from 1 % on, is of third order in the grid and of second order in the step.
    """
    grid, step = found.spacing / required.spacing, found.time_step / required.time_step
    slow, quick = (to_kmh(speed) for speed in runs.speeds)
    cautions = []
    if max(grid, step) >= 1.01:
        error = max(grid, 1.0) ** 3 - 1 + max(step, 1.0) ** 2
        speeds = f"{quick:.0f} km/h" if slow == quick else f"{slow:.0f} to {quick:.0f} km/h"
        cautions.append(
            f"A grid of {found.spacing:.3g} m and a time step of {1e3 * found.time_step:.3g} ms are coarser "
            f"than line '{data.name}' needs at {speeds} ({required.spacing:.3g} m, "
            f"{1e3 * required.time_step:.3g} ms): the standard deviation may be wrong by up to about "
            f"{error:.0f} %, other figures by more."
        )
    carrying, share = carrying_grid(data, runs.speeds[1]), runs.speeds[1] / data.contact_wire.wave_speed
    if REACH * carrying < found.spacing <= 1.01 * required.spacing:
        force, loss = NOT_CARRIED
        cautions.append(
            f"At {quick:.0f} km/h, {100 * share:.0f} % of the wave speed, the waves ahead of a train need a "
            f"grid of {carrying:.2g} m on line '{data.name}'; on the {found.spacing:.3g} m in use standard "
            f"deviation, maximum and minimum may be wrong by up to about {force} %, the contact-loss ratio "
            f"by {loss} points. Give a smaller spacing."
        )
    return cautions


ENOUGH = ((0.25, 32), (0.4, 24), (0.66, 16), (0.82, 8), (1.0, 4))
"""Up to a share of the faster wire's wave speed: spans about the train that make figures as of an endless
line, within 1 % of sigma, maximum and minimum within 1 % of the mean force (docs/validation.md)."""
FAST = 8  # maximum number of spans about a train for ``accuracy="fast"``
WITH_OVERLAPS = 10
"""Minimum number of spans about a train that passes overlaps, whose anchors send waves back: with 5 or 8 of
them sigma there is wrong by up to 13 or 6 %, with 10 by less than 1 %."""
STITCHED = 40  # spans about a slow train on a line with stitch wires, past whose supports waves travel far
UNLIKE_SHARE, UNLIKE = 0.58, 24
"""Share of the faster wire's wave speed up to which a line with stitch wires, or of unlike spans, needs more
spans than others, and how many: with 16 the minimum was wrong by 2.7 % of the mean force, sigma by 1.3 %."""
STITCHED_SHARE, STITCHED_ERROR = 0.45, 4
"""Share of the faster wire's wave speed below which a train there is slow, and even so many spans leave an
error in sigma; the error (%)."""
ERRORS = ((16, 3), (8, 5), (5, 15), (0, 60))
"""From a number of spans on: error (%) of figures where more are needed."""


def _enough_spans(wires: tuple[Wire, Wire], runs: Runs, stitched: bool = False, unlike: bool = False) -> int:
    """Spans about the slowest train that are enough for figures of an endless line."""
    share = runs.speeds[0] / max(wire.wave_speed for wire in wires)
    if stitched and share < STITCHED_SHARE:
        return STITCHED
    enough = int(_by_share(ENOUGH, share, 1.0))
    return max(enough, UNLIKE) if (stitched or unlike) and share <= UNLIKE_SHARE else enough


def window_of(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs) -> int:
    """Spans of a line, with the wires of these runs, computed about the train; 0: the whole line.

    Raises InputError for a given window where the wire itself has defects, or is blown upon before a run.
    """
    named = [getattr(each, name) for each in runs.conditions for name in (*ON_WIRE, "side_wind")]
    whole = any(named) or data.has_points
    if whole and numerics.window:
        raise InputError(
            "A line with points, hard_spots, worn_stretches, surface_bumps or side_wind is computed as a "
            "whole, not in a window that travels with the train: leave out "
            f"window={numerics.window}, or set it to 0."
        )
    if numerics.window is not None or whole:
        return numerics.window or 0
    unlike = data.alignment().pitch is None
    enough = _enough_spans(data.wires, runs, data.layout().stitched, unlike)
    if numerics.accuracy != "full":
        enough = min(enough, FAST)
    return max(enough, WITH_OVERLAPS if data.overlaps else 0)


def clear_spans(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs, last: int) -> int:
    """As ``CatenaryKind.clear_spans``; a whole line needs more of them for a slower train.

    Waves and the train leave the line's start together.
    """
    data = _loaded(data, runs)
    window = window_of(data, numerics, runs)
    if window:
        return max(CLEAR, window // 2)
    speed, fastest = runs.speeds[0], max(wire.wave_speed for wire in data.wires)
    if not 0 < speed < math.inf:
        return CLEAR  # refused later, in better words
    needed = math.ceil(last * (fastest + speed) / (2 * speed))
    if needed > MOST_SPANS:
        raise InputError(
            f"At {to_kmh(speed):.3g} km/h waves from a whole line's far anchor would meet the train unless "
            f"the line had {needed:,} spans, but {MOST_SPANS:,} are the maximum; leave out window=0, or give "
            "spans."
        )
    return max(CLEAR, needed - last)


STEEP_ARM, SIDEWAYS = 8.0, 250.0  # slope of a steady arm (degrees) and speed (km/h) beyond which both matter
SIDEWAYS_ERROR = 6
"""By how much sigma is too large at most (%), against an independent model in three dimensions, where the
contact wire moves sideways: 5.8 % at 300 km/h where arms slope by 15 degrees, 2.6 % at 10."""


def warn_if_short(data: FlexibleCatenaryData, numerics: Numerics, runs: Runs) -> None:
    """As ``CatenaryKind.warn_if_short``; also of slow trains on a line with stitch wires.

    And where steady arms slope so much that fast trains would send waves sideways along the wire.
    """
    wires, window, cautions = _loaded(data, runs).wires, numerics.window, []
    if numerics.accuracy != "full":
        return
    enough = _enough_spans(wires, runs)
    if window and window < enough:
        error = next(percent for spans, percent in ERRORS if window >= spans)
        cautions.append(
            f"A window of {window} spans is too short at {to_kmh(runs.speeds[0]):.0f} km/h, where "
            f"{enough} are needed: standard deviation, maximum and minimum may be wrong by up to about "
            f"{error} %; leave out window."
        )
    waves = data.plan is not None and data.plan.sideways_waves
    if data.arms_by_plan and not waves and to_kmh(runs.speeds[1]) > SIDEWAYS:
        slopes = [arm.slope for part in data.layout().tension_lengths for arm in pulled_arms(part.layout)]
        steepest = math.degrees(math.atan(np.nanmax(np.abs(slopes))))
        if steepest > STEEP_ARM:
            cautions.append(
                f"Steady arms of line '{data.name}' slope by up to {steepest:.0f}°, and the contact wire's "
                f"sideways waves, which they cause above {SIDEWAYS:g} km/h, are left out: the standard "
                f"deviation may be too large by up to about {SIDEWAYS_ERROR} %; give plan.sideways_waves = "
                "true."
            )
    limit = STITCHED_SHARE * max(wire.wave_speed for wire in wires)
    if window is None and data.layout().stitched and runs.speeds[0] < limit:
        cautions.append(
            f"Waves travel far along a line with stitch wires: below {to_kmh(limit):.0f} km/h the standard "
            f"deviation may be wrong by up to about {STITCHED_ERROR} % in the default window of {STITCHED} "
            "spans; give window=0 for the whole line."
        )
    for caution in cautions:
        warnings.warn(caution, AccuracyWarning, stacklevel=3)


def _loaded(data: FlexibleCatenaryData, runs: Runs) -> FlexibleCatenaryData:
    """A line with its wires' tension and ice in these runs."""
    condition = runs.conditions[0]
    if not (condition.temperature or condition.ice):
        return data
    return with_tension_left(data, condition, tensions_of_fixed(data, condition))
