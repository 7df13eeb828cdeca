import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.backend import WIDTH, kernel
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant import functions as interpolation
from panto_env.plant.catenary.flexible.arrays import CONTACT, MESSENGER, PAD, STENCIL
from panto_env.plant.catenary.flexible.build import at_rest, constants
from panto_env.plant.catenary.flexible.grid import spring_levels
from panto_env.plant.catenary.flexible.parts import SteadyArm
from panto_env.plant.catenary.flexible.resolution import resolution
from panto_env.plant.catenary.flexible.schema import Rayleigh, Support
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.flexible.wires import along, lay_out, leapfrog, window_nodes
from panto_env.plant.catenary.protocol import (
    advance_wire,
    apply_force,
    end_step,
    look_at_contact,
    place_contact,
)
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train

from .. import line_energy
from ..finite_element import simulation as finite_element
from ..finite_element.sections import of_catalogue
from ..marks import some_at_once

EN, STIFFNESS = "en50318-2002", 5e5  # N/m, of its messenger supports
WHOLE = {"window": 0, "precision": "double"}


@kernel
def travel(line, wire, start, stride, force, heights, seen):
    """Move a constant force along the line; heights of the wire under it in the middle of each step.

    seen: of the last step, height and yield of the wire before the force is applied, and height afterwards.
    """
    for n in range(heights.size):
        x = start + stride * (n + 0.5)
        _, heights[n] = place_contact(line, wire, 0, 0, x)
        advance_wire(line, wire, 0)
        seen[0], seen[1], _, _ = look_at_contact(line, wire, 0, 0, x)
        apply_force(line, wire, 0, 0, x, force)
        seen[2], _, _, _ = look_at_contact(line, wire, 0, 0, x)
        end_step(line, wire, 0)


@kernel
def leap(u, d, inertia, stencil):
    leapfrog(u, d, inertia, inertia, stencil)


def constants_of(line, spans, numerics):
    return constants(line, solve(line), spans, numerics, resolution(line, numerics, Runs()))


def swing(data, spans, place, height, goes_slack, energy, precision="double"):
    """A pulse of a height (m) on all wires at a place (m) of a line without damping, for 10 s.

    energy: of line, wire, data and time step (J). Returns its largest relative change, and line and wire at
    the end; droppers go slack, or do not.
    """
    step = 2.5e-4 if goes_slack else 1e-3
    numerics = Numerics(spacing=0.25, time_step=step, window=0, precision=precision)
    line = constants_of(data, spans, numerics)
    wire, x = at_rest(line, 1, 1), line.spacing * window_nodes(line.rows)
    pulse = height * np.exp(-(((x - place) / 4) ** 2))
    for w in range(len(line.mobility)):
        moves = line.scattered.mobility[w, : len(x)] > 0 if line.scattered.mobility.size else 1.0
        wire.displacement[0, w] = lay_out(pulse * moves, line.rows, float)
    steps, seen = np.zeros(round(0.1 / step)), np.zeros(3)
    travel(line, wire, place, 0.0, 0.0, steps[:1], seen)
    first, largest, slack = energy(line, wire, data, step), 0.0, False
    for _ in range(100):
        travel(line, wire, place, 0.0, 0.0, steps, seen)
        largest = max(largest, abs(energy(line, wire, data, step) / first - 1))
        slack |= bool((wire.change[0] <= -wire.static[0]).any())
    assert slack == goes_slack
    return largest, line, wire


def under_a_train(monkeypatch, changed, condition, speed, begin, distance):
    """Runs on the reference line in a condition, by finite elements that ``changed`` makes, and intact.

    Returns their contact forces (N) from ``begin`` (m) on, and the first two runs.
    """
    line, pantograph = load_catenary(EN), load_pantograph(EN)
    monkeypatch.setattr(finite_element, "build", changed)
    other = finite_element.simulate(line, pantograph, speed, element=0.5, time_step=5e-4, distance=distance)
    fine = {"spacing": 0.125, "time_step": 2.5e-4, "distance": distance, "spans": 10} | WHOLE
    ours, intact = (simulate(speed_kmh=speed, line_condition=each, **fine) for each in (condition, "new"))
    near = np.linspace(begin, distance - 1, 2000)
    forces = (np.interp(near, run.position, run.contact_force) for run in (ours, other, intact))
    return *forces, ours, other


PRECISIONS = pytest.mark.parametrize("precision", some_at_once(["single", "double"], ["single"]))
PULSES = pytest.mark.parametrize(("height", "goes_slack", "bar"), [(1e-3, False, 1e-6), (0.1, True, 0.01)])


def undamped(line):
    """A line without damping, and without steady arms, whose springs no energy here counts."""
    changes = {"damping": Rayleigh(alpha=0, beta=0), "steady_arm": SteadyArm(mass=0, stiffness=0)}
    return line.model_copy(update=changes | {"support": Support(stiffness=STIFFNESS, damping=0)})


@pytest.mark.parametrize(("alpha", "beta"), [(0.0, 0.0), (3.0, 0.0), (0.0, 2e-3)])
@pytest.mark.parametrize("waves", [1, 4])
def test_a_wave_on_a_bare_wire_has_its_frequency_and_decay(alpha, beta, waves):
    """Half-waves: omega^2 = (T k^2 + EI k^4) / m less that of the decay, (alpha + beta omega^2) / 2."""
    data, step = load_catenary("en50318-2002"), 1e-3
    contact = data.contact_wire.model_copy(update={"bending_stiffness": 500.0})
    damped = data.model_copy(update={"damping": Rayleigh(alpha=alpha, beta=beta), "contact_wire": contact})
    line = constants_of(damped, 3, Numerics(spacing=1.1, time_step=step, window=0, precision="double"))
    wavenumber, stencil = waves * np.pi / data.span_length, line.stencil[0, CONTACT].copy()
    stencil[STENCIL.QUIET] = 0.0
    shape = np.sin(wavenumber * line.spacing * window_nodes(line.rows))
    u, d, amplitude, inner = shape.copy(), np.zeros(len(shape)), [], slice(PAD, -PAD)
    inertia = line.inertia[CONTACT][:0]

    def projected(values):
        """Beyond the ends too, which the leapfrog leaves alone."""
        return values[inner] @ shape[inner] / (shape[inner] @ shape[inner])

    for _ in range(5):
        abreast = [lay_out(each, line.rows, float) for each in (u, d)]
        leap(*abreast, inertia, stencil)
        u, d = map(along, abreast)
        amplitude.append(projected(u + d))
        u, d = projected(u) * shape, projected(d) * shape
    a = np.array(amplitude)
    p, q = np.linalg.lstsq(np.column_stack([a[1:-1], a[:-2]]), a[2:], rcond=None)[0]
    decay = -np.log(-q) / (2 * step)
    squared = (contact.tension * wavenumber**2 + contact.bending_stiffness * wavenumber**4) / contact.mass
    assert decay == pytest.approx((alpha + beta * squared) / 2, rel=0.01, abs=1e-6)
    frequency = np.arccos(p / (2 * np.sqrt(-q))) / step
    assert frequency == pytest.approx(np.sqrt(squared - decay**2), rel=1e-3)


def test_springs_and_dampers_to_the_ground_take_three_time_levels():
    """A spring bears displacement, a damper velocity."""
    step = 1e-3
    levels = spring_levels(5e5, 800.0, step)
    assert levels @ np.ones(3) == pytest.approx(5e5)
    assert levels @ [step, 0.0, -step] == pytest.approx(800.0)  # at 1 m/s


def energy(line, wire, data, step):
    """Energy (J) of the discrete line at mid-step: kinetic, of the wires, springs and droppers."""
    old, move = along(wire.displacement[0]), along(wire.increment[0])
    now, middle = old + move, old + move / 2
    total = 0.0
    for w in range(2):
        bare = step**2 / line.mobility[w, 10, 0]  # of a node; all are alike on this line
        mass = np.zeros(now.shape[1])
        mass[PAD + 1 : -PAD] = bare
        total += line_energy.of_wire(old[w], now[w], line.stencil[0, w], mass, bare, step)
    masts = PAD + line.rows * WIDTH // line.window * np.arange(1, line.window)
    total += (STIFFNESS * middle[MESSENGER, masts] ** 2).sum() / 2  # the arms are without stiffness
    droppers = data.layout(line.alignment.supports.size - 1).positions
    first, weights = interpolation.stencil(droppers, line.spacing)
    nodes = PAD + first[:, None] + np.arange(4)
    extensions = [(weights * (u[MESSENGER, nodes] - u[CONTACT, nodes])).sum(axis=1) for u in (old, now)]
    stiffness = line.link_pull.sum(axis=1)[line.link_set, line.link_segment]
    return total + line_energy.of_droppers(*extensions, stiffness, line.link_static[0])


@pytest.mark.longer
@PULSES
@PRECISIONS
def test_undamped_line_keeps_its_energy_for_10_s(height, goes_slack, bar, precision):
    bar = 2e-3 if precision == "single" and not goes_slack else bar
    assert swing(undamped(load_catenary(EN)), 10, 300.0, height, goes_slack, energy, precision)[0] < bar


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "pantograph", "speed"),
    [
        (EN, EN, 250.0),
        (EN, EN, 300.0),
        ("benchmark-2015", "benchmark-2015", 300.0),
        ("shinkansen-simple", "identified-2dof", 300.0),
        ("beijing-tianjin", "dsa380", 300.0),
    ],
)
def test_agrees_with_finite_elements(line, pantograph, speed):
    """Both converged: sigma within 2 %; on EN 50318's line the other figures within 2 N and 0.5 mm."""
    data = of_catalogue(line)
    panto = load_pantograph(pantograph).model_copy(update={"force": "applied"})  # as finite elements take it
    part, distance = (1 if line == EN else 2), 6.0167 * data.span_length
    run = simulate(data, panto, speed, spacing=0.125, time_step=2.5e-4 / part, distance=distance, **WHOLE)
    given = {"element": 0.5 / part, "time_step": 5e-4 / part, "distance": distance}
    other = finite_element.simulate(data, panto, speed, **given)
    ours, theirs = run.summary((5, 6)), finite_element.figures(other)
    assert ours.std == pytest.approx(theirs.std, rel=0.02)
    if line == EN:
        assert ours.mean == pytest.approx(theirs.mean, abs=0.5)
        assert (ours.max, ours.min) == pytest.approx((theirs.maximum, theirs.minimum), abs=2.0)
        # The finite-element run ends just past span 6: uplift is compared up to there.
        uplift = run.uplift[run.position < other.position[-1]][:, 3:6].max()
        assert uplift == pytest.approx(other.uplift[:, 3:6].max(), abs=5e-4)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("speed", "accuracy", "error"),
    [(250.0, "full", 0.01), (300.0, "full", 0.01), (350.0, "full", 0.005), (350.0, "fast", 0.03)],
)
def test_default_grid_and_step_are_converged(speed, accuracy, error):
    """As docs/validation.md says: at 350 km/h waves ahead of the train are short."""
    ours, fine = (
        simulate(EN, EN, speed, distance=361.0, **each).summary((5, 6)).std
        for each in ({"accuracy": accuracy}, {"spacing": 0.125, "time_step": 2.5e-4} | WHOLE)
    )
    assert ours == pytest.approx(fine, rel=error)


def test_droppers_go_slack_under_the_pantograph(reference_run):
    assert reference_run.dropper_force.min() == 0.0
    assert 0.001 < (reference_run.dropper_force == 0).mean() < 0.2


def test_wire_force_balance_in_the_mean(reference_run):
    """Over the run the mean contact force is the lift less what the lowest spring carries."""
    spans = slice(len(reference_run.time) // 3, None)
    carried = 50.0 * reference_run.frame[spans].mean()
    assert reference_run.contact_force[spans].mean() == pytest.approx(120.0 - carried, abs=1.0)


def test_first_lanes_advance_alone():
    """They have the forces that they have beside others, which stay as they are until it is their turn."""
    line, pantograph = load_catenary("en50318-2002"), load_pantograph("en50318-2002")

    speeds = np.array([200, 300, 250, 350]) / 3.6

    def batch():
        plant = Plant(line, Train.of(pantograph), lanes=4)
        plant.start(np.arange(4), speeds)
        return plant, plant.samples(801)

    whole, expected = batch()
    whole.advance_passively(800, expected)
    plant, samples = batch()
    rest = plant.run.table[:, 2:].copy()
    plant.advance_passively(500, samples, 2)
    plant.advance(np.zeros((4, 1, 2)), 300, samples, 1)
    np.testing.assert_array_equal(samples.rows[0], expected.rows[0])
    np.testing.assert_array_equal(samples.rows[1, :501], expected.rows[1, :501])
    assert not samples.rows[1, 501:].any()
    assert not samples.rows[2:, 1:].any()
    np.testing.assert_array_equal(plant.run.table[:, 2:], rest)
    with pytest.raises(InputError, match="not for 1600"):
        plant.advance_passively(800, samples, 2)
    plant.start(np.arange(4), speeds)
    plant.advance_passively(800, samples)  # all lanes again
    np.testing.assert_array_equal(samples.rows[1:], expected.rows[1:])


@pytest.mark.parametrize("spacing", [0.125, 0.05])
def test_unstable_step_is_refused(spacing):
    """Also on a grid so fine that only waves of middle length would grow."""
    with pytest.raises(InputError, match=rf"unstable on a grid of {spacing} m"):
        simulate(spacing=spacing, time_step=1e-3)


@pytest.mark.slow
@PRECISIONS
def test_force_travelling_along_a_string_matches_the_closed_form(precision):
    """From an anchor, d'Alembert and one image give w(vt, t) = F v t / (m c (c + v))."""
    line = undamped(load_catenary("en50318-2002"))
    string = line.contact_wire.model_copy(update={"bending_stiffness": 0.0})
    limp = line.droppers.model_copy(update={"stiffness": 1e-6})
    alone = line.model_copy(update={"contact_wire": string, "droppers": limp})
    step, speed, force = 1e-3, 300 / 3.6, 100.0
    built = constants_of(alone, 10, Numerics(spacing=0.25, time_step=step, window=0, precision=precision))
    bare = built._replace(shape=np.zeros_like(built.shape))
    wire = at_rest(bare, 1, 1)
    steps = 3000  # before the far anchor's reflection
    heights = np.zeros(steps)
    travel(bare, wire, 0.0, speed * step, force, heights, np.zeros(3))
    time = step * (np.arange(steps) + 0.5)
    wave = np.sqrt(string.tension / string.mass)
    exact = force * speed * time / (string.mass * wave * (wave + speed))
    assert np.abs(heights - exact).max() < 0.005 * exact.max()
    assert (along(wire.displacement[0])[:, [PAD, -PAD]] == 0).all()  # the anchors
