"""The three-span catenary: closed forms, and its motion judged by SciPy's solver on paper 2's equations.

The judge shares the catalogue with the kernel and nothing else: it writes out Eqs 1-6 in the basis of
sines, evaluates the modes where the pantograph is at each moment instead of reading a table, and solves
wire, contact spring and pantograph together at a tolerance far below the kernel's error.
"""

from collections import namedtuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from panto_env import simulate
from panto_env.catalog import load_catenary, load_pantograph
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


@pytest.mark.longer
def test_static_compliance_is_the_string_s_between_springs(data):
    """Deflection under a unit force at the first support, from statics of the string alone."""
    stringy = data.model_copy(
        update={"wire": data.wire.model_copy(update={"bending_stiffness": 0.0}), "modes": 400}
    )
    compliance = built(stringy).start_point.wire_compliance
    a, tension, spring = data.span_length, data.wire.tension, data.suspension_stiffness
    system = np.array([[2 * tension / a + spring, -tension / a], [-tension / a, 2 * tension / a + spring]])
    assert compliance == pytest.approx(np.linalg.solve(system, [1, 0])[0], rel=5e-3)


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
    run = simulate("ohl-three-span", "own-two-mass", 200.0, distance=480.0)
    spans = [run.summary((k, k)) for k in (6, 7, 8)]
    assert np.ptp([s.std for s in spans]) < 0.05 * spans[0].std
    assert np.ptp([s.mean for s in spans]) < 1.0


def test_converges_in_the_time_step():
    fine, coarse = (
        simulate("ohl-three-span", "own-two-mass", 250.0, time_step=step).summary((5, 6)).std
        for step in (2.5e-4, None)  # None: the default
    )
    assert coarse == pytest.approx(fine, rel=0.01)


SPEED = 240 / 3.6
"""m/s: a span takes a whole number of every time step below, so that all re-project at the same time."""
STEPS = (5e-3, 2.5e-3, 1.25e-3)  # s
SPANS = 2


Solution = namedtuple("Solution", "impulse head uplift")
"""What the judge finds at the ends of the shortest time steps, (n + 1,): integral of the contact force (N s),
heights of the collector head and of the wire at the support that the train runs towards (m)."""


class Wire:
    """The equivalent wire in its lowest modes, of unit modal mass, from an eigenproblem of sines."""

    def __init__(self, line):
        self.length, self.mass = 3 * line.span_length, line.wire.mass
        self.wavenumber = np.arange(1, 2 * line.modes + 1) * np.pi / self.length
        tension, bending = line.wire.tension, line.wire.bending_stiffness
        stiffness = np.diag((tension * self.wavenumber**2 + bending * self.wavenumber**4) / self.mass)
        for support in (line.span_length, 2 * line.span_length):
            stiffness += line.suspension_stiffness * np.outer(self.sines(support), self.sines(support))
        squared, vectors = np.linalg.eigh(stiffness)
        self.frequency, self.vectors = np.sqrt(squared[: line.modes]), vectors[:, : line.modes]

    def sines(self, position):
        return np.sqrt(2 / (self.mass * self.length)) * np.sin(np.multiply.outer(position, self.wavenumber))

    def modes(self, position):
        """Phi of Eq. 3 at a position along the three spans (m)."""
        return self.sines(position) @ self.vectors

    def projection(self):
        """Least squares over the continuous wire: of modes with unit mass, the integral of products."""
        points, weights = np.polynomial.legendre.leggauss(400)
        span, total = self.length / 3, 0.0
        for begin in (0.0, span):
            here = begin + 0.5 * span * (points + 1)
            total = total + self.modes(here).T @ ((0.5 * span * weights)[:, None] * self.modes(here + span))
        return self.mass * total


def equations(line, wire, speed):
    """Rates of Eqs 1 to 6 and of the pantograph, and the state at rest where the central span begins.

    Of modal coordinates, their rates, heights and velocities of head and frame, and the impulse.
    """
    pantograph, span = load_pantograph("own-two-mass"), line.span_length
    omega, n = wire.frequency, line.modes
    (m1, m2), (k1, k2), (c1, c2) = pantograph.masses, pantograph.stiffnesses, pantograph.dampings
    contact, lift = pantograph.contact_stiffness, pantograph.static_force

    def rates(time, state, covered):
        q, rate, (z1, z2, v1, v2) = state[:n], state[n : 2 * n], state[2 * n : 2 * n + 4]
        shape = wire.modes(span + speed * time - covered * span)  # Eq. 6, from the left end
        force = max(contact * (z1 - shape @ q), 0.0)
        inner = k1 * (z1 - z2) + c1 * (v1 - v2)
        bend = shape * force - 2 * line.damping_ratio * omega * rate - omega**2 * q
        masses = [v1, v2, (-inner - force) / m1, (lift + inner - k2 * z2 - c2 * v2) / m2]
        return np.concatenate([rate, bend, masses, [force]])

    yields = wire.modes(span) ** 2 @ omega**-2.0 + 1 / contact
    heights = np.linalg.solve([[k1 + 1 / yields, -k1], [-k1, k1 + k2]], [0, lift])
    rest = wire.modes(span) * omega**-2.0 * heights[0] / yields
    return rates, np.concatenate([rest, np.zeros(n), heights, np.zeros(3)])


@pytest.fixture(scope="module")
def solution():
    line = load_catenary("ohl-three-span")
    wire, span, n = Wire(line), line.span_length, line.modes
    (rates, state), projection = equations(line, wire, SPEED), wire.projection()
    period, found = span / SPEED, []
    support = wire.modes(2 * span)
    for covered in range(SPANS):
        time = covered * period + STEPS[-1] * np.arange(round(period / STEPS[-1]) + 1)
        solution = solve_ivp(
            rates, time[[0, -1]], state, "DOP853", time, args=(covered,), rtol=1e-9, atol=1e-11
        )
        y = solution.y if covered == 0 else solution.y[:, 1:]
        found.append(np.array([y[-1], y[2 * n], support @ y[:n]]))
        state = solution.y[:, -1].copy()
        state[:n], state[n : 2 * n] = projection @ state[:n], projection @ state[n : 2 * n]
    return Solution(*np.concatenate(found, axis=1))


@pytest.fixture(scope="module")
def runs():
    length = SPANS * load_catenary("ohl-three-span").span_length
    line = ("ohl-three-span", "own-two-mass", 3.6 * SPEED)
    return [simulate(*line, distance=length, time_step=h) for h in STEPS]


def in_span(values, number):
    """Values of one span, without the first step: its force starts from the wire before re-projection."""
    size = len(values) // SPANS
    return values[number * size + 1 : (number + 1) * size]


def errors(runs, number, difference):
    """Largest error in a span for each time step."""
    return [np.abs(in_span(difference(run, round(run.time_step / STEPS[-1])), number)).max() for run in runs]


@pytest.mark.longer
@pytest.mark.parametrize(("number", "tolerance"), [(0, 0.15), (1, 0.6)])
def test_force_head_and_uplift_are_the_judge_s_and_of_second_order(runs, solution, number, tolerance):
    """Forces swing by 165 N, the head moves within 55 mm; the second span begins with a re-projection."""

    def force(run, every):
        return run.contact_force - np.diff(solution.impulse[::every]) / run.time_step

    def head(run, every):
        ends = solution.head[::every]
        return run.head - 0.5 * (ends[1:] + ends[:-1])

    def uplift(run, every):
        return run.uplift[:-1, number] - solution.uplift[::every][1:-1]

    for difference, most in ((force, tolerance), (head, 1e-5)):  # N, m
        found = errors(runs, number, difference)
        assert found[-1] < most
        assert found[0] > 3 * found[1] > 9 * found[2]
    assert errors(runs, number, uplift)[-1] < 1e-5
