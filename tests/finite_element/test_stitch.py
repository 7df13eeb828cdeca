"""Stitch wires in the finite elements: closed forms, equilibrium, limits, matrices, energy, convergence."""

import numpy as np
import pytest
from scipy.linalg import eigh

from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible.schema import StitchWire

from .contacts import Collector
from .energy import balance
from .rest import at_rest, pairs_of
from .sections import BARE, STITCHED_330, of_catalogue, sections, stitched
from .simulation import simulate
from .static import GRAVITY, static_shape
from .stitch import Stitch, Upper
from .system import build
from .whole_line import ClosedLine, built, designed

CLAMPED = STITCHED_330 | {"stitch_wire": STITCHED_330["stitch_wire"] | {"clamp_mass": 0.4}}
DROPPERS = {"mass": 0.1, "contact_clamp_mass": 0.2, "messenger_clamp_mass": 0.3}


def repeated(changes=CLAMPED, **droppers):
    line = stitched("re330", changes)
    return line.model_copy(update={"droppers": line.droppers.model_copy(update=DROPPERS | droppers)})


def two_droppers():
    """re330 with one dropper on either side between the clamps, 5 m from the support."""
    line = repeated()
    x, stitch = np.array(load_catenary("re330").droppers.positions), line.stitch_wire
    assert (x < stitch.length / 2).sum() == (65.0 - x < stitch.length / 2).sum() == 1
    droppers = line.droppers.model_copy(update={"positions": tuple(x.tolist()), "sag": (0.0,) * len(x)})
    return line.model_copy(update={"droppers": droppers})


def test_a_stitch_wire_hangs_as_a_string_under_two_droppers():
    """From the clamp at 9 m its slope carries the dropper at 5 m and its own weight up to the middle."""
    line = two_droppers()
    shape, stitch, droppers = static_shape(line, 0.5), line.stitch_wire, line.droppers
    below = shape.dropper_tension[0] + GRAVITY * (
        droppers.mass * shape.dropper_length[0] / 2 + droppers.messenger_clamp_mass
    )

    def sag(x):
        """Below the clamp, at x (m) from the support beyond the dropper (m)."""
        weight = stitch.mass * GRAVITY
        return ((below + weight * 9.0) * (9.0 - x) - weight * (9.0 - x) ** 2 / 2) / stitch.tension

    def at(x):
        return int(np.abs(shape.x - x).argmin())

    clamp = shape.hanger[at(9.0)]
    assert clamp == shape.messenger[at(9.0)]
    for x in (8.0, 7.0, 5.0):
        assert clamp - shape.hanger[at(x)] == pytest.approx(sag(shape.x[at(x)]), abs=1e-9)
    # Inside of both droppers it hangs in a parabola of its own.
    deepest = stitch.mass * GRAVITY * 5.0**2 / (2 * stitch.tension)
    assert shape.hanger[at(5.0)] - shape.hanger[0] == pytest.approx(deepest, abs=1e-9)
    assert shape.dropper_length[0] == pytest.approx(shape.hanger[at(5.0)] - shape.contact[at(5.0)], abs=1e-12)
    second = droppers.positions[1]
    assert shape.dropper_length[1] == pytest.approx(
        shape.messenger[at(second)] - shape.contact[at(second)], abs=1e-12
    )


def test_between_the_clamps_the_messenger_has_its_tension_less_the_stitch_wire_s():
    """Its curvature within and beyond the clamp, and the vertical equilibrium of the clamp itself."""
    line = two_droppers()
    wire, stitch = line.messenger_wire, line.stitch_wire
    shape, less = static_shape(line, 0.05), line.messenger_wire.tension - line.stitch_wire.tension
    load = wire.mass * GRAVITY

    def slope(x):
        return np.interp(x, shape.x, shape.messenger_slope)

    # The wire's stiffness is felt within some tenths of a metre of the clamp (decaying by e in 0.08 m).
    for begin, end, tension in ((3.0, 7.0, less), (10.0, 11.0, wire.tension)):
        assert (slope(end) - slope(begin)) / (end - begin) == pytest.approx(load / tension, rel=3e-4)
    clamp = int(np.abs(shape.x - 9.0).argmin())
    pull = np.diff(shape.hanger)[clamp - 1] / np.diff(shape.x)[clamp - 1]
    half = stitch.mass * GRAVITY * np.diff(shape.x)[clamp - 1] / 2  # of the last element, to the clamp
    held = wire.tension * slope(10.0) - less * slope(8.0)
    assert held == pytest.approx(
        stitch.tension * pull + half + GRAVITY * (2 * wire.mass + stitch.clamp_mass), rel=1e-4
    )


@pytest.mark.parametrize("holds", [False, True])
def test_supports_carry_the_weight_of_everything(holds):
    line = repeated()
    line = line.model_copy(update={"steady_arm": line.steady_arm.model_copy(update={"holds_wire": holds})})
    shape, droppers, stitch = static_shape(line, 0.5), line.droppers, line.stitch_wire
    own = droppers.mass * shape.dropper_length.sum()
    own += len(droppers.sag) * (droppers.contact_clamp_mass + droppers.messenger_clamp_mass)
    own += stitch.mass * stitch.length + 2 * stitch.clamp_mass + line.messenger_wire.mass * line.span_length
    carried = line.support.stiffness * (line.encumbrance - shape.messenger[0])
    if not holds:
        assert carried == pytest.approx(GRAVITY * (own + line.contact_wire.mass * line.span_length), rel=1e-7)
    lower = GRAVITY * (
        droppers.mass * shape.dropper_length.sum() / 2 + len(droppers.sag) * droppers.contact_clamp_mass
    )
    assert carried == pytest.approx(GRAVITY * own + shape.dropper_tension.sum() - lower, rel=1e-7)


def test_a_stitch_wire_goes_on_from_one_span_to_the_next():
    """Under droppers that are not alike on both sides of a support."""
    line = repeated(positions=(2.0, 7.0, 20.0, 32.5, 45.0, 61.5), sag=(0.0,) * 6)
    shape, stitch = static_shape(line, 0.5), line.stitch_wire
    assert shape.hanger[0] == pytest.approx(shape.hanger[-1], abs=1e-12)
    bend = np.diff(shape.hanger)[[0, -1]] / np.diff(shape.x)[[0, -1]]
    load = stitch.mass * GRAVITY * np.diff(shape.x)[[0, -1]].sum() / 2
    assert stitch.tension * (bend[0] - bend[1]) == pytest.approx(load, rel=1e-6)
    assert abs(bend.sum()) > 1e-4  # and its deepest place is not at the support


@pytest.mark.longer
def test_a_stitch_wire_alone_has_a_string_s_frequency_and_mass():
    wire, stitch = load_catenary("re330").messenger_wire, StitchWire(length=18.0, tension=3.5e3, mass=0.31)
    upper = Upper(np.linspace(0.0, 40.0, 401), wire, [Stitch(20.0, stitch)])
    own = np.arange(2 * 401, upper.size)  # between its clamps
    stiffness, mass = (each[own][:, own].toarray() for each in (upper.stiffness, upper.mass))
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:3]) / (2 * np.pi)
    expected = np.sqrt(stitch.tension / stitch.mass) / (2 * stitch.length) * np.arange(1, 4)
    assert frequencies == pytest.approx(expected, rel=1e-3)
    level = np.append(np.tile([1.0, 0.0], 401), np.ones(own.size))
    assert level @ upper.mass @ level == pytest.approx(40.0 * wire.mass + 18.0 * stitch.mass, rel=1e-12)
    assert upper.stiffness @ level == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_a_stitch_wire_of_no_tension_without_droppers_is_none():
    """At rest and in motion. Its clamps are at droppers, which then hang from the messenger."""
    usual = of_catalogue("re330")
    ghost = StitchWire.model_construct(length=10.0, tension=1e-3, mass=1e-7, clamp_mass=0.0)
    line = usual.model_copy(update={"stitch_wire": ghost})
    one, other = static_shape(line, 0.5), static_shape(usual, 0.5)
    assert one.hanger[1] < one.messenger[1] - 1e-6  # it is there
    np.testing.assert_allclose(one.messenger, other.messenger, atol=1e-6)
    np.testing.assert_allclose(one.dropper_tension, other.dropper_tension, atol=1e-5)
    np.testing.assert_allclose(one.dropper_length, other.dropper_length, atol=1e-7)
    runs = [simulate(each, load_pantograph("cx"), 250.0, spans=4) for each in (line, usual)]
    np.testing.assert_allclose(runs[0].contact_force, runs[1].contact_force, atol=1e-3)
    real = usual.model_copy(update={"stitch_wire": StitchWire(length=10.0, tension=3.5e3, mass=0.31)})
    assert (
        abs(simulate(real, load_pantograph("cx"), 250.0, spans=4).contact_force - runs[1].contact_force).max()
        > 3
    )


def test_every_support_has_its_own_span_s_stitch_wire_and_the_ends_have_none_in_motion():
    """Droppers hang from it between its clamps, elsewhere from the messenger; clamps' masses are there."""

    def line_of(clamp_mass, other, dropper_clamp=0.0):
        usual = {"stitch_wire": STITCHED_330["stitch_wire"] | {"clamp_mass": clamp_mass}}
        sequence = [{}, {}, {"stitch_wire": {"length": 12.0, "clamp_mass": other}}, BARE, {}]
        line = stitched("re330", usual | {"sequence": sequence})
        droppers = {"messenger_clamp_mass": dropper_clamp}
        return stitched(
            "re330", usual | {"sequence": [{"droppers": droppers} | span for span in line.sequence]}
        )

    line = line_of(0.4, 1.0)
    system, (rest,) = build(line, 5, 1.0), at_rest(line, 5, 1.0)
    rows = (system.extension[[k]] for k in range(len(rest.droppers)))
    upper_end = np.array([row.indices[row.data > 0][0] for row in rows])
    x = rest.nodes[rest.droppers]
    within = (abs(x - 65) < 9) | (abs(x - 130) < 6) | (abs(x - 260) < 9)
    assert (upper_end >= 4 * rest.nodes.size).tolist() == within.tolist()
    assert within.sum() == 10  # at 12 m only those at 2.5 m
    assert upper_end[~within].tolist() == (4 * rest.droppers[~within]).tolist()

    def heavier(*more):
        """Unknowns whose mass is less without something, and by how much."""
        added = (build(line_of(*more), 5, 1.0).mass - build(line_of(0.0, 0.0), 5, 1.0).mass).diagonal()
        return np.flatnonzero(abs(added) > 1e-9), added[abs(added) > 1e-9]

    where, by = heavier(0.4, 1.0)
    assert (where % 4 == 0).all()
    assert rest.nodes[where // 4] == pytest.approx([56, 74, 124, 136, 251, 269])
    assert by == pytest.approx([0.4, 0.4, 1.0, 1.0, 0.4, 0.4])
    where, by = heavier(0.0, 0.0, 0.3)
    assert where.tolist() == sorted(upper_end)
    assert by == pytest.approx(0.3)


def test_lengths_and_stiffnesses_of_droppers_hold_the_designed_shape():
    line = sections()["some-stitched"].line
    (pair,) = pairs_of(line)
    closed = ClosedLine(pair.spans, pair.end, line.wires, 0.5)
    shape, stiffness = designed(closed), np.full(len(closed.hung), 1e5)
    again = built(closed, shape.dropper_length - shape.dropper_tension / stiffness, stiffness)
    np.testing.assert_allclose(again.contact, shape.contact, atol=1e-8)
    np.testing.assert_allclose(again.hanger, shape.hanger, atol=1e-8)
    np.testing.assert_allclose(again.dropper_tension, shape.dropper_tension, atol=1e-3)


@pytest.mark.slow
def test_energy_is_balanced_under_stitch_wires():
    section = sections()["some-stitched"]
    found = balance(section.line, [Collector(section.pantograph)], section.speed_kmh, distance=420.0)
    assert found.steps_with_slack > 0
    assert found.error < 1e-3 * found.turnover


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="more tension than the messenger"):
        static_shape(stitched("re250", {"stitch_wire": {"length": 18.0, "tension": 16e3, "mass": 0.3}}))
    close = stitched(
        "re330", STITCHED_330 | {"sequence": [{}, {"span_length": 15.0, "droppers": {"spacing": 5}}, {}]}
    )
    with pytest.raises(ValueError, match="stitch wires at 65 and 80 m overlap"):
        at_rest(close, 3, 1.0)
