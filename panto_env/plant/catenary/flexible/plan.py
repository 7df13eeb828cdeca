"""The plan: a line seen from above, at rest, with a steady wind across it; and its steady arms' stiffness.

Both wires are strings, held at the supports by their stagger. Droppers between them are pendulums: one with
the tension N and the height h resists a sideways displacement with N / h. Along the track the wires' lateral
position y (m, to the right) is that from the middle of the pantograph's head. With the track's curvature
kappa (1/m, to the right) and a wind of q (N/m, to the right) a wire of the tension T has

    T y'' = -kappa T - q + sum over droppers of N / h (y - y of the other wire) delta(x - place).

Stitch wires count as part of the messenger, which has its full tension then. Where wires overlap, each
tension length has the plan of the line's stagger.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array
from ....base.checksums import remembered
from ....base.errors import AccuracyWarning, InputError
from ...line_condition import LineCondition
from .blown import AIR_DENSITY, DRAG, diameter
from .layout import Layout
from .parts import Mast, Plan
from .schema import FlexibleCatenaryData
from .shape import GRAVITY, HELD, solve_band
from .static import solve

STEEPEST_ARM = 45.0  # slope up to which an arm is taken as a pendulum (degrees)
ALIKE = 0.01  # relative difference up to which arms of spans that are all alike are so too
REPEATS = 14  # spans in which the arms of a line whose spans are all alike are computed


class PulledArm(NamedTuple):
    """A steady arm as a pendulum, or several, whose values are then arrays.

    A length l, pulled with F and carrying V, slopes with tan = V / F. Its stiffness is ``F / a (1 + tan^2) +
    (T / L_before + T / L_behind) tan^2`` with a = l cos: it swings about its hinge, and moves the contact
    wire sideways.
    """

    pull: Any  # N, positive where it pulls the wire towards its own side
    slope: Any  # tan of its angle to the horizontal (-); nan, as the pull, where the plan was not needed
    stiffness: Any  # vertical, on the contact wire, at rest (N/m)
    mass: Any  # that moves with the contact wire (kg)
    lift: Any = 0.0  # upward force on the contact wire, by what a wind adds to its pull (N)
    # Share of the stiffness by which the contact wire resists sideways (N/m), and what it is instead where it
    # lets waves run off: a damper ``2 sqrt(T m) tan^2`` (N s/m), the impedance of both sides
    sideways: Any = 0.0
    radiation: Any = 0.0

    def in_motion(self, waves: bool) -> tuple[Array, Array]:
        """Stiffness (N/m) and damping (N s/m) in motion; waves: as ``Plan.sideways_waves``."""
        if waves:
            return self.stiffness - self.sideways, self.radiation
        return self.stiffness, np.zeros_like(self.stiffness)


@dataclass(frozen=True)
class PlanView:
    """One pair of wires seen from above."""

    supports: Array  # (supports,): m
    stagger: Array  # (2, supports): of contact wire and messenger (m)
    curvature: Array  # (spans,): of the track, to the right (1/m)
    cant: Array  # (supports,): m
    places: Array  # (nodes,): supports and droppers (m)
    lateral: Array  # (2, nodes): contact wire and messenger (m)
    load: Array  # (2, nodes - 1): tension times curvature, and wind (N/m)
    tensions: tuple[float, float]  # N

    @cached_property
    def forces(self) -> Array:
        """Force of each support on the wires, to the right (N), (2, supports); nan at both ends."""
        lengths, at = np.diff(self.places), np.searchsorted(self.places, self.supports[1:-1])
        found = np.full((2, len(self.supports)), np.nan)
        for wire, (tension, y) in enumerate(zip(self.tensions, self.lateral, strict=True)):
            slopes, carried = np.diff(y) / lengths, self.load[wire] * lengths
            found[wire, 1:-1] = tension * (slopes[at - 1] - slopes[at]) - (carried[at - 1] + carried[at]) / 2
        return found

    def at(self, x: Array, wire: int = 0) -> Array:
        """Lateral position of the contact wire, 0, or the messenger, 1, at places x (m), (n,) (m)."""
        x = np.asarray(x, dtype=float)
        piece = np.clip(np.searchsorted(self.places, x, side="right") - 1, 0, len(self.places) - 2)
        length, way = np.diff(self.places)[piece], x - self.places[piece]
        left, right = self.lateral[wire, piece], self.lateral[wire, piece + 1]
        bulge = self.load[wire, piece] / (2 * self.tensions[wire])
        return np.asarray(left + (right - left) * way / length + bulge * way * (length - way))

    def furthest(self, span: int) -> tuple[float, float]:
        """Place (m) and lateral position (m) at which the contact wire of a span, from 0, is furthest out."""
        begin, end = self.supports[span : span + 2]
        inside = (self.places[:-1] >= begin - 1e-9) & (self.places[1:] <= end + 1e-9)
        first, last = self.places[:-1][inside], self.places[1:][inside]
        slope = np.diff(self.lateral[0])[inside] / (last - first)
        with np.errstate(divide="ignore", invalid="ignore"):
            level = (first + last) / 2 + slope * self.tensions[0] / self.load[0, inside]
        level = level[(level > first) & (level < last)]
        x = np.concatenate([first, last[-1:], level])
        y = self.at(np.clip(x, begin, end))
        k = int(np.abs(y).argmax())
        return float(x[k]), float(y[k])


def plan_view(layout: Layout, wind: tuple[float, float] | None = None) -> PlanView:
    """The plan of a line of one tension length, in a wind on contact wire and messenger (N/m).

    wind: by default that of the line's plan. Raises InputError for a support without stagger, or a line that
    cannot hang.
    """
    line = layout.line
    if wind is None:
        wind = line.plan.wind if line.plan else (0.0, 0.0)
    supports, shape = np.array(layout.supports), solve(line).over(len(layout.spans))
    stagger, curvature, cant = _set_out(layout)
    x = layout.positions
    places = np.sort(np.concatenate([supports, x]))
    hung, held = np.searchsorted(places, x), np.searchsorted(places, supports)
    lengths, tensions = np.diff(places), (line.contact_wire.tension, line.messenger_wire.tension)
    span = np.searchsorted(supports, (places[1:] + places[:-1]) / 2) - 1
    load = np.outer(tensions, curvature[span]) + np.array(wind)[:, None]
    heights = shape.messenger.height(x) - shape.contact.height(x)
    band, right = np.zeros((3, 2 * len(places))), np.zeros(2 * len(places))
    for wire, tension in enumerate(tensions):
        spring, pushed = tension / lengths, load[wire] * lengths / 2
        band[0, wire:-2:2] += spring
        band[0, wire + 2 :: 2] += spring
        band[2, wire:-2:2] -= spring
        right[wire:-2:2] += pushed
        right[wire + 2 :: 2] += pushed
    pendulum = shape.dropper_tension / heights
    band[0, 2 * hung] += pendulum
    band[0, 2 * hung + 1] += pendulum
    band[1, 2 * hung] -= pendulum
    for wire in range(2):
        fixed = 2 * held + wire
        band[0, fixed] += HELD
        right[fixed] += HELD * stagger[wire]
    lateral = solve_band(band, right).reshape(-1, 2).T.copy()
    lateral[:, held] = stagger
    return PlanView(supports, stagger, curvature, cant, places, lateral, load, tensions)


def contact_wire_at(layout: Layout, x: Array, wind: tuple[float, float] | None = None) -> Array:
    """Lateral position (m) of the contact wire in use at places x (m), (n,), in a wind (N/m).

    wind and InputError: as in ``plan_view``.
    """
    found = np.zeros(len(x))
    for part in layout.tension_lengths:
        used = (x >= part.in_use[0]) & (x <= part.in_use[1])
        found[used] = plan_view(part.layout, wind).at(x[used] - part.begin)
    return found


def wind_loads(line: FlexibleCatenaryData, speed: float, ice: float = 0.0) -> tuple[float, float]:
    """Force of a wind (m/s, to the right) on contact wire and messenger (N/m): rho D C_D U |U| / 2.

    Their diameters are those of their mass as copper, with ice (kg/m), as ``blown`` has them.
    """
    pressure = AIR_DENSITY * DRAG * speed * abs(speed) / 2
    iced = [wire.model_copy(update={"mass": wire.mass + ice}) for wire in line.wires]
    return pressure * diameter(iced[0], False, ice), pressure * diameter(iced[1], True, ice)


def loads_in(line: FlexibleCatenaryData, condition: LineCondition) -> tuple[float, float]:
    """Force of the wind of a line's plan and of a condition on contact wire and messenger (N/m)."""
    plan, own = line.plan or Plan(), wind_loads(line, condition.side_wind, condition.ice)
    return plan.wind[0] + own[0], plan.wind[1] + own[1]


def _set_out(layout: Layout) -> tuple[Array, Array, Array]:
    """Stagger of both wires at supports (m), curvature of the track in spans (1/m), cant at supports (m)."""
    line, count = layout.line, len(layout.spans)
    plan, masts = line.plan or Plan(), [*line.masts[: count + 1]]
    masts += [Mast()] * (count + 1 - len(masts))
    stagger = np.zeros((2, count + 1))
    for k, mast in enumerate(masts):
        contact = _or_in_turn(mast.stagger, plan.stagger, k)
        if contact is None:
            raise InputError(
                f"Support {layout.alignment.support_name(k, k + 1)} of line '{line.name}' has no stagger; "
                "give plan.stagger, or a column stagger in the table of masts."
            )
        above = _or_in_turn(mast.messenger_stagger, plan.messenger_stagger, k)
        stagger[:, k] = contact, contact if above is None else above
    radii = [plan.radius if mast.radius is None else mast.radius for mast in masts[:count]]
    cant = [plan.cant if mast.cant is None else mast.cant for mast in masts]
    return stagger, np.array([1 / radius if radius else 0.0 for radius in radii]), np.array(cant)


def _or_in_turn(given: float | None, in_turn: Sequence[float], number: int) -> float | None:
    return given if given is not None or not in_turn else in_turn[number % len(in_turn)]


def has_plan(line: FlexibleCatenaryData, spans: int = 0) -> bool:
    """Whether a line has stagger at all supports of so many spans, by its plan or by a survey of them all."""
    if line.plan is not None and line.plan.stagger:
        return True
    given = [mast.stagger is not None for mast in line.masts]
    return len(given) > spans and all(given)


def pulled_arms(layout: Layout) -> list[PulledArm]:
    """The steady arms at all supports but the first and the last, of a line of one tension length.

    Their slope is that in still air; a wind on the line's plan changes how they are pulled. Raises InputError
    for an arm that would hang down steeply.
    """
    line, count = layout.line, len(layout.spans)
    still, now = plan_view(layout, (0.0, 0.0)).forces[0, 1:-1], plan_view(layout).forces[0, 1:-1]
    weight = np.zeros(count + 1)  # of the wire, that each arm carries (N)
    holding = [span.steady_arm.holds_wire for span in layout.spans]
    if line.sequence:
        weight[[*holding, holding[-1]]] = solve(line).arm_force
    else:
        weight[:] = solve(line).arm_force
    found = list[PulledArm]()
    for k, (before, behind) in enumerate(pairwise(layout.spans)):
        arm, force = behind.steady_arm, float(still[k])
        pull = float(math.copysign(1, force) * now[k])
        if arm.length is None:
            found.append(PulledArm(pull, math.nan, arm.stiffness or 0.0, arm.mass))
            continue
        carried = float(weight[k + 1]) + GRAVITY * (arm.mass / 2 + arm.clamp_mass)
        angle = math.atan2(carried, abs(force))
        if abs(math.degrees(angle)) > STEEPEST_ARM:
            where = f"at support {layout.alignment.support_name(k + 1, k + 2)} " if line.sequence else ""
            raise InputError(
                f"The steady arm {where}of line '{line.name}' is pulled with {abs(force):.0f} N only and "
                f"carries {carried:.0f} N, so it would slope by {math.degrees(angle):.0f}°, more than "
                f"{STEEPEST_ARM:g}°; give more stagger there, or the arm a stiffness instead of its length."
            )
        slope, wire = math.tan(angle), line.contact_wire
        sideways = wire.tension * (1 / before.span_length + 1 / behind.span_length) * slope**2
        stiffness = pull / (arm.length * math.cos(angle)) * (1 + slope**2) + sideways
        mass, lift = arm.mass / 3 + arm.clamp_mass, slope * (pull - abs(force))
        found.append(PulledArm(pull, slope, stiffness, mass, lift, sideways, 2 * wire.impedance * slope**2))
    return found


def steady_arms(layout: Layout) -> PulledArm:
    """Steady arms at the first support of each span of a line of one tension length, (spans,).

    Those with a length are by the plan. That at the line's first support is as the next one; there anchors
    hold the wires. Raises InputError as ``pulled_arms``, and for unlike arms of a line whose spans are alike.
    """
    return _arms_of(layout.line, len(layout.spans))  # equal layouts may be of lines with unlike plans


@remembered
def _arms_of(line: FlexibleCatenaryData, spans: int) -> PulledArm:
    layout = line.layout(spans)
    if not line.arms_by_plan:
        arms = [span.steady_arm for span in layout.spans]
        found = [PulledArm(math.nan, math.nan, arm.stiffness or 0.0, arm.mass) for arm in arms]
    elif line.sequence:
        found = pulled_arms(layout)
        found = [found[0], *found]
    else:
        middle = pulled_arms(line.layout(REPEATS))[2:-2]
        pulls = [arm.pull for arm in middle]
        if max(pulls) - min(pulls) > ALIKE * max(pulls):
            raise InputError(
                f"The steady arms of line '{line.name}' are pulled with {min(pulls):.0f} to {max(pulls):.0f} "
                "N, and a line whose spans are all alike has equal ones; give a stagger that alternates "
                "evenly, or the spans as a sequence."
            )
        found = [middle[0]] * spans
    return PulledArm(*np.array(found).T.copy())


def without_plan(line: FlexibleCatenaryData) -> FlexibleCatenaryData:
    """A line of equal spans without its plan; steady arms by their length are as stiff as on it in still air.

    Raises InputError as ``steady_arms``.
    """
    changes: dict[str, Any] = {"plan": None}
    if line.arms_by_plan:
        arms = steady_arms(in_still_air(line).layout())
        as_spring = {"mass": float(arms.mass[0]), "stiffness": float(arms.stiffness[0]), "clamp_mass": 0.0}
        changes["steady_arm"] = line.steady_arm.model_copy(update=as_spring | {"length": None})
    return line.model_copy(update=changes)


def in_still_air(line: FlexibleCatenaryData) -> FlexibleCatenaryData:
    """A line without the wind of its plan."""
    if line.plan is None or not any(line.plan.wind):
        return line
    return line.model_copy(update={"plan": line.plan.model_copy(update={"wind": (0.0, 0.0)})})


def in_wind(
    line: FlexibleCatenaryData, spans: int, conditions: Sequence[LineCondition]
) -> FlexibleCatenaryData:
    """A line as the wind across the track pulls its steady arms: the same object where none depends on it.

    Its spans, so many, are one by one then: the wind pulls arms to the left and to the right unlike. Where
    winds of conditions differ, arms are as in still air, with an AccuracyWarning: all lanes share the line.
    """
    if not line.arms_by_plan:
        return line
    if len({each.side_wind for each in conditions}) > 1:
        warnings.warn(
            "The conditions that are drawn from have unlike side_winds, so the steady arms of line "
            f"'{line.name}' are pulled as in still air, and no support rises or sinks: in 30 m/s, where arms "
            "slope by 10°, the standard deviation is too small by up to about 12 %; make a run for each.",
            AccuracyWarning,
            stacklevel=2,
        )
        return in_still_air(line)
    blown = loads_in(line, conditions[0])
    if not any(blown):
        return line
    changed = {"plan": (line.plan or Plan()).model_copy(update={"wind": blown})}
    if line.sequence:
        return line.model_copy(update=changed)
    table = line.model_dump(exclude={"sources", "plan"}, exclude_none=True)
    points = [point for point in table["points"] if point["span"] <= spans]
    return type(line).model_validate(
        table | changed | {"spans": spans, "sequence": ({},) * spans, "points": points}
    )
