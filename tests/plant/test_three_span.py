import numpy as np
import pytest

from panto_env import simulate
from panto_env.catalog import load_catenary
from panto_env.plant.catenary import three_span
from panto_env.plant.numerics import Numerics, Runs


@pytest.fixture(scope="module")
def data():
    return load_catenary("ohl-three-span")


def built(data):
    return three_span.ThreeSpan(data, lanes=1, collectors=1, spans=10, numerics=Numerics(), runs=Runs())


def test_frequencies_are_the_closed_form_where_the_springs_vanish(data):
    """A tensioned beam on three spans, hinged at its ends: omega^2 = (T k^2 + EJ k^4) / m."""
    free = data.model_copy(update={"suspension_stiffness": 1e-9})
    k = np.arange(1, data.modes + 1) * np.pi / (3 * data.span_length)
    wire = data.wire
    expected = np.sqrt((wire.tension * k**2 + wire.bending_stiffness * k**4) / wire.mass)
    assert three_span.modes(free)[0] == pytest.approx(expected, rel=1e-9)


def test_stiff_springs_make_the_supports_nodes(data):
    """With rigid supports each span is a string of its own: its lowest mode is a half-wave."""
    rigid = data.model_copy(update={"suspension_stiffness": 1e9, "modes": 200})
    k = np.pi / data.span_length
    wire = data.wire
    expected = np.sqrt((wire.tension * k**2 + wire.bending_stiffness * k**4) / wire.mass)
    assert three_span.modes(rigid)[0][0] == pytest.approx(expected, rel=5e-3)


def test_static_compliance_is_the_string_s_between_springs(data):
    """Deflection under a unit force at the first support, from statics of the string alone."""
    stringy = data.model_copy(
        update={"wire": data.wire.model_copy(update={"bending_stiffness": 0.0}), "modes": 400}
    )
    compliance = built(stringy).start_point.wire_compliance
    a, tension, spring = data.span_length, data.wire.tension, data.suspension_stiffness
    system = np.array([[2 * tension / a + spring, -tension / a], [-tension / a, 2 * tension / a + spring]])
    assert compliance == pytest.approx(np.linalg.solve(system, [1, 0])[0], rel=5e-3)


def test_modes_propagate_exactly(data):
    """A free decay over 1 s in one step equals that in 1000 steps."""
    frequency, _ = three_span.modes(data)
    long, _ = three_span._propagation(frequency, data.damping_ratio, 1.0)
    short, _ = three_span._propagation(frequency, data.damping_ratio, 1e-3)
    for m in (0, 5, data.modes - 1):
        matrix = np.linalg.matrix_power(short[:, m].reshape(2, 2), 1000)
        assert matrix.ravel() == pytest.approx(long[:, m], abs=1e-9 * max(1, frequency[m]))


def test_projection_moves_the_deflection_back_by_one_span(data):
    line = built(data).line
    _, vectors = three_span.modes(data)
    x = np.linspace(0, 3 * data.span_length, 721)
    # A smooth bump in the second and third span that ends at rest.
    before = np.exp(-(((x - 1.9 * data.span_length) / 15) ** 2))
    shapes = three_span.mode_shapes(data, vectors, x)
    modal = np.linalg.lstsq(shapes, before, rcond=None)[0]
    after = shapes @ (line.project @ modal)
    expected = np.exp(-(((x - 0.9 * data.span_length) / 15) ** 2))
    inside = x < 2 * data.span_length
    # The modes have kinks at the supports, 75 of them resolve 2.4 m: 2 % of the bump's height.
    assert np.abs(after - expected)[inside].max() < 0.02
    assert np.abs(after)[~inside].max() < 0.02  # the span ahead is at rest


def test_steady_run_is_periodic_in_the_span():
    """After the start, one span is like the next: the re-projection does not pump energy."""
    run = simulate("ohl-three-span", "own-two-mass", 200.0, distance=540.0)
    spans = [run.summary((k, k)) for k in (6, 7, 8, 9)]
    assert np.ptp([s.std for s in spans]) < 0.05 * spans[0].std
    assert np.ptp([s.mean for s in spans]) < 1.0


def test_converges_in_the_time_step():
    fine, coarse = (
        simulate("ohl-three-span", "own-two-mass", 250.0, time_step=step).summary((5, 6)).std
        for step in (2.5e-4, None)  # None: the default
    )
    assert coarse == pytest.approx(fine, rel=0.01)
