"""What a fit begins with: the true line's force is the record's, its derivatives, a record's place."""

from dataclasses import replace

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary
from panto_env.fitting import problem as preparing
from panto_env.fitting.fit import fit
from panto_env.fitting.problem import END, LEAD, problem
from panto_env.fitting.stored import knowledge
from panto_env.fitting.tables import remarks
from panto_env.fitting.values import TOLERANCES
from panto_env.metrics.figures import FIRST_SETTLED
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.line_condition import LineCondition
from panto_env.records.measured import measured
from panto_env.records.record import Record

from .conftest import BUILT, SEED, SPANS, record_of


def moved(record, by):
    """The record with other positions."""
    (piece,) = record.pieces
    return replace(record, pieces=(replace(piece, position=piece.position + by),))


def force_of(fitting, x):
    (part,) = fitting.parts
    return fitting.sampled(part, [fitting.values.variant(x, 70.0)])[0]


@pytest.fixture(scope="module")
def exact(record, design, pantograph, coarse):
    """The same fit in double precision, for differences of a micrometre."""
    with pytest.MonkeyPatch.context() as patch:
        numerics = preparing.NUMERICS.model_copy(update={"precision": "double"})
        patch.setattr(preparing, "NUMERICS", numerics)
        return problem([record], design, pantograph)


@pytest.fixture(scope="module")
def derivatives(exact):
    """Jacobian of coefficients at the design, and the residual there."""
    fitting = exact
    small = np.diag([1e-5 if value.kind == "tensions" else 1e-6 for value in fitting.values.all])
    _, jacobian, residual = fitting.derivatives(fitting.start(), small, "fine", lambda doing: None)
    return jacobian, residual


def test_where_things_are(ready, design):
    plan = ready.values.design
    begins = 60.0 * np.arange(plan.spans)
    np.testing.assert_allclose(plan.layout.positions, (begins[:, None] + design.droppers.positions).ravel())
    np.testing.assert_allclose(plan.layout.supports[1:-1], begins[1:])
    assert ready.values.design.first_span == 0
    assert ready.stretch[0] == 60.0 * (FIRST_SETTLED - 1)
    assert 60.0 * SPANS - 25 < ready.stretch[1] < 60.0 * SPANS - 20
    assert ready.shifts == (0.0,)
    told = sum(len(part.measured.compared) for part in ready.parts)
    assert told < 2 * len(ready.values)
    assert f"{told} coefficients for {len(ready.values)} values" in ready.notes[-1]


def test_the_true_line_gives_the_force_of_a_record_without_noise(ready, truth, design, pantograph):
    """Index by index: no value stands in another's place, or with another sign."""
    clean = record_of(line_condition=BUILT, seed=SEED, force_noise=0.0)
    fitting = problem([clean], design, pantograph)
    x = np.array([truth.of(value) for value in fitting.values.all])
    (part,) = fitting.parts
    away = part.measured.force() - force_of(fitting, x)
    assert away.std() < 0.01  # beyond the last value the true line differs from the fit's
    assert (part.measured.force() - force_of(fitting, 0 * x)).std() > 10


@pytest.mark.longer
def test_records_of_several_tension_lengths_are_noted(pantograph):
    """On this line trains pass to other wires at 1070 m."""
    line = load_catenary("sweden-st15-bridge")
    run = simulate(line, pantograph, 180.0, accuracy="fast", distance=1200.0, record_droppers=False)
    (piece,) = measured(run).pieces
    for last, found in ((1200.0, True), (1080.0, False)):
        count = int(np.sum(piece.position < last))
        own = {"position": piece.position[:count], "force": piece.force[:count]}
        cut = replace(piece, height=None, uplift=None, **own)
        notes = problem([Record("run", (cut,))], line, pantograph).notes
        assert any("2 tension lengths" in note for note in notes) is found


def test_a_wheel_that_reads_too_much_is_found_roughly(ready, record, design, pantograph):
    assert abs(ready.scales[0]) < 8e-4
    (piece,) = record.pieces
    worn = replace(record, pieces=(replace(piece, position=1.002 * piece.position),))
    fitting = problem([worn], design, pantograph)
    assert fitting.scales[0] == pytest.approx(-0.002, abs=8e-4)  # 300 m are compared, on the design
    x = fitting.start().x
    assert fitting.sensors(x)[3] == fitting.scales
    measured_there, away = fitting.measured(0, x), fitting.measured(0, 0 * x)
    expected = fitting.as_designed()[0]
    assert np.corrcoef(measured_there, expected)[0, 1] > np.corrcoef(away, expected)[0, 1]
    faster = fitting.at_speeds(x).parts[0]
    assert faster.fine.speed == faster.coarse.speed == faster.measured.piece.speed * (1 + fitting.scales[0])


@pytest.mark.slow
def test_derivatives_of_all_droppers_add_up(exact, derivatives):
    """A smooth shift of all droppers, which a force hardly shows, is the sum of columns that nearly cancel.

    So nothing is lost where a pass goes on, in other lanes, from shortly before what differs.
    """
    values, (part,) = exact.values, exact.parts
    which = values.of_kind("droppers")
    places = np.array([values.all[k].place for k in which])
    d = np.zeros(len(values))
    d[which] = np.sin(np.pi * (places - places[0]) / np.ptp(places))
    small = 1e-6 * d
    change = force_of(exact, small) - force_of(exact, -small)
    actual = part.measured.coefficients(change) / 2e-6
    summed = derivatives[0][:, : len(values)] @ d
    np.testing.assert_allclose(summed, actual, atol=0.05 * np.linalg.norm(actual) / np.sqrt(len(actual)))
    single = np.median(np.linalg.norm(derivatives[0][:, which], axis=0))
    assert np.linalg.norm(actual) < 3 * single  # 130 of them cancel


@pytest.mark.parametrize(
    ("kind", "which", "size"), [("tensions", -1, 1e-5), ("supports", 10, 1e-6), ("unevenness", -2, 1e-6)]
)
@pytest.mark.slow
def test_derivatives_of_one_value(exact, derivatives, kind, which, size):
    """At the last unevenness, -1, a dropper is just about to slacken: there both sides differ by 6 %."""
    values, (part,) = exact.values, exact.parts
    number = values.of_kind(kind)[which]
    x = size * np.eye(len(values))[number]
    change = force_of(exact, x) - force_of(exact, -x)
    actual = part.measured.coefficients(change) / (2 * size)
    assert np.linalg.norm(derivatives[0][:, number] - actual) < 0.02 * np.linalg.norm(actual)


@pytest.mark.parametrize("which", [-4, -3, -2, -1])
@pytest.mark.slow
def test_derivatives_of_a_records_own_values(ready, derivatives, which):
    """What is left falls by the derivative times either, with the static force that follows the mean."""
    fitting = ready
    x = np.zeros((3, len(fitting.prior)))
    x[1:, which] = 0.2 * fitting.prior[which] * np.array([-1, 1])
    _, low, high = fitting.residuals(fitting.start(), x)
    column = derivatives[0][:, which]
    change = (low - high) / (x[2] - x[1])[which]
    assert np.linalg.norm(column - change) < 0.2 * np.linalg.norm(column)  # the force bends
    assert np.linalg.norm(column) > 3


@pytest.mark.parametrize("by", [-7.5, 12.3])
def test_a_position_error_is_found(record, ready, design, pantograph, by):
    """Roughly, before any step; steps find the rest (``test_fit``)."""
    found = problem([moved(record, by)], design, pantograph, free=("tensions",))
    assert found.shifts[0] == pytest.approx(-by, abs=0.3)
    away = found.parts[0].measured
    seen = away.force(-by - found.shifts[0])
    same = np.interp(away.place, ready.parts[0].measured.place, ready.parts[0].measured.force())
    np.testing.assert_allclose(seen[5:-20], same[5:-20], atol=1.0)


@pytest.fixture(scope="module")
def long_record():
    """A record of 74 spans."""
    return record_of(line_condition=BUILT, seed=SEED, spans=90, distance=74 * 60.0)


def cut_from(whole, first, last, shift=0.0):
    """The record between two supports, its places less a shift (m)."""
    (piece,) = whole.pieces
    inside = (piece.position >= 60.0 * first) & (piece.position < 60.0 * last)
    cut = replace(piece, position=piece.position[inside] - shift, force=piece.force[inside])
    return replace(whole, pieces=(cut,))


@pytest.mark.longer
def test_a_record_from_far_along_the_line(long_record, pantograph, design):
    """60 spans on, a record is held against a pass that begins before it, of spans named by their place."""
    far = problem([cut_from(long_record, 60, 74)], design, pantograph, free=("droppers",))
    assert far.values.design.first_span == 60 - LEAD
    assert abs(far.shifts[0]) < 0.3
    own, skipped = far.parts[0].measured, 60.0 * LEAD
    assert own.place[0] == pytest.approx(skipped + END, abs=0.5)
    names = [value.name for value in far.values.all]
    # Nine spans before what is compared, which begins 20 m behind the first support.
    assert names[0] == f"dropper 4 of span {60 - FIRST_SETTLED + 2}"


def test_a_simulated_record_may_begin_at_rest_anywhere(record, ready, design, pantograph):
    """Its places may be chainages: the start is found where it is, and what is compared is the same."""
    far = problem([moved(record, 60 * 60.0)], design, pantograph, free=("droppers",))
    assert far.values.design.first_span == 60
    assert far.shifts == ready.shifts
    own, same = far.parts[0].measured, ready.parts[0].measured
    np.testing.assert_allclose(own.place, same.place)
    np.testing.assert_allclose(own.force(), same.force(), rtol=1e-6)


@pytest.mark.longer
def test_a_measured_pass_has_settled_at_the_line_s_first_support(long_record, pantograph, design):
    """A record that begins there is held against whichever it is like: a start at rest, or a settled pass."""
    for spans, first_span in ((0, 0), (50, -LEAD)):
        cut = cut_from(long_record, spans, spans + SPANS, 60.0 * spans)
        found = problem([cut], design, pantograph, free=("droppers",))
        assert found.values.design.first_span == first_span
        assert found.before == 60.0 * first_span
        # What is compared has its places on the line.
        begins = 60.0 * (FIRST_SETTLED - 1) if spans == 0 else END
        assert found.before + found.stretch[0] == pytest.approx(begins, abs=1.0)


@pytest.mark.parametrize("short_of", [25.0, -25.0])
def test_an_end_of_a_record_is_not_compared_though_it_is_moved(long_record, pantograph, design, short_of):
    """A record from the midst of a line, whose odometer is 25 m off."""
    cut = cut_from(long_record, 60, 74, short_of)
    found = problem([cut], design, pantograph, free=("tensions",))
    assert found.shifts[0] == pytest.approx(short_of, abs=0.5)
    own = found.parts[0].measured
    position = own.piece.position - own.offset
    assert position[0] + END - 1e-6 <= own.place[0]
    assert own.place[-1] <= position[-1] - END + 1e-6


def test_what_was_found_before_is_moved_with_the_spans(record, design, pantograph):
    """A line of which dropper 3 of span 70 is known to be broken, and others outside what is simulated."""
    known = LineCondition(
        broken_droppers=((70, 3), (5, 1)), raised_supports=((65, 0.004), (2, 0.01), (400, 0.01)), ice=0.1
    )
    line = design.model_copy(update={"as_found": known})
    far = problem([moved(record, 60 * 60.0)], line, pantograph, free=("tensions",))
    condition = far.values.design.condition
    assert condition.broken_droppers == ((70 - far.values.design.first_span, 3),)
    assert condition.raised_supports == ((65 - far.values.design.first_span, 0.004),)
    assert condition.ice == 0.1
    assert condition.tension_scatter == TOLERANCES["tensions"]


def test_what_a_record_says_of_itself_and_a_filter_taken_for_granted_are_among_the_notes(
    record, design, pantograph
):
    """Of a record whose positions are in whole decimetres, which are no changes of speed."""
    (piece,) = record.pieces
    behind = low_pass(piece.force, piece.time_step)
    coarse = replace(piece, position=np.round(piece.position, 1), force=behind)
    said = Record("May", (coarse,), ("Positions are the integral of the speed.",))
    found = problem([said], design, pantograph, free=("tensions",))
    assert found.parts[0].measured.piece is coarse
    note, filtered = found.of_records
    assert note == "May: Positions are the integral of the speed."
    assert filtered.startswith("May was low-passed before it was recorded, and is taken as behind EN 50317's")


@pytest.mark.longer
def test_what_cannot_be_fitted_is_refused(record, design, pantograph):
    with pytest.raises(InputError, match="run and copy hold the same forces; give each pass once"):
        problem([record, replace(record, name="copy")], design, pantograph)
    with pytest.raises(InputError, match=r"at most 0\.1 of the design's, not 0\.3"):
        problem([record], design, pantograph, tolerances={"tensions": 0.3})
    with pytest.raises(
        InputError, match="Only flexible lines can be fitted, and 'periodic-stiffness' is none"
    ):
        problem([record], load_catenary("periodic-stiffness"), pantograph)
    with pytest.raises(InputError, match=r"run from -500 to .* add what their positions are short of"):
        problem([moved(record, -500.0)], design, pantograph)
    ending = load_catenary("re250-curves")
    with pytest.raises(InputError, match="add what their positions are short of"):
        problem([moved(record, ending.alignment().length)], ending, pantograph)
    (piece,) = record.pieces
    half = len(piece.force) // 2
    short = replace(piece, position=piece.position[:half], force=piece.force[:half])
    with pytest.raises(InputError, match=r"No record can be compared\. run is left out: It has only 0 m"):
        problem([replace(record, pieces=(short,))], design, pantograph)
    named = replace(record, name="b", pieces=(replace(short, run="May"),))
    both = problem([record, named], design, pantograph, free=("tensions",))
    assert both.of_records[0].startswith("b (run 'May') is left out: It has only")
    assert len(both.of_records) == len(both.parts) == 1  # and nothing is said of the other one


@pytest.mark.longer
def test_a_record_of_another_line_is_called_strange_in_the_file_of_the_fit_too(record, pantograph):
    found = fit([record], load_catenary("re250"), pantograph, free=("tensions",))
    assert any(note.startswith("The fit explains little of") for note in remarks(found))
    assert any(
        note.startswith("Fit to May: The fit explains little of") for note in knowledge(found, "May").notes
    )
