"""Several pantographs on one wire: what must be the same whatever the waves between them do."""

import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.catenary.flexible import build
from panto_env.plant.catenary.flexible.model import FlexibleCatenary
from panto_env.plant.catenary.flexible.near import near_droppers
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.state import Row
from panto_env.plant.train import Train

from ..finite_element.sections import sections

LINE = load_catenary("en50318-2002")
ONE, OTHER = load_pantograph("en50318-2002"), load_pantograph("dsa250")
SPEED = 250 / 3.6


def run(train, metres, *, line=LINE, spans=None, lanes=1, static_forces=None, train_length=None, **numerics):
    """A plant after the first collector has run some metres, and the samples of all."""
    length = train.length if train_length is None else train_length
    runs = Runs((SPEED, SPEED), train_length=length)
    plant = Plant(line, train, lanes=lanes, spans=spans, runs=runs, numerics=Numerics(**numerics))
    plant.start(np.arange(lanes), SPEED, static_forces=static_forces)
    steps = int(metres / (SPEED * plant.time_step))
    samples = plant.samples(steps + 1)
    plant.advance_passively(steps, samples)
    return plant, samples.rows[:, 1:]


def forces(rows, collector=0, lane=0):
    return rows[lane, :, collector, Row.CONTACT_FORCE]


def part(pantograph, share):
    """A pantograph with a share of everything, its contact spring included."""
    shared = {
        name: tuple(share * value for value in getattr(pantograph, name))
        for name in ("masses", "stiffnesses", "dampings")
    }
    names = ("contact_stiffness", "contact_damping", "static_force", "aerodynamic_coefficient")
    return pantograph.model_copy(update=shared | {name: share * getattr(pantograph, name) for name in names})


@pytest.mark.slow
@pytest.mark.parametrize("name", ["en50318-2002", "overlap-2002"])
def test_parts_of_a_pantograph_at_one_place_are_the_pantograph(name, monkeypatch):
    """But for what each knows of its own force only: the wire after the step, and what the grid lacks."""
    monkeypatch.setattr(FlexibleCatenary, "contact_share", 0.0)
    exact = lambda *given: (near := near_droppers(*given))._replace(own=np.zeros_like(near.own))  # noqa: E731
    monkeypatch.setattr(build, "near_droppers", exact)
    line = sections()[name].line if name == "overlap-2002" else load_catenary(name)
    metres = line.alignment().length - 60 if line.sequence else 200.0
    given = {"metres": metres, "line": line, "spans": line.spans if line.sequence else 6}
    _, whole = run(Train.of(part(ONE, 1.0)), **given, precision="double")
    shares = (0.3, 0.7)
    parts = Train.of(*(part(ONE, share) for share in shares), distances=[0.0])
    _, rows = run(parts, **given, precision="double")
    assert forces(whole).std() > 10
    for collector, share in enumerate(shares):
        np.testing.assert_allclose(forces(rows, collector), share * forces(whole), atol=1e-6)


@pytest.mark.longer
def test_two_at_one_place_may_be_named_in_either_order():
    train = [Train.of(*pair, distances=[0.0]) for pair in ((ONE, OTHER), (OTHER, ONE))]
    rows = [run(each, 150.0, spans=5, precision="double")[1] for each in train]
    assert np.abs(forces(rows[0], 0) - forces(rows[0], 1)).max() > 5
    for collector in (0, 1):
        np.testing.assert_allclose(forces(rows[0], collector), forces(rows[1], 1 - collector), atol=1e-6)


@pytest.mark.longer
def test_one_that_never_touches_changes_no_bit_of_the_other():
    distance = 35.0
    alone = run(Train.of(ONE), 300.0, spans=8, train_length=distance)[1]
    released = OTHER.static_force - OTHER.nominal_force(SPEED) - 50.0
    static_forces = np.array([[ONE.static_force], [released]])
    train = Train.of(ONE, OTHER, distances=[distance])
    both = run(train, 300.0, spans=8, static_forces=static_forces)[1]
    assert not forces(both, 1).any()
    assert forces(alone).std() > 10
    np.testing.assert_array_equal(forces(both, 0), forces(alone))


@pytest.mark.slow
def test_far_behind_on_a_line_that_damps_its_waves_it_is_the_only_one():
    """With the line's real damping it is not: 840 m behind sigma is half as large again."""

    def compared(line, metres=900.0):
        plant, rows = run(Train.of(ONE), metres, line=line, spans=40, train_length=840.0)
        stride = SPEED * plant.time_step
        behind = round(840.0 / stride)  # whole steps, so that both are computed at the same places
        train = Train.of(ONE, ONE, distances=[behind * stride])
        _, both = run(train, metres + behind * stride, line=line, spans=40)
        count = rows.shape[1]
        each = forces(rows), forces(both, 1)[behind : behind + count], forces(both, 0)[:count]
        return [low_pass(force, plant.time_step)[count // 3 :] for force in each]

    damped = LINE.model_copy(update={"damping": LINE.damping.model_copy(update={"alpha": 4.0})})
    alone, second, first = compared(damped)
    np.testing.assert_allclose(first, alone, atol=1e-3)
    assert np.abs(second - alone).max() < 0.01
    assert alone.std() > 20
    alone, second, first = compared(LINE)
    np.testing.assert_allclose(first, alone, atol=1e-3)  # no wave from behind has reached it yet
    assert second.std() > 1.3 * alone.std()


@pytest.mark.longer
def test_it_waits_at_rest_until_it_comes_onto_the_line():
    distance = 120.0
    plant, rows = run(Train.of(ONE, OTHER, distances=[distance]), 400.0, spans=12)
    x = plant.position(0, np.arange(rows.shape[1]) + 0.5, 1)
    own = rows[0, :, 1]
    waiting = x < 0
    assert 0 < waiting.sum() < len(x)
    assert np.ptp(own[waiting, Row.CONTACT_FORCE]) < 1e-6
    alone = Plant(LINE, Train.of(OTHER), spans=12, runs=plant.runs)
    alone.start(0, SPEED)
    assert own[0, Row.CONTACT_FORCE] == pytest.approx(alone.of(0, Row.CONTACT_FORCE), abs=1e-6)
    assert np.ptp(own[~waiting, Row.CONTACT_FORCE]) > 20


@pytest.mark.longer
def test_lanes_of_trains_are_bit_for_bit_the_single_train():
    train = Train.of(ONE, OTHER, ONE, distances=[50.0, 120.0])
    alone, lanes = (run(train, 200.0, spans=6, lanes=count)[1] for count in (1, 2))
    for lane in range(2):
        np.testing.assert_array_equal(lanes[lane], alone[0])


@pytest.mark.longer
def test_pantographs_of_different_kinds_keep_their_own_equations():
    """Far apart on a damped line, each is as if alone, whatever number of masses the other has."""
    three = load_pantograph("three-mass")
    assert len(three.masses) != len(ONE.masses)
    line = LINE.model_copy(update={"damping": LINE.damping.model_copy(update={"alpha": 4.0})})
    for first, second in ((ONE, three), (three, ONE)):
        distance, way = 480.0, 200.0
        _, both = run(Train.of(first, second, distances=[distance]), distance + way, line=line, spans=16)
        plant, alone = run(Train.of(second), way, line=line, spans=16, train_length=distance)
        own = forces(both, 1)[-len(forces(alone)) :]
        assert plant.position(0, len(forces(alone)))[0] == pytest.approx(way, abs=0.2)
        assert abs(own.mean() - forces(alone).mean()) < 0.5
        assert abs(own.std() - forces(alone).std()) < 0.5


def test_a_line_without_waves_carries_one_pantograph():
    massless = load_catenary("periodic-stiffness")
    with pytest.raises(InputError, match=r"need a flexible catenary.*'periodic-stiffness' is neither"):
        Plant(massless, Train.of(ONE, ONE, distances=[50.0]))
