"""Several collectors on one line: the judge itself, and the simulator beside it.

``python -m tests.finite_element --trains`` prints what is compared here, and draws it.
"""

import numpy as np
import pytest

from panto_env.catalog import load_catenary, load_pantograph

from ..marks import some_in_proofs
from . import __main__ as comparison
from .contacts import Collector
from .energy import balance
from .figures import figures
from .sections import line_of, overlap
from .simulation import ride, ride_together
from .system import build
from .trains import Case, cases

REFERENCE, DSA = load_pantograph("en50318-2002"), load_pantograph("dsa380")
LINE = load_catenary("en50318-2002").model_copy(update={"spans": 5})
SHORT = Case(
    LINE.model_copy(update={"spans": 8}),
    (Collector(REFERENCE), Collector(DSA, 80.0)),
    250.0,
    spans=(3, 5),
    element=0.35,
)
"""Quick: a few spans, and little of what the first collector leaves behind."""
CASES = cases()


@pytest.fixture(scope="module")
def system():
    return build(LINE, LINE.spans, 1.0)


def share(pantograph, part):
    """A pantograph of which several make up one."""
    scaled = {
        key: tuple(part * value for value in getattr(pantograph, key))
        for key in ("masses", "stiffnesses", "dampings")
    }
    single = ("static_force", "aerodynamic_coefficient", "contact_stiffness", "contact_damping")
    return pantograph.model_copy(update=scaled | {key: part * getattr(pantograph, key) for key in single})


@pytest.mark.slow
def test_unequal_parts_side_by_side_are_one_pantograph(system):
    """What a contact's force does to another within the step, droppers slack or not, contact lost or not."""
    whole = DSA.model_copy(update={"contact_damping": 150.0, "aerodynamic_coefficient": 0.0})
    pieces = [Collector(share(whole, part)) for part in (0.2, 0.5, 0.3)]
    one = ride(system, whole, 350.0, 1e-3, distance=270.0)
    parts = ride_together(system, pieces, 350.0, 1e-3, distance=270.0)
    for own, part in zip(parts, (0.2, 0.5, 0.3), strict=True):
        np.testing.assert_allclose(own.contact_force, part * one.contact_force, atol=1e-4)
        for key in ("head", "wire", "uplift", "position"):
            np.testing.assert_allclose(getattr(own, key), getattr(one, key), atol=1e-8)
    assert (one.dropper_tension == 0).any()
    assert (one.contact_force == 0).any()


@pytest.mark.slow
def test_a_collector_that_waits_is_at_rest_and_then_runs_as_if_it_had_been_the_first(system):
    """720 steps of 69 mm are 50 m."""
    first, later = ride(system, DSA, 250.0, 1e-3), ride_together(system, [Collector(DSA, 50.0)], 250.0, 1e-3)
    (later,) = later
    assert later.position[0] == -50.0
    np.testing.assert_allclose(later.contact_force[:721], first.contact_force[0], atol=1e-9)
    np.testing.assert_allclose(later.head[:721], first.head[0], atol=1e-12)
    assert (later.uplift[:721] == 0).all()
    steps = later.time.size - 720
    for key in ("contact_force", "wire", "position"):
        np.testing.assert_allclose(getattr(later, key)[720:], getattr(first, key)[:steps], atol=1e-6)


@pytest.mark.slow
def test_the_first_collector_feels_the_second_only_once_that_is_on_the_line(system):
    alone = ride(system, REFERENCE, 250.0, 1e-3)
    first, second = ride_together(system, [Collector(REFERENCE), Collector(DSA, 50.0)], 250.0, 1e-3)
    np.testing.assert_allclose(first.contact_force[:721], alone.contact_force[:721], atol=1e-9)
    assert abs(first.contact_force - alone.contact_force)[1500:].max() > 2.0
    assert np.ptp(second.contact_force[:721]) < 1e-9
    assert np.array_equal(first.uplift, second.uplift)
    # The second one meets a wire that moves: it does not run as a first one does.
    itself = ride(system, DSA, 250.0, 1e-3).contact_force[: second.time.size - 720]
    assert abs(second.contact_force[720:] - itself)[1500:].max() > 20.0


@pytest.mark.slow
def test_energy_is_balanced_under_two_collectors_through_an_overlap():
    """The first has both wires above it before the second has. The error is of second order in the step."""
    line = line_of("re330", overlap(2, 0.1, 0.5) | {"sequence": [{}] * 5})
    train = [Collector(DSA), Collector(REFERENCE, 40.0)]
    coarse, fine = (balance(line, train, 280.0, distance=260.0, step=step) for step in (1e-3, 2.5e-4))
    assert fine.steps_with_slack > 0
    assert (fine.wire_forces > 0).all(axis=2).any(axis=0).all()
    assert fine.error < 3e-4 * fine.turnover
    assert fine.error < coarse.error / 9  # droppers that slacken make single halvings give 2.9 to 4.9


@pytest.mark.slow
def test_contact_force_and_uplift_of_two_pantographs_are_those_of_finite_elements():
    agrees(SHORT)


@pytest.mark.parametrize("name", some_in_proofs(CASES, ["unlike-330"]))
def test_every_train_agrees_with_finite_elements(name):
    agrees(CASES[name])


@pytest.mark.study
@pytest.mark.parametrize("name", ["100m-250", "200m-300"])
def test_half_of_element_and_step_change_the_figures_of_trains_little(name):
    case = CASES[name]
    coarse, fine = (case.by_finite_elements(share * case.element) for share in (1.0, 0.5))
    near(coarse, fine, case, 0.01)


@pytest.mark.slow
def test_both_codes_are_printed_and_drawn_train_by_train(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(comparison, "cases", lambda: {"short": SHORT})
    monkeypatch.setenv("COLUMNS", "170")
    comparison.compare_trains(tmp_path / "pictures", element=1.0)
    rows = [line.split("│")[1:-1] for line in capsys.readouterr().out.splitlines() if "short" in line]
    assert [row[1].strip() for row in rows] == ["1: en50318-2002"] * 2 + ["2: dsa380"] * 2
    assert [len(row[8].split()) for row in rows] == [4, 4, 0, 0]
    ours, theirs = (
        [float(each) for row in rows[k::2] for each in [*row[3:5], *row[8].split()]] for k in (0, 1)
    )
    assert ours == pytest.approx(theirs, abs=1.5)
    assert (tmp_path / "pictures" / "short.png").read_bytes().startswith(b"\x89PNG")


def agrees(case):
    near(case.by_simulator(), case.by_finite_elements(), case, 0.02)


def near(ours, theirs, case, sigma):
    """Sigma within a share; mean, maximum, minimum within 2 % of F_m; uplift at each support within 1 mm.

    Of collectors behind the first, the minimum is within 4 N and the contact loss within one point: small
    errors of the phase at which they meet the waves of those ahead grow there.
    """
    for number, (one, other) in enumerate(zip(ours, theirs, strict=True)):
        own, judged = figures(one, case.spans), figures(other, case.spans)
        two_percent = 0.02 * judged.mean
        assert own.std == pytest.approx(judged.std, rel=sigma)
        assert own.mean == pytest.approx(judged.mean, abs=two_percent)
        assert own.maximum == pytest.approx(judged.maximum, abs=two_percent)
        assert own.minimum == pytest.approx(judged.minimum, abs=4.0 if number else two_percent)
        assert own.loss_percent == pytest.approx(judged.loss_percent, abs=1.0 if number else 0.1)
        assert own.uplifts_mm == pytest.approx(judged.uplifts_mm, abs=1.0)
        assert len(own.uplifts_mm) == case.spans[1] - case.spans[0] + 2
