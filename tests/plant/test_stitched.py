"""Lines with stitch wires: their balance at rest, their energy in motion, and what they do to a line.

Finite elements of such lines are in ``tests/finite_element``.
"""

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.parameters import change
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.arrays import CONTACT, HUNG, LINK, MESSENGER, PAD, STITCH
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity
from panto_env.plant.catenary.flexible.defects import DefectiveLine
from panto_env.plant.catenary.flexible.static import hang
from panto_env.plant.catenary.flexible.wires import along, window_nodes
from panto_env.plant.line_condition import NEW, LineCondition

from .. import line_energy
from ..finite_element.sections import line_of as changed
from ..finite_element.sections import of_catalogue
from .test_flexible import PULSES, swing, undamped
from .test_uneven import energy as energy_of_wires

STITCH_WIRE = {"length": 18.0, "tension": 3500.0, "mass": 0.31, "clamp_mass": 0.4}
DROPPERS = {"positions": [2.5, 6.5, 14.0, 22.0, 30.5, 38.0, 46.0, 54.0, 59.0, 62.5], "sag": [0.0] * 10}
"""Not symmetric about the middle of the span."""
SPANS = 20


def line_of(spans=SPANS, droppers=DROPPERS, **changes):
    table = of_catalogue("re330").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    heavy = table["droppers"] | {"mass": 0.1, "contact_clamp_mass": 0.2, "messenger_clamp_mass": 0.3}
    table |= {"droppers": heavy | droppers, "stitch_wire": STITCH_WIRE}
    if "sequence" not in changes:
        table["spans"] = spans
    return FlexibleCatenaryData.model_validate(table | changes)


def written_out(height=1e-9, spans=SPANS, **changes):
    """Span by span, and not uniform for a height that does not matter."""
    return line_of(sequence=[{}] * 7 + [{"contact_height": height}] + [{}] * (spans - 8), **changes)


def test_shape_at_rest_is_that_of_each_span_written_out():
    one, all_of_them = hang(line_of()), hang(written_out())
    for name in ("dropper_tension", "dropper_length"):
        each = getattr(all_of_them, name).reshape(SPANS, -1)[2:-2]  # a mirrored end is not this span
        np.testing.assert_allclose(each, np.tile(getattr(one, name), (len(each), 1)), atol=2e-6)
    x = np.linspace(130.0, 1160.0, 3001)
    np.testing.assert_allclose(all_of_them.messenger.height(x), one.messenger.height(x), atol=1e-7)
    assert len(all_of_them.ropes) == SPANS + 1
    np.testing.assert_allclose(all_of_them.ropes[5].heights, one.ropes[0].heights, atol=1e-7)
    np.testing.assert_allclose(all_of_them.ropes[5].places, one.ropes[0].places + 5 * 65.0)


def test_a_support_carries_messenger_stitch_wire_clamps_and_droppers():
    line = line_of()
    shape, stitch, droppers = hang(line), line.stitch_wire, line.droppers
    mass = line.messenger_wire.mass * line.span_length + stitch.mass * stitch.length + 2 * stitch.clamp_mass
    mass += shape.dropper_mass.sum() / 2 + len(droppers.sag) * droppers.messenger_clamp_mass
    given_way = line.encumbrance - shape.messenger.height(np.zeros(1))[0]
    carried = 9.81 * mass + shape.dropper_tension.sum()
    assert given_way * line.support.stiffness == pytest.approx(carried, rel=1e-6)


def test_stitch_wire_makes_the_elasticity_even():
    (_, stitched), (_, plain) = (elasticity(each, 100.0) for each in (line_of(), line_of(stitch_wire=None)))
    assert non_uniformity(stitched) < 0.4 * non_uniformity(plain)
    assert stitched[0] > 2 * plain[0]  # at the support


def test_defects_at_rest_where_droppers_hang_from_stitch_wires():
    """A dropper that is too long carries less; a broken one nothing, and its neighbours carry its load."""
    line, dropper = line_of(), 11  # the second one of the second span, on the stitch wire
    new = DefectiveLine(line.layout(6), NEW).solve()
    assert abs(new.rise).max() < 1e-12
    broken = DefectiveLine(line.layout(6), LineCondition(broken_droppers=((2, 2),))).solve()
    assert broken.tension[dropper] == 0
    assert broken.tension.sum() == pytest.approx(new.tension.sum(), rel=0.02)
    assert (broken.tension[[dropper - 1, dropper + 1]] > new.tension[[dropper - 1, dropper + 1]] + 5).all()
    longer = LineCondition(miscut_droppers=((5, 9, 0.02),))
    written, again = (DefectiveLine(each.layout(9), longer).solve() for each in (written_out(spans=9), line))
    np.testing.assert_allclose(written.tension[20:-20], again.tension[20:-20], atol=1e-4)
    assert again.tension[48] < hang(line).dropper_tension[8] - 3


def energy(line, wire, data, step):
    """Energy (J) of the discrete line at mid-step, stitch wires included."""
    total = energy_of_wires(line, wire, data, step)
    scattered, held = line.scattered, wire.scattered
    both = along(wire.displacement[0]), along(wire.displacement[0] + wire.increment[0])
    old, now = (u[MESSENGER] for u in both)
    steps = np.diff(now)
    missing = data.layout().moving
    x = line.spacing * window_nodes(line.rows)
    total -= (missing.deficit(x[:-1], x[1:]) * steps * np.diff(old)).sum() / (2 * line.spacing)
    nodes = held.displacement.shape[1] // held.stitches.node.shape[1]
    sets = held.stitches.node.shape[1]
    for k, table in enumerate(scattered.stitches.constants):
        ropes = []
        for x_of, rope in ((now, held.displacement[0] + held.increment[0]), (old, held.displacement[0])):
            own = rope[k % sets * nodes : (k % sets + 1) * nodes, k // sets].copy()
            for end, clamp in ((0, 0), (-1, 1)):
                four = x_of[PAD + scattered.stitches.first[k, clamp] + np.arange(4)]
                own[end] = table[4 * clamp : 4 * clamp + 4] @ four
            ropes.append(own)
        pull, length = table[STITCH.PULL], missing.end[k] - missing.begin[k]
        total += pull * (np.diff(ropes[0]) * np.diff(ropes[1])).sum() / 2
        mass = missing.mass[k] * length / (nodes - 1) / table[STITCH.INERTIA + 1 : -1]
        total += (mass * (ropes[0] - ropes[1])[1:-1] ** 2).sum() / (2 * step**2)
    for number, table, first, upper, k in zip(
        scattered.hung.number,
        scattered.hung.constants,
        scattered.hung.first[:, 0],
        scattered.upper,
        scattered.carrying,
        strict=True,
    ):
        row, column = k % sets * nodes + upper, k // sets
        ropes_at = held.displacement[0], held.displacement[0] + held.increment[0]
        extensions = [
            table[HUNG.UPPER : HUNG.MOVE] @ rope[row : row + 2, column]
            - table[:4] @ u[CONTACT, PAD + first + np.arange(4)]
            for u, rope in zip(both, ropes_at, strict=True)
        ]
        stiffness = table[LINK.PULL : LINK.PULL + 3].sum()
        total += line_energy.of_droppers(*extensions, stiffness, line.link_static[0, number])
    return total


@PULSES
@pytest.mark.slow
def test_undamped_line_keeps_its_energy_for_10_s(height, goes_slack, bar):
    moved = []

    def watched(line, wire, data, step):
        moved.append(np.abs(wire.scattered.displacement).max())
        return energy(line, wire, data, step)

    assert swing(undamped(line_of(spans=9)), 9, 190.0, height, goes_slack, watched)[0] < bar
    assert max(moved) > 0.2 * height


@pytest.mark.longer
@pytest.mark.parametrize("settings", [{"window": 0}, {"line_condition": "as-built", "seed": 3}], ids=str)
def test_uniform_and_written_out_lines_move_alike(settings):
    """The window travels; defects and other tensions are the same."""
    one, other = (
        simulate(each, "dsa380", 300.0, distance=9 * 65.0, spans=SPANS, precision="double", **settings)
        for each in (line_of(), written_out())
    )
    after = one.position > 130  # at the mirrored start droppers have other lengths
    np.testing.assert_allclose(other.contact_force[after], one.contact_force[after], atol=0.02)
    np.testing.assert_allclose(other.uplift, one.uplift, atol=1e-5)
    assert one.contact_force.std() > 10


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tension": 20e3}, "more than 90 % of the messenger's 21000 N"),
        ({"length": 14.0}, "a dropper 0.5 m from its clamp"),
        ({"mass": 0.05, "tension": 9000}, "too coarse for the stitch wires"),
    ],
)
def test_stitch_wires_that_do_not_go_with_the_line_are_refused(changes, message):
    line = line_of(stitch_wire=STITCH_WIRE | changes)
    with pytest.raises(InputError, match=message):
        simulate(line, "dsa380", 300.0, distance=200)


def test_stitch_wires_that_reach_each_other_are_refused():
    droppers = {"positions": [3.0, 15.0], "sag": [0.0] * 2}
    short = line_of(span_length=18.0, droppers=droppers, stitch_wire=STITCH_WIRE)
    with pytest.raises(InputError, match="reaches to the one before it"):
        hang(short)


def test_droppers_almost_at_places_of_a_stitched_line_hang_as_droppers_there():
    """Near mid-span, a clamp, or the least distance from it: up to 1e-5 m they were metres too long."""
    random = np.random.default_rng(7)
    for _ in range(12):
        span, half = float(random.uniform(48, 70)), float(random.uniform(6, 10))
        inner = np.linspace(half, span / 2, int(random.integers(3, 6)))  # the first at the clamp
        left = np.array([half - 4.5, half - 1.0, *inner])
        places = np.append(left, span - left[-2::-1])
        sag = [0.0] * len(places)
        stitch = STITCH_WIRE | {"length": 2 * half, "tension": float(random.uniform(2000, 4000))}
        moved = places + random.choice([-1, 1], len(places)) * 10.0 ** random.uniform(-15, -5, len(places))
        lines = [
            line_of(span_length=span, droppers={"positions": x.tolist(), "sag": sag}, stitch_wire=stitch)
            for x in (places, moved)
        ]
        there, near = map(hang, lines)
        np.testing.assert_allclose(near.dropper_length, there.dropper_length, atol=1e-5)
        np.testing.assert_allclose(near.dropper_tension, there.dropper_tension, atol=1e-2)
        assert abs(DefectiveLine(lines[1].layout(5), NEW).solve().rise).max() < 1e-9


@pytest.mark.parametrize("name", ["re250-stitched", "re330-stitched"])
def test_spans_of_another_length_keep_their_droppers_on_the_stitch_wire(name):
    """In a sequence, and where all spans are changed."""
    base = load_catenary(name)
    for length in (40.0, 54.0, 63.0, 75.0):
        line = changed(name, {"sequence": [{}, {}, *[{"span_length": length}] * 2, {}, {}]})
        hang(line)
        for droppers in (
            line.layout().spans[2].droppers,
            change(base, "catenary.span_length", length).droppers,
        ):
            x = np.array(droppers.positions)
            kept = base.droppers.positions[:2]  # a stitch wire of 18 m ends 9 m from the support
            assert x[:2].tolist() == [*kept]
            np.testing.assert_allclose(length - x[[-1, -2]], kept)
            between = np.diff(x[1:-1])
            np.testing.assert_allclose(between, between[0])
            assert 6 < between[0] < 12


def test_the_last_support_may_have_no_stitch_wire():
    bare = line_of(sequence=[{}] * 8, end_support={"stitch_wire": {"length": 0.0}})
    assert bare.sequence
    assert bare.layout().stitches.support.tolist() == list(range(8))
    assert len(hang(bare).ropes) == 8
    same = line_of(sequence=[{}] * 8, end_support={"stitch_wire": {"length": 18.0}})
    assert same == line_of(spans=8).model_copy(update={"sources": same.sources})
