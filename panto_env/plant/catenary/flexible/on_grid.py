"""What is attached to the wires, on the grid: springs to the ground, droppers, and stitch wires."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.errors import InputError
from ...functions import stencil
from .arrays import CONTACT, LOWER, MESSENGER, PAD, UPPER
from .grid import implicit_share, missing_yield, point_gain, spring_levels
from .layout import Layout, Stitches, TensionLength
from .plan import steady_arms
from .static import StaticShape
from .wire_defects import WireDefects


class Springs(NamedTuple):
    """Springs and dampers between wires and the ground: two at each mast, then hard spots."""

    masts: int
    number: Index  # (masts,): of the support along the line, counted from 0; -1 where uplift is not recorded
    wire: Index  # (springs,)
    place: Array  # (springs,): along the line, in nodes
    levels: Array  # (springs, 3): weights of three time levels, newest first (N/m)
    mass: Array  # (springs,): that moves with the wire (kg)


class Links(NamedTuple):
    """Droppers: links between two wires at one place along the line, which can only pull."""

    wires: Index  # (links, 2): the lower and the upper one, of which this may come before that
    stitch: Index  # (links,): number of the stitch wire, of those in the window, at the upper end; -1: a wire
    position: Array  # (links,): m
    stiffness: Array  # (links,): in tension (N/m)
    mass: Array  # (links, 2): mass that moves with the lower and the upper end (kg)


class Nodes(NamedTuple):
    """The four nodes about each of some places."""

    first: Index  # (places,): number of the first one
    weights: Array  # (places, 4): for forces and displacements
    shares: Array  # (places, 4): for masses

    @classmethod
    def about(cls, places: Array) -> Nodes:
        """places: along the line, in nodes.

        Masses hang on the two nearest nodes: with cubic weights some nodes would be lighter than bare wire,
        or have negative mass, and be unstable.
        """
        first, weights = stencil(places, 1.0)
        right = (places - (first + 1))[:, None]
        return cls(first, weights, np.concatenate([0 * right, 1 - right, right, 0 * right], axis=1))

    @property
    def four(self) -> Index:
        """Index of each node, (places, 4), in arrays that begin at node -PAD."""
        return np.asarray((self.first + PAD)[:, None] + np.arange(4))


def _springs_of(part: TensionLength, per_stride: int, x: Array, step: float, defects: WireDefects) -> Springs:
    """Springs of a tension length, to which uplift is recorded only at masts between which trains run on it.

    per_stride: nodes of a span. x: positions of the nodes from node -PAD on (m). step: s.
    """
    each, line, dx = part.layout.spans[1:], part.layout.line, float(x[PAD + 1])
    masts: Array = 1.0 * per_stride * np.arange(1, len(each) + 1)
    if line.one_by_one:
        masts = part.begin / dx + np.array(part.layout.supports[1:-1]) / dx
    arms = steady_arms(part.layout)
    moving = arms.in_motion(line.plan is not None and line.plan.sideways_waves)
    supports = [(span.support.stiffness, span.support.damping) for span in each]
    at_masts = np.stack([np.transpose(moving)[1:], np.array(supports)], axis=1).reshape(-1, 2)
    spots = defects.springs_of_nodes(x, dx)
    hard = np.flatnonzero(spots)
    stiffness, damping = np.append(at_masts, np.outer(spots[hard], [1.0, 0.0]), axis=0).T
    masses = np.outer(arms.mass[1:], [1.0, 0.0]).reshape(-1)
    begin, end = part.in_use
    used = (masts * dx >= begin - dx) & (masts * dx <= end + dx)
    return Springs(
        masts=len(each),
        number=np.where(used, part.first_span + np.arange(len(each)), -1),
        wire=part.wire + np.append(np.tile(np.array([CONTACT, MESSENGER]), len(each)), 0 * hard + CONTACT),
        place=np.append(np.repeat(masts, 2), hard - PAD),
        levels=spring_levels(stiffness, damping, step, np.full(len(stiffness), 0.25)),
        mass=np.append(masses, np.zeros(len(hard))),
    )


def _joined_springs(each: Sequence[Springs]) -> Springs:
    """Those of several tension lengths: masts in their order along the line, then all hard spots."""
    masts = sorted(
        (float(own.place[2 * n]), int(own.number[n]), k, n)
        for k, own in enumerate(each)
        for n in range(own.masts)
    )
    some = [(each[k], slice(2 * n, 2 * n + 2)) for _, _, k, n in masts]
    some += [(own, slice(2 * own.masts, None)) for own in each]
    arrays = (np.concatenate([np.asarray(own[k])[which] for own, which in some]) for k in range(2, 6))
    return Springs(len(masts), np.array([number for _, number, _, _ in masts]), *arrays)


def _links_of(layout: Layout, shape: StaticShape) -> Links:
    """The droppers of a line, whose static shape is ``shape`` over all its spans."""
    pairs = np.array([dropper.pair for dropper in layout.droppers], dtype=np.int64)
    clamps = [layout.of_droppers(f"{wire}_clamp_mass") for wire in ("contact", "messenger")]
    messengers = MESSENGER + (2 * pairs if layout.line.overlaps else 0 * pairs)
    return Links(
        wires=np.stack([2 * pairs + CONTACT, messengers], axis=1),
        stitch=layout.moving.carrying,
        position=layout.positions,
        stiffness=shape.dropper_stiffness,
        mass=(shape.dropper_mass / 2)[:, None] + np.stack(clamps, axis=1),
    )


MOST_COURANT = 0.9  # maximum of omega dt / 2 of a stitch wire's grid, of 1 at which the leapfrog is unstable
FEWEST = 8  # least number of intervals of a stitch wire
COARSEST = 1.5
"""Maximum spacing of its nodes over the line's: droppers that share nodes would be computed side by side."""


class StitchGrid(NamedTuple):
    """Constants of stitch wires on their grids; all of a line have equally many intervals."""

    stitches: Stitches
    intervals: int  # 0 where there are no stitch wires
    spacing: Array  # (stitches,): m
    clamps: Nodes  # of the messenger about both clamps of each: first ones (stitches 2,), and so on
    inertia: Array  # (stitches, intervals + 1): bare mass over the node's; 0 at the ends, which clamps move
    mobility: Array  # (stitches, intervals + 1): displacement of the node in a step by 1 N (m/N)
    bare_mobility: Array  # (stitches,): the same of a node without a dropper (m/N)
    node: Index  # (links,): of those on a stitch wire, the node before
    share: Array  # (links,): how far they are on from there to the next one, in intervals
    deficit: Array  # (pairs, nodes): by how much a messenger's tension is less from the node before to it (N)

    @property
    def shares(self) -> Array:
        """Shares of both nodes in each link, (links, 2), for forces, displacements and masses."""
        return np.stack([1 - self.share, self.share], axis=1)

    @property
    def missing_yield(self) -> Array:
        """Compliance that the stitch wire lacks between two nodes (m/N), (links,): its kink is narrower."""
        on, lacking = self.node >= 0, np.zeros(len(self.node))
        k = self.stitches.carrying[on]
        lacking[on] = (self.share * (1 - self.share))[on] * self.spacing[k] / self.stitches.tension[k]
        return lacking

    def gain(self, beta: float, step: float) -> Array:
        """Of links on stitch wires as ``grid.point_gain`` (m/N), (links,), at a node; others 0.

        A string's integral over its waves in closed form. beta, step: s.
        """
        on, found = self.node >= 0, np.zeros(len(self.node))
        k = self.stitches.carrying[on]
        squared = self.stitches.tension[k] / self.stitches.mass[k] * (step / self.spacing[k]) ** 2
        room = 1 - squared * (1 + 2 * beta / step)
        found[on] = self.bare_mobility[k] / 4 / np.sqrt(room)
        return found


def stitch_grid(layout: Layout, links: Links, x: Array, step: float) -> StitchGrid:
    """Grids of a line's stitch wires; x: positions of the line's nodes (m); step: s.

    Raises InputError where the grid is too coarse, or a stitch wire too light for the step.
    """
    data, stitches = layout.line, layout.moving
    count, dx = len(stitches.support), float(x[1] - x[0])
    settle, hung = 1.0 + data.damping.alpha * step / 2, np.full(len(links.position), -1)
    if not count:
        none, nothing, nodes = np.zeros((0, 1)), np.zeros(0), np.zeros((layout.pairs, len(x)))
        return StitchGrid(
            stitches, 0, nothing, Nodes.about(nothing), none, none, nothing, hung, 0.0 * hung, nodes
        )
    length = stitches.end - stitches.begin
    speed = np.sqrt(stitches.tension / stitches.mass)
    quickest = speed * step * np.sqrt(1 + 2 * data.damping.beta / step) / MOST_COURANT
    intervals = int((length / np.maximum(dx, quickest)).min())
    spacing = length / max(intervals, 1)
    longest = length.max() / length.min() * COARSEST * dx
    if intervals < FEWEST or spacing.max() > longest:
        raise InputError(
            f"A grid of {dx:.3g} m and a time step of {1e3 * step:.3g} ms are too coarse for the stitch "
            f"wires of line '{data.name}', {length.min():g} m long with waves at {speed.max():.3g} m/s; give "
            "a smaller spacing and time_step, or longer and heavier stitch wires."
        )
    places = np.stack([stitches.begin, stitches.end], axis=1).ravel()
    on = links.stitch >= 0
    carrying = links.stitch[on]
    along = (links.position[on] - stitches.begin[carrying]) / spacing[carrying]
    node, share = hung, np.zeros(len(hung))
    node[on] = np.floor(along)
    share[on] = along - node[on]
    bare = (stitches.mass * spacing)[:, None]
    mass = np.tile(bare, (1, intervals + 1))
    np.add.at(mass, (carrying, node[on]), (1 - share[on]) * links.mass[on, 1])
    np.add.at(mass, (carrying, node[on] + 1), share[on] * links.mass[on, 1])
    moves = np.ones(intervals + 1)
    moves[[0, -1]] = 0.0

    def over(wire: int) -> Stitches:
        return stitches.some(stitches.wire == wire, stitches.carrying[:0])

    return StitchGrid(
        stitches=stitches._replace(carrying=links.stitch),
        intervals=intervals,
        spacing=spacing,
        clamps=Nodes.about(places / dx),
        inertia=bare / mass * moves,
        mobility=step**2 / mass / settle * moves,
        bare_mobility=step**2 / bare[:, 0] / settle,
        node=node,
        share=share,
        deficit=np.stack([over(2 * k).deficit(x - dx, x) for k in range(layout.pairs)]),
    )


STIFFEST = 1e8  # maximum stiffness of a link on the grid (N/m), in tension


class OnGrid(NamedTuple):
    """Constants of nodes, springs and links; nodes count from -PAD."""

    inertia: Array  # (wires, nodes): bare wire's mass over the node's
    mobility: Array  # (wires, nodes): displacement in one step by 1 N (m/N)
    springs: Springs
    at_springs: Nodes
    spring_yield: Array  # (springs, 1): displacement of the spring in a step by 1 N there (m/N)
    links: Links
    at_links: Nodes
    move: Array  # (links, 2, 4): displacement of the nodes of both ends in a step by 1 N (m/N)
    pull: Array  # (links, 3): change of tension by extension at three times, newest first (N/m)
    room: Array  # (links,): designed distance of the ends (m)
    slope_mobility: Array  # (wires, 1): displacement of a bare node in a step by a tension, per slope (1/N)
    ropes: StitchGrid

    @property
    def along(self) -> tuple[Index, Index]:
        """Links in their order along the line: those on the messenger, and those on stitch wires."""
        order = np.argsort(self.at_links.first, kind="stable")
        hung = self.links.stitch[order] >= 0
        return order[~hung], order[hung]


def on_grid(
    layout: Layout, shape: StaticShape, per_stride: int, x: Array, step: float, own: WireDefects
) -> OnGrid:
    """Everything that is attached to the wires of a line, with its static shape.

    per_stride: nodes of a span. x: positions of the nodes from node -PAD on (m). step: s. own: defects of the
    contact wire. Raises InputError as ``stitch_grid`` does.
    """
    data, parts, stitches = layout.line, layout.tension_lengths, layout.moving
    damping, wires, dx = data.damping, data.wires * layout.pairs, float(x[PAD + 1])
    defects = [own.within(*part.in_use) for part in parts] if len(parts) > 1 else [own]
    held_by = [
        _springs_of(part, per_stride, x, step, its_own) for part, its_own in zip(parts, defects, strict=True)
    ]
    if data.contact_wires > 1:
        # The second wire has the same arms; under its messenger, which is none, is no support. Its uplift is
        # recorded behind that of the first wire at all masts.
        (arms,) = held_by
        levels = arms.levels.copy()
        levels[1::2] = 0.0
        number, wire = arms.number + arms.masts, arms.wire + 2
        held_by.append(arms._replace(number=number, wire=wire, levels=levels))
    springs = _joined_springs(held_by)
    over = shape.over(len(layout.spans))
    links = _links_of(layout, over)
    room = shape.messenger.height(links.position) - shape.contact.height(links.position)
    usual = (links.stitch < 0) & (layout.pairs == 1)
    room = np.where(usual, room, over.dropper_length + over.dropper_tension / over.dropper_stiffness)
    at_springs, at_links = Nodes.about(springs.place), Nodes.about(links.position / dx)
    bare = np.array([[wire.mass * dx] for wire in wires])
    added, ropes = np.zeros((len(wires), len(x))), stitch_grid(layout, links, x, step)
    on = links.stitch >= 0  # a stitch wire
    for end, ours in ((LOWER, slice(None)), (UPPER, ~on)):
        nodes = links.wires[ours, end, None], at_links.four[ours]
        np.add.at(added, nodes, at_links.shares[ours] * links.mass[ours, end, None])
    clamped = np.repeat(stitches.clamp_mass, 2)[:, None]
    above = np.repeat(stitches.wire, 2)[:, None] + MESSENGER
    np.add.at(added, (above, ropes.clamps.four), ropes.clamps.shares * clamped)
    np.add.at(added, (springs.wire[:, None], at_springs.four), at_springs.shares * springs.mass[:, None])
    for part, its_own in zip(parts, defects, strict=True):
        added[part.wire + CONTACT] += its_own.mass_of_nodes(x, dx, data.contact_wire)
    mass = bare + added
    held = _held(parts, len(wires), x)
    if data.contact_wires > 1:
        held[2 + MESSENGER] = True  # the second contact wire has none
    mobility = np.where(held, 0.0, step**2 / mass / (1.0 + damping.alpha * step / 2))
    mobility[:, : PAD + 1] = mobility[:, -PAD - 1 :] = 0.0  # no force moves the ends

    # The compliance that the wires lack on the grid is added to the links.
    weights = at_links.weights
    ends = [((links.wires == w) & ~(on[:, None] & [False, True])).sum(axis=1) for w in range(len(wires))]
    missing = sum(
        count * missing_yield(wire, dx, step, damping.beta, weights)
        for wire, count in zip(wires, ends, strict=True)
    )
    missing = missing + ropes.missing_yield
    stiffness = 1 / np.maximum(1 / links.stiffness + missing, 1 / STIFFEST)
    move = np.stack(
        [mobility[links.wires[:, end, None], at_links.four] * weights for end in (LOWER, UPPER)], axis=1
    )
    apart = (weights * move.sum(axis=1)).sum(axis=1)
    move[on, UPPER] = 0.0
    two = ropes.mobility[links.stitch[on, None], ropes.node[on, None] + [0, 1]]
    move[on, UPPER, :2] = two * ropes.shares[on]
    apart[on] = (weights * move[:, LOWER])[on].sum(axis=1)
    apart[on] += (move[on, UPPER, :2] * ropes.shares[on]).sum(axis=1)
    lightest = [min(each.lightest for each in defects), 1.0] * layout.pairs
    gains = [
        point_gain(wire, dx, step, damping.beta, light) for wire, light in zip(wires, lightest, strict=True)
    ]
    gain = sum(count * each for count, each in zip(ends, gains, strict=True)) + ropes.gain(damping.beta, step)
    levels = spring_levels(stiffness, stiffness * damping.beta, step, implicit_share(stiffness, gain))
    moved = mobility[springs.wire[:, None], at_springs.four]
    return OnGrid(
        inertia=np.where(held, 0.0, bare / mass),
        mobility=mobility,
        springs=springs,
        at_springs=at_springs,
        spring_yield=(at_springs.weights**2 * moved).sum(axis=1)[:, None],
        links=links,
        at_links=at_links,
        move=move,
        pull=levels / (1 + levels[:, 0] * apart)[:, None],
        room=room,
        slope_mobility=step**2 / bare / (1.0 + damping.alpha * step / 2) / dx,
        ropes=ropes,
    )


def _held(parts: Sequence[TensionLength], wires: int, x: Array) -> Any:
    """Whether nodes of wires are beyond their anchors, (wires, nodes); those of the line's ends move."""
    if len(parts) == 1:
        return np.zeros((wires, len(x)), dtype=bool)
    held, half = np.ones((wires, len(x)), dtype=bool), (x[1] - x[0]) / 2
    for part in parts:
        inside = (x > part.begin + half) | (part is parts[0])
        inside &= (x < part.end - half) | (part is parts[-1])
        held[part.wire : part.wire + 2, inside] = False
    return held
