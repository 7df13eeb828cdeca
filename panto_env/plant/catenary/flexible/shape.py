"""The static shape of a line: wires as tensioned beams from node to node, and how droppers settle.

A tensioned beam obeys T y'' - EI y'''' + p = 0, up positive. Between two nodes a distance l apart, under an
even load p per length, it has the shape ``a + b s + c exp(-kappa s) + d exp(-kappa (l - s)) + e s (l - s)``,
with s from the first node, kappa = sqrt(T/EI) and e = p / 2T. So elements of that shape are exact, however
long they are, and nodes are needed only where a force or a spring acts on the wire.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ....base.arrays import Array, Index
from ....base.checksums import remembered
from ..schema import Wire
from .arrays import CONTACT

if TYPE_CHECKING:
    from .layout import Layout, TensionLength

GRAVITY = 9.81  # m/s^2
HELD = 1e18  # N/m, that holds a wire, in a banded matrix
SHARPEST = 1e-12  # m over which a wire without bending stiffness rounds a kink, as elements need one
_LOWER = np.tril_indices(4)  # rows and columns of the lower half of an element's matrix


Located = tuple[Index, Index, Array, Array]
"""Positions on a profile: numbers of the span and of its piece, from 0, and distances from its ends (m)."""


def located(breaks: Array, x: Array, repeats: bool) -> Located:
    """Positions x (m), (n,), along a line; breaks, repeats: as ``Profile`` has them."""
    span, local = np.divmod(x, breaks[-1]) if repeats else (0 * x, x)
    k = np.clip(np.searchsorted(breaks, local, side="right") - 1, 0, len(breaks) - 2)
    return span.astype(int), k, local - breaks[k], breaks[k + 1] - local


class Profile(NamedTuple):
    """Height along a wire in pieces of that shape; spans are divided alike."""

    breaks: Array  # (pieces of a span + 1,): where pieces begin and end in a span (m)
    pieces: Array  # (pieces, 5): a, b, c, d, e of each piece, span after span
    decay: float | Array  # kappa (1/m), of each piece where they differ
    repeats: bool = True  # whether the line goes on likewise beyond its end

    def height(self, x: Array) -> Array:
        """Height (m) at positions x (m), (n,), along the line; one that repeats begins anew at its end."""
        return self.height_at(located(self.breaks, x, self.repeats))

    def height_at(self, places: Located) -> Array:
        """As ``height``, at places from ``located``: their search takes longer than the heights."""
        span, k, left, right = places
        a, b, c, d, e = self.pieces[(span * (len(self.breaks) - 1) + k) % len(self.pieces)].T
        decay = self.decay[k] if isinstance(self.decay, np.ndarray) else self.decay
        bend = c * np.exp(-decay * left) + d * np.exp(-decay * right)
        return np.asarray(a + b * left + bend + e * left * right)


class Beams:
    """A wire's elements; unknowns of each are height (m) and slope (-) of its first and its second end."""

    def __init__(self, wire: Wire, lengths: Array) -> None:
        """lengths: of the elements (m), (n,)."""
        self.tension, self.lengths = wire.tension, lengths
        self.decay = float(np.sqrt(wire.tension / max(wire.bending_stiffness, wire.tension * SHARPEST**2)))
        far, gone = np.exp(-self.decay * lengths), -np.expm1(-self.decay * lengths)
        # Height and slope of the ends, added (sum) or subtracted (lean), give the parts of the shape that are
        # symmetric about the middle, A + C (...), and antisymmetric, B (s - l/2) + D (...).
        half, no = np.full(len(lengths), 0.5), np.zeros(len(lengths))
        rate = self.decay * (1 + far)
        lean = -1 / (rate * lengths / 2 - gone) * np.array([half, lengths / 4, -half, lengths / 4])
        tilt = np.array([no, half, no, half]) + rate * lean
        even = -1 / (self.decay * gone) * np.array([no, half, no, -half])
        level = np.array([half, no, half, no]) - (1 + far) * even
        # Contiguous, as a pickled copy is: products would otherwise add up in another order there.
        shapes = np.array([level - tilt * lengths / 2, tilt, even + lean, even - lean])
        self._shapes = np.ascontiguousarray(shapes.transpose(2, 0, 1))
        # The ends are held by T y' - EI y''' = T b and EI y'' = T (c exp(-kappa s) + d exp(-kappa (l - s))).
        one = np.ones(len(lengths))
        held = np.array([[no, -one, no, no], [no, no, -one, -far], [no, one, no, no], [no, no, far, one]])
        self.stiffness = wire.tension * held.transpose(2, 0, 1) @ self._shapes
        """Forces (N) and moments (N m) at the ends by the unknowns, (n, 4, 4)."""

    def repeated(self, times: int) -> Beams:
        """The elements of so many spans that are divided alike."""
        other = copy(self)
        other.lengths = np.tile(self.lengths, times)
        other._shapes = np.tile(self._shapes, (times, 1, 1))
        other.stiffness = np.tile(self.stiffness, (times, 1, 1))
        return other

    def bulge(self, load: Array) -> Array:
        """E (1/m), (n,), of elements under even loads (N/m), (n,)."""
        return load / (2 * self.tension)

    def end_loads(self, bulge: Array) -> Array:
        """Forces (N) and moments (N m), (n, 4), that act on the ends as the even loads of a bulge do."""
        bending = np.full(len(bulge), 2 / self.decay**2)
        held = -self.tension * np.array([self.lengths, -bending, self.lengths, bending]).T
        loads = np.einsum("eij,ej->ei", self.stiffness, self._end_slopes) - held
        return np.asarray(bulge[:, None] * loads)

    def pieces(self, unknowns: Array, bulge: Array) -> Array:
        """a, b, c, d, e of each element, (n, 5), by its unknowns, (n, 4)."""
        bare = np.einsum("eij,ej->ei", self._shapes, unknowns - bulge[:, None] * self._end_slopes)
        return np.concatenate([bare, bulge[:, None]], axis=1)

    @property
    def _end_slopes(self) -> Array:
        """Unknowns of s (l - s), (n, 4)."""
        return np.outer(self.lengths, [0, 1, 0, -1])


@remembered
def beams_of(wire: Wire, lengths: tuple[float, ...]) -> Beams:
    """A wire's elements: the static shape of a line needs the same ones as the line with its defects."""
    return Beams(wire, np.array(lengths))


def places_in_band(unknowns: Any, size: int) -> Index:
    """Where the lower halves of elements' matrices lie in a matrix's lower diagonals, read row after row.

    unknowns: (elements, 4), rising numbers of the matrix's rows, of which there are ``size``.
    """
    row, column = unknowns[:, _LOWER[0]], unknowns[:, _LOWER[1]]
    return np.asarray(((row - column) * size + column).ravel())


def add_to_band(band: Array, places: Index, stiffness: Array) -> None:
    """Add the elements' stiffness matrices, (elements, 4, 4), to a matrix.

    band: the matrix's lower diagonals, (diagonals, n). places: from ``places_in_band``, also of several spans
    with these elements in each.
    """
    np.add.at(band.reshape(-1), places, np.resize(stiffness[:, *_LOWER], len(places)))


def solve_band(band: Array, load: Array) -> Array:
    """Unknowns of a matrix, by its lower diagonals, under a load; overwrites both.

    Raises LinAlgError where the matrix is not positive definite.
    """
    # Slow to import. SciPy's solveh_banded takes twice as long for a line of twenty spans.
    from scipy.linalg.lapack import dpbsv

    _, unknowns, wrong = dpbsv(band, load, lower=1, overwrite_ab=1, overwrite_b=1)
    if wrong:
        raise np.linalg.LinAlgError("the matrix of a line is not positive definite")
    return np.asarray(unknowns)


class PeriodicWire:
    """A wire under its weight along a line on which everything repeats, held at some of its nodes."""

    def __init__(self, wire: Wire, breaks: Array, held: Index) -> None:
        """breaks: nodes (m), (n + 1,), of which the last is the first one again; held: their numbers."""
        self.breaks, nodes = breaks, len(breaks) - 1
        self.beams = beams_of(wire, tuple(np.diff(breaks).tolist()))
        self._bulge = self.beams.bulge(np.full(nodes, -GRAVITY * wire.mass))
        size, self._held = 2 * nodes, 2 * held
        self._unknowns = (2 * np.arange(nodes)[:, None] + np.arange(4)) % size
        self._free = np.delete(np.arange(size), self._held)
        in_matrix = (size * self._unknowns[:, :, None] + self._unknowns[:, None, :]).ravel()
        stiffness: Any = np.bincount(in_matrix, self.beams.stiffness.ravel(), size**2)
        self._stiffness = stiffness.reshape(size, size)
        loads = self.beams.end_loads(self._bulge)
        self._weight: Any = np.bincount(self._unknowns.ravel(), loads.ravel(), size)

    def hang(self, heights: Array, forces: Array) -> tuple[Array, Array]:
        """Unknowns of the wire with held nodes at ``heights`` (m), and the upward forces (N) that hold them.

        forces: further upward forces at all nodes (N), (n,).
        """
        load, state, free = self._weight.copy(), np.zeros(len(self._weight)), self._free
        load[::2] += forces
        state[self._held] = heights
        among_free = self._stiffness[np.ix_(free, free)]
        state[free] = np.linalg.solve(among_free, (load - self._stiffness @ state)[free])
        return state, (self._stiffness @ state - load)[self._held]

    def profile(self, state: Array) -> Profile:
        """Height along the wire, by its unknowns."""
        pieces = self.beams.pieces(state[self._unknowns], self._bulge)
        return Profile(self.breaks, pieces, self.beams.decay)


class LongWire:
    """A wire under its weight from end to end, where it goes on at given slopes and carries half as much.

    Such an end is where the wire would be mirrored, on the straight line of that slope.
    """

    def __init__(self, wire: Wire, breaks: Array, slopes: tuple[float, float], springs: Array) -> None:
        """breaks: nodes (m), (n,); slopes: at both ends (-); springs: to the ground at nodes (N/m), (n,)."""
        self.breaks, nodes = breaks, len(breaks)
        self.beams = Beams(wire, np.diff(breaks))
        self._bulge = self.beams.bulge(np.full(nodes - 1, -GRAVITY * wire.mass))
        self._unknowns = 2 * np.arange(nodes - 1)[:, None] + np.arange(4)
        self._band, self._load, self._springs = np.zeros((4, 2 * nodes)), np.zeros(2 * nodes), springs
        add_to_band(self._band, places_in_band(self._unknowns, 2 * nodes), self.beams.stiffness)
        self._band[0, ::2] += springs
        self._band[0, [1, -1]] += HELD
        np.add.at(self._load, self._unknowns, self.beams.end_loads(self._bulge))
        self._load[[0, -2]] += wire.tension * np.array([-1.0, 1.0]) * slopes
        self._slopes = HELD * np.array(slopes)

    def hang(self, held: Index, heights: Array, forces: Array) -> tuple[Array, Array]:
        """Unknowns of the wire with nodes ``held`` at ``heights`` (m), and the upward forces (N) on these.

        forces: further upward forces at all nodes (N), (n,).
        """
        band, load = self._band.copy(), self._load.copy()
        load[::2] += forces
        right = load.copy()
        band[0, 2 * held] += HELD
        right[2 * held] += HELD * heights
        right[[1, -1]] += self._slopes
        state = solve_band(band, right)
        pulled = np.zeros(len(state))
        forces = np.einsum("eij,ej->ei", self.beams.stiffness, state[self._unknowns])
        np.add.at(pulled, self._unknowns, forces)
        pulled[::2] += self._springs * state[::2]
        return state, (pulled - load)[2 * held]

    def profile(self, state: Array) -> Profile:
        """Height along the wire, by its unknowns."""
        pieces = self.beams.pieces(state[self._unknowns], self._bulge)
        return Profile(self.breaks, pieces, self.beams.decay, repeats=False)


class InUse(NamedTuple):
    """Height of the wires in use along a line with overlaps; in the place of a ``Profile``."""

    limits: Array  # (tension lengths - 1,): where trains pass from one to the next (m)
    begins: Array  # (tension lengths,): m
    profiles: tuple[Any, ...]  # ``Profile`` of each, from its own begin
    breaks: tuple[float, float]  # ends of the line (m)

    def height(self, x: Array) -> Array:
        """Height (m) at positions x (m), (n,)."""
        x = np.asarray(x, dtype=float)
        which, found = np.searchsorted(self.limits, x, side="right"), np.zeros(x.shape)
        for k, profile in enumerate(self.profiles):
            ours = which == k
            found[ours] = profile.height(x[ours] - self.begins[k])
        return found


class Rope(NamedTuple):
    """A stitch wire at rest."""

    places: Array  # of its clamps and droppers (m), along the line or about a support that repeats at 0
    heights: Array  # m
    wire: int = 0  # contact wire under it


@dataclass(frozen=True, eq=False)
class StaticShape:
    """Spans in equilibrium that repeat; dropper arrays are in their order along the line."""

    contact: Profile | InUse
    messenger: Profile | InUse
    arm_force: float | Array  # of each steady arm that holds the wire, upward; (arms,) of unlike spans (N)
    dropper_tension: Array  # at the contact wire (N)
    dropper_length: Array  # unloaded (m)
    dropper_stiffness: Array  # N/m
    dropper_mass: Array  # kg, without clamps
    spans: int = 1  # number of spans that repeat: all of the line's where they differ
    ropes: tuple[Rope, ...] = ()  # stitch wires
    # The other contact wire of two that hang side by side, and its steady arms, as those of the first.
    second: Profile | None = None
    second_arm_force: float | Array = 0.0

    @property
    def contacts(self) -> tuple[tuple[Profile | InUse, float | Array], ...]:
        """Each contact wire of those side by side, with what its steady arms hold."""
        first = self.contact, self.arm_force
        return (first,) if self.second is None else (first, (self.second, self.second_arm_force))

    def over(self, spans: int) -> StaticShape:
        """The same with arrays of the droppers of so many spans."""
        arrays: dict[str, Any] = {
            name: np.tile(getattr(self, name), spans // self.spans) for name in OF_DROPPERS
        }
        return replace(self, **arrays, spans=spans)


OF_DROPPERS = ("dropper_tension", "dropper_length", "dropper_stiffness", "dropper_mass")


def joined(layout: Layout, shapes: Sequence[StaticShape]) -> StaticShape:
    """The static shape of a whole line, whose wires are those in use, from that of each tension length."""
    parts = layout.tension_lengths
    limits = np.array([part.in_use[0] for part in parts[1:]])
    begins, whole = np.array([part.begin for part in parts]), (0.0, parts[-1].end)

    arrays: dict[str, Any] = {name: np.zeros(len(layout.droppers)) for name in OF_DROPPERS}
    for part, shape in zip(parts, shapes, strict=True):
        for name, values in arrays.items():
            values[part.droppers] = getattr(shape, name)
    return StaticShape(
        contact=InUse(limits, begins, tuple(shape.contact for shape in shapes), whole),
        messenger=InUse(limits, begins, tuple(shape.messenger for shape in shapes), whole),
        arm_force=np.zeros(0),
        **arrays,
        spans=len(layout.spans),
        ropes=tuple(
            Rope(part.begin + rope.places, rope.heights, part.wire)
            for part, shape in zip(parts, shapes, strict=True)
            for rope in shape.ropes
        ),
    )


def profiles(layout: Layout, shape: StaticShape) -> list[tuple[TensionLength, Profile, Profile]]:
    """Each tension length with its contact wire and its messenger at rest, along itself."""
    both = shape.contact, shape.messenger
    wires = [wire.profiles if isinstance(wire, InUse) else (wire,) for wire in both]
    return list(zip(layout.tension_lengths, *wires, strict=True))


FAR = 100.0  # height (m) at which a wire counts that is not there: no pantograph reaches it


def heights_of_pair(layout: Layout, shape: StaticShape, pair: int, x: Array, wire: int = CONTACT) -> Array:
    """Height of a pair's contact wire or messenger at positions x (m), (n,); ``FAR`` where it has none."""
    if not layout.line.overlaps:
        return (shape.contacts[pair][0], shape.messenger)[wire].height(x)
    found = np.full(len(x), FAR)
    for part, *both in profiles(layout, shape):
        if part.pair == pair:
            ours = (x >= part.begin) & (x <= part.end)
            found[ours] = both[wire].height(x[ours] - part.begin)
    return found
