"""A line seen from above, by supports and spans: where its wires are, and how its arms are pulled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import Array
from ..base.table import Table
from ..metrics.compliance import Criterion
from ..plant.catenary.flexible.defects import DefectiveLine
from ..plant.catenary.flexible.layout import Layout
from ..plant.catenary.flexible.parts import Plan
from ..plant.catenary.flexible.plan import (
    REPEATS,
    PlanView,
    has_plan,
    in_wind,
    loads_in,
    plan_view,
    pulled_arms,
)
from ..plant.catenary.flexible.schema import FlexibleCatenaryData
from ..plant.line_condition import LineCondition

LEAST_PULL = 80.0  # N
PULL_SOURCE = "EN 50119 (recalled, low confidence)"
DEVIATION = {1.6: 0.40, 1.95: 0.55}
"""Maximum lateral position of the contact wire (m), in wind, by the width of the head (m)."""
DEVIATION_SOURCE = "TSI ENE 1301/2014, table 4.2.9.2, before the corrections of its appendix D (recalled)"
WORKING_RANGE = {1.6: 1.2, 1.95: 1.55}
"""Width of a head over which the wire may run (m), by the head's own width (m)."""
RANGE_SOURCE = "EN 50367 (recalled, low confidence)"
SWAY = ((5.0, 0.11), (6.5, 0.17))
"""Sway of a pantograph to either side (m) by the height of the contact wire over the rails (m): TSI ENE
1301/2014, appendix D (recalled)."""
DRAWN = 3  # spans, at the least, of a line whose spans are all alike
PLACES = 60  # of a span at which the contact wire is drawn


class SupportPlan(NamedTuple):
    """What holds the wires sideways at one support; forces on the wires are positive to the right."""

    number: int  # from 1, along the line
    position: float  # m
    stagger: float  # of the contact wire, from the middle of the head (m)
    messenger_stagger: float  # m
    setting_out: float  # of the contact wire, from the plumb line over the middle of the canted track (m)
    messenger_force: float  # of the support on the messenger, in the wind (N)
    force: float  # of the steady arm on the contact wire, in the wind (N); nan at a line's ends, as the next
    still_pull: float  # of the steady arm, without wind (N)
    pull: float  # in the wind, negative where the arm is pressed (N)
    slope: float  # of the arm (degrees); nan where it has no length
    stiffness: float  # vertical, of the arm (N/m)
    rise: float  # of the contact wire there in the wind (m)


class SpanPlan(NamedTuple):
    """Where the contact wire of one span is furthest from the middle of the head, to the right."""

    number: int  # from 1
    radius: float  # of the track, positive to the right; infinite where it is straight (m)
    still: float  # without wind (m)
    still_place: float  # from the span's first support (m)
    windy: float  # in the wind (m)
    windy_place: float  # m
    blow_off: float  # of mid-span by the wind (m)


@dataclass(frozen=True)
class LinePlan:
    """A line seen from above; of one whose spans are all alike, as many as differ."""

    line: FlexibleCatenaryData
    loads: tuple[float, float]  # of the wind, on contact wire and messenger (N/m)
    supports: list[SupportPlan]
    spans: list[SpanPlan]
    places: Array  # along the line, of the positions below (m), (n,)
    still: Array  # lateral position of contact wire and messenger without wind (m), (2, n)
    windy: Array  # in the wind (m), (2, n)

    @property
    def sway(self) -> float:
        """Of the pantograph, to either side (m)."""
        heights, sways = zip(*SWAY, strict=True)
        return float(np.interp((self.line.plan or Plan()).contact_height, heights, sways))

    def criteria(self) -> list[Criterion]:
        """Radial forces, lateral positions and slopes, with their limits."""
        head = (self.line.plan or Plan()).head_width
        still, pulls, slopes = (
            [value for each in self.supports if not math.isnan(value := getattr(each, name))]
            for name in ("still_pull", "pull", "slope")
        )
        out = max(max(abs(each.still), abs(each.windy)) for each in self.spans)  # wind may blow it back
        windy = any(self.loads)
        found = [
            Criterion(
                "smallest_radial_force", "minimum pull of a steady arm in still air", "N", min(still),
                LEAST_PULL, None, PULL_SOURCE,
            ),
            Criterion("largest_radial_force", "maximum pull of a steady arm", "N", max(still + pulls)),
            Criterion(
                "lateral_position", "maximum lateral position of the contact wire", "m", out,
                None, DEVIATION[head], DEVIATION_SOURCE,
            ),
            Criterion(
                "position_on_head", "the same with the pantograph's sway", "m", out + self.sway,
                None, WORKING_RANGE[head] / 2, RANGE_SOURCE,
                f"on a head of {1e3 * head:g} mm; sway {self.sway:.2f} m",
            ),
        ]  # fmt: skip
        if windy:
            found.insert(
                1,
                Criterion(
                    "pull_in_wind", "minimum pull of a steady arm in the wind", "N", min(pulls),
                    0.0, None, "EN 50119 (recalled): no arm is pressed", strict=True,
                ),
            )  # fmt: skip
            highest = max(abs(each.rise) for each in self.supports)
            found.append(
                Criterion("rise_in_wind", "rise or fall of a support in the wind", "mm", 1e3 * highest)
            )
        if slopes:
            found.append(Criterion("arm_slope", "maximum slope of a steady arm", "°", max(map(abs, slopes))))
        return found

    def tables(self, name: Callable[[int], str] = str) -> list[Table]:
        """Two tables to print, of supports and of spans; name: of a support's number, counted from 0."""
        windy, (contact, messenger) = any(self.loads), self.loads
        air = f"in a wind of {contact:.3g} N/m on the contact wire and {messenger:.3g} on the messenger"
        alike = "" if self.line.sequence else "; all others repeat these"
        title = f"Seen from above, {air if windy else 'in still air'}; positive to the right{alike}"
        headings = (
            "support", "stagger (m)", "messenger (m)", "set out (m)", "radial force (N)", "pull (N)",
            "messenger (N)", "slope (°)", "stiffness (N/m)",
        )  # fmt: skip
        rows = [
            (
                name(each.number - 1), f"{each.stagger:+.3f}", f"{each.messenger_stagger:+.3f}",
                f"{each.setting_out:+.3f}", _or_dash(each.force, "+.0f"), _or_dash(each.pull, ".0f"),
                _or_dash(each.messenger_force, "+.0f"), _or_dash(each.slope, ".1f"),
                _or_dash(each.stiffness, ".0f"), *([f"{1e3 * each.rise:+.1f}"] if windy else []),
            )
            for each in self.supports
        ]  # fmt: skip
        of_spans = ("span", "radius (m)", "furthest (m)", "at (m)")
        spans = [
            (
                str(each.number), "straight" if math.isinf(each.radius) else f"{each.radius:g}",
                f"{each.still:+.3f}", f"{each.still_place:.1f}",
                *(
                    [f"{each.windy:+.3f}", f"{each.windy_place:.1f}", f"{each.blow_off:+.3f}"]
                    if windy
                    else []
                ),
            )
            for each in self.spans
        ]  # fmt: skip
        blown = ("in wind (m)", "at (m)", "blow-off (m)") if windy else ()
        return [
            Table(title, (*headings, *(["rise (mm)"] if windy else [])), rows, 0),
            Table("The contact wire's lateral position", (*of_spans, *blown), spans, 0),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Supports and spans as plain data."""
        return {
            "wind_loads": self.loads,
            "supports": [each._asdict() for each in self.supports],
            "spans": [each._asdict() for each in self.spans],
        }


def _or_dash(value: float, form: str) -> str:
    return "–" if math.isnan(value) else f"{value:{form}}"


def line_plan(line: FlexibleCatenaryData, condition: LineCondition) -> LinePlan | None:
    """A line seen from above in a condition's wind; None for a line without stagger.

    Raises InputError for a support without stagger, or a steady arm that hangs down steeply.
    """
    if not has_plan(line):
        return None
    plan = line.plan or Plan()
    loads = loads_in(line, condition)
    first, count = _shown(line)
    far = 0 if line.sequence or not first else max(0, DRAWN - count) + REPEATS // 2
    layout = line.layout(None if line.sequence else first + count + far)
    blown = in_wind(line, len(layout.spans), [condition])
    supports, spans = list[SupportPlan](), list[SpanPlan]()
    places, still, windy = list[Array](), list[Array](), list[Array]()
    windy_parts = blown.layout(len(layout.spans)).tension_lengths
    for part, now in zip(layout.tension_lengths, windy_parts, strict=True):
        views = plan_view(part.layout, (0.0, 0.0)), plan_view(part.layout, loads)
        begin, end = part.in_use
        inside = [
            k
            for k, x in enumerate(part.begin + views[0].supports)
            if begin <= x <= end and first <= part.first_span + k <= first + count
        ]
        supports += _supports(part.layout, now.layout, views, inside, part.first_span, part.begin, plan)
        begun = inside[:-1] if part.end == end else inside  # no span begins at the line's last support
        spans += [_span(views, k, part.first_span) for k in begun]
        low, high = (
            (begin, end) if not first else views[0].supports[[first, first + max(count, DRAWN)]].tolist()
        )
        x = np.linspace(low, high, PLACES * math.ceil((high - low) / line.stride) + 1)
        places.append(x)
        for found, view in zip((still, windy), views, strict=True):
            found.append(np.stack([view.at(x - part.begin, wire) for wire in range(2)]))
    x = np.concatenate(places)
    if not line.sequence:  # counted from 1, as if the line began there
        begin = supports[0].position
        supports = [
            each._replace(number=each.number - first, position=each.position - begin) for each in supports
        ]
        spans, x = [each._replace(number=each.number - first) for each in spans], x - begin
    return LinePlan(line, loads, supports, spans, x, np.hstack(still), np.hstack(windy))


def _shown(line: FlexibleCatenaryData) -> tuple[int, int]:
    """First support that is shown, from 0, and number of spans: all, or those that differ in the midst."""
    if line.sequence:
        return 0, len(line.sequence)
    plan = line.plan or Plan()
    period = math.lcm(*(max(1, len(each)) for each in (plan.stagger, plan.messenger_stagger)))
    if not plan.stagger:
        return 0, len(line.masts) - 1
    return period * math.ceil(REPEATS / 2 / period), period


def _supports(
    layout: Layout,
    now: Layout,
    views: tuple[PlanView, PlanView],
    inside: list[int],
    first_span: int,
    begin: float,
    plan: Plan,
) -> list[SupportPlan]:
    """layout, now: of a tension length as designed and in the wind; views: in still air and in the wind."""
    still, windy = views
    line = now.line
    arms = pulled_arms(now)
    rise: Array = np.zeros(len(still.supports))
    if line.arms_in_wind:
        rested = DefectiveLine(now, LineCondition())
        rise = rested.rise(rested.solve()).height(still.supports)
    found = []
    # The track leans to the inside of its curve, and the head's middle with it.
    curves = np.append(still.curvature, still.curvature[-1])
    lean = np.where(curves < 0, -1.0, 1.0) * still.cant * plan.contact_height / plan.cant_base
    for k in inside:
        inner = 0 < k < len(still.supports) - 1
        arm = arms[k - 1] if inner else None
        force, sideways = float(windy.forces[0, k]), float(still.forces[0, k])
        found.append(
            SupportPlan(
                number=first_span + k + 1,
                position=begin + float(still.supports[k]),
                stagger=float(still.stagger[0, k]),
                messenger_stagger=float(still.stagger[1, k]),
                setting_out=float(still.stagger[0, k] + lean[k]),
                messenger_force=float(windy.forces[1, k]),
                force=force,
                still_pull=abs(sideways),
                pull=math.copysign(1, sideways) * force,
                slope=math.nan if arm is None else math.degrees(math.atan(arm.slope)),
                stiffness=math.nan if arm is None else arm.stiffness,
                rise=float(rise[k]),
            )
        )
    return found


def _span(views: tuple[PlanView, PlanView], k: int, first_span: int) -> SpanPlan:
    still, windy = views
    begin, end = still.supports[k : k + 2]
    (x, y), (place, lateral) = still.furthest(k), windy.furthest(k)
    middle = np.array([(begin + end) / 2])
    curvature = float(still.curvature[k])
    return SpanPlan(
        first_span + k + 1,
        1 / curvature if curvature else math.inf,
        y, x - begin, lateral, place - begin,
        float(windy.at(middle)[0] - still.at(middle)[0]),
    )  # fmt: skip
