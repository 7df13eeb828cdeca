"""Policies made from a model: the model against the plant, each design against what its theory promises."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from panto_baselines.policies.adaptive import HARMONICS, LEAD, Periodic
from panto_baselines.policies.line_model import MeanLine, Sampled, line_model, mean_line
from panto_baselines.policies.model_based import (
    ROUNDING,
    Disturbed,
    central,
    minimum_bound,
    regulator,
    weighted,
)
from panto_baselines.policies.mpc import HORIZON, Programs
from panto_baselines.policies.preview import FrontPreview, Preview, preview
from panto_baselines.policies.repetitive import LISTENING, Repetitive
from panto_baselines.tuning.tune import Still, run_batch
from panto_env import InputError, simulate
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.estimation.kalman import steady_gain

from .laws import CONTEXT, MODEL, a_context, repeated


def test_models_response_is_that_of_masses_springs_and_dampers_by_hand():
    frequency = np.array([0.3, 2.0, 9.0])
    pantograph, line = CONTEXT.pantograph, mean_line(CONTEXT)
    (m1, m2), (k1, k2), (c1, c2) = pantograph.masses, pantograph.stiffnesses, pantograph.dampings
    expected = []
    for s in 2j * np.pi * frequency:
        wire = s * line.damper + line.spring
        contact = 1 / (1 / float(pantograph.contact_stiffness) + 1 / wire)
        between = k1 + s * c1
        dynamic = [
            [s**2 * m1 + between + contact, -between],
            [-between, s**2 * m2 + between + k2 + s * c2],
        ]
        head, _ = np.linalg.solve(np.array(dynamic), np.array([0.0, 1.0]))
        expected.append(contact * head * np.exp(-0.010 * s) / (1 + 0.015 * s))
    assert MODEL.response(frequency) == pytest.approx(np.array(expected), rel=1e-9)


@pytest.mark.longer
def test_the_plant_answers_at_the_spans_harmonics_much_as_the_model_says():
    """The dashpot of the string's closed form stands for wires, droppers and supports within a quarter."""
    settings = run_settings({"speed_kmh": 250.0, "accuracy": "fast", "actuator": "realistic"})
    amplitude, harmonics = 3.0, (1, 2, 4)
    laws = [Still()]
    for place in (k - 1 + half for k in harmonics for half in (0, HARMONICS)):
        gains = np.zeros(2 * HARMONICS)
        gains[place] = amplitude
        laws.append(Periodic(gains=gains.tolist()))
    force = run_batch(settings, laws, [0]).values[:, 0]
    turns = np.linspace(0, 10, force.shape[1], endpoint=False)  # ten spans
    rate = CONTEXT.speed / CONTEXT.alignment.mean_length
    model = line_model(CONTEXT, mean_line(CONTEXT), delay=0.005)
    for row, k in enumerate(harmonics):
        answer = force[1 + 2 * row] - force[0] + 1j * (force[2 + 2 * row] - force[0])
        answer *= np.exp(-2j * np.pi * k * (turns + LEAD * rate))
        # The figures' filter lets the force through late: size alone is compared.
        size = abs(answer.mean()) / amplitude
        assert size == pytest.approx(abs(model.response(np.array([k * rate]))[0]), rel=0.25)


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.010, 0.023])
def test_sampled_model_is_the_continuous_one_under_held_and_late_commands(delay):
    interval, steps = 0.01, 12
    model = line_model(CONTEXT, MeanLine(600.0, 3000.0), delay)
    commands = np.random.default_rng(1).normal(size=steps)

    def late(time):
        step = int(np.floor((time - delay) / interval + 1e-9))
        return float(commands[step]) if 0 <= step < steps else 0.0

    state, time = np.zeros(len(model.a)), 0.0
    edges = np.unique(np.round([k * interval + shift for k in range(steps + 1) for shift in (0, delay)], 9))
    for begin, end in pairwise(edges):
        if end > steps * interval + 1e-9:
            break
        force = late(0.5 * (begin + end))
        state = solve_ivp(
            lambda _, x, force=force: model.a @ x + model.b[:, 0] * force,
            (begin, end),
            state,
            rtol=1e-9,
            atol=1e-12,
        ).y[:, -1]
        time = end
    sampled = Sampled(model, interval)
    x = np.zeros(sampled.size)
    for command in commands:
        x = sampled.a @ x + sampled.b * command
    assert time == pytest.approx(steps * interval)
    assert x[: len(state)] == pytest.approx(state, rel=1e-6, abs=1e-10)


def test_the_mean_line_is_two_half_strings_and_their_static_stiffness_over_a_span():
    """EN 50318:2002: wires of 20 and 16 kN, 1.35 and 1.07 kg/m, spans of 60 m.

    A half string moves at F / sqrt(T mu) under a force F at its end; two share the force.
    """
    line = mean_line(CONTEXT)
    assert line.damper == pytest.approx(2 * np.sqrt((20e3 + 16e3) * (1.35 + 1.07)), rel=1e-9)
    # Of a string between supports: 1 N at x bends it there by x (s - x) / (T s).
    x = np.linspace(0, 60, 100_001)
    deflection = x * (60 - x) / (36e3 * 60)
    assert line.spring == pytest.approx(1 / deflection.mean(), rel=1e-4)


def test_a_line_without_wires_is_refused():
    context = a_context(catenary="periodic-stiffness", speed_kmh=100.0)
    with pytest.raises(InputError, match="has no wires"):
        mean_line(context)


def test_repetitive_control_learns_a_force_that_repeats_to_near_zero():
    controlled, passive = repeated(Repetitive(gains=(0.5, 0.0, 0.05)), 25)
    assert controlled[: int(LISTENING) - 1] == pytest.approx(passive[: int(LISTENING) - 1], rel=1e-6)
    assert controlled[-1] < 0.05 * passive[-1]


@pytest.mark.longer
@pytest.mark.parametrize(("speed_error", "left"), [(0.0, 0.05), (0.005, 0.2)])
def test_it_learns_without_the_place_counting_its_way_from_a_speed_that_is_a_little_wrong(speed_error, left):
    policy = Repetitive(gains=(0.5, 0.0, 0.05), place="counted")
    controlled, passive = repeated(policy, 25, blind=True, speed_error=speed_error)
    assert controlled[-1] < left * passive[-1]
    with pytest.raises(InputError, match="needs the place within the span"):
        repeated(Repetitive(), 5, blind=True)


@pytest.mark.longer
def test_repetitive_control_backs_off_where_its_model_is_wrong():
    """Under a plant of the opposite sign it would grow without bounds."""
    controlled, passive = repeated(Repetitive(gains=(0.5, 0.05, 0.1)), 40, sign=-1.0)
    assert np.mean(controlled[-10:]) < 1.08 * passive[-1]


@pytest.mark.longer
def test_lqgs_gains_are_what_the_riccati_recursions_converge_to():
    model = Disturbed(Sampled(MODEL, 0.01), CONTEXT, harmonics=1.0, wandering=3.0)
    effort, held = 0.4, 0.7
    a, b, force = model.a, model.b, model.c[0]
    cost = np.outer(force, force)
    cost[-1, -1] += effort * (2 * np.pi * held) ** 2
    p = np.zeros_like(a)
    for _ in range(6000):
        gain = (b @ p @ a) / (effort + b @ p @ b)
        p = cost + a.T @ p @ (a - np.outer(b, gain))
    assert regulator(a, b, force, effort, held) == pytest.approx(gain, rel=1e-5, abs=1e-5)
    assert np.abs(np.linalg.eigvals(a - np.outer(b, gain))).max() < 1

    known = len(a) - 1
    a, c, noise = a[:known, :known], model.c[:, :known], model.noise[:known]
    readings = np.array([4.0, 1e-6, 1e-6, 4e-4, 4e-4])
    p = np.eye(known) * 1e-6
    for _ in range(6000):
        correction = p @ c.T @ np.linalg.inv(c @ p @ c.T + np.diag(readings))
        p = a @ (p - correction @ c @ p) @ a.T + np.diag(noise)
    gain = steady_gain(a, c, np.diag(noise + ROUNDING), np.diag(readings))
    assert gain == pytest.approx(correction, rel=1e-3, abs=1e-6)


def test_h_infinity_keeps_its_bound_at_all_frequencies_and_is_stable():
    plant = weighted(MODEL, performance=2.0, centre=12.0, height=2e-3)
    bound, (a, b, c) = minimum_bound(plant)
    n, k = len(plant.a), len(a)
    closed = np.block([[plant.a, plant.b2 @ c], [b @ plant.c2, a]])
    assert np.linalg.eigvals(closed).real.max() < 0
    disturbed = np.block([[plant.b1, np.zeros((n, 5))], [np.zeros((k, 1)), b]])
    small = np.block([[plant.c1, np.zeros((1, k))], [np.zeros((1, n)), c]])
    gains = [
        np.linalg.norm(small @ np.linalg.solve(1j * w * np.eye(n + k) - closed, disturbed), 2)
        for w in np.geomspace(0.01, 1e4, 400)
    ]
    assert 0.5 * bound < max(gains) < bound
    assert central(plant, 0.5 * bound) is None


@pytest.mark.parametrize(("limit", "rate"), [(1e6, 1e9), (15.0, 1e9), (100.0, 600.0)])
def test_mpcs_first_command_is_that_of_the_best_ones_within_limits(limit, rate):
    pytest.importorskip("osqp")
    rng, last, total, change = np.random.default_rng(3), 4.0, 0.3, rate * 0.01
    response = np.exp(-0.1 * np.arange(HORIZON)) * rng.uniform(0.1, 0.4, size=(50, 1))
    response[:, 0] = 0.0  # a delay
    programs = Programs(Preview(0.0, 1.2, np.zeros(50), response), 0.1, limit, rate, 0.01)
    free = rng.normal(size=HORIZON) * 20

    def objective(u):
        force, sums = free + programs.answers[7] @ u, total + 0.01 * np.cumsum(u)
        return float(force @ force + 0.1 * u @ u + (2 * np.pi * 0.4) ** 2 * sums @ sums)

    between = np.eye(HORIZON) - np.eye(HORIZON, k=-1)
    before = np.zeros(HORIZON)
    before[0] = last
    inside = [
        {"type": "ineq", "fun": lambda u: change - (between @ u - before)},
        {"type": "ineq", "fun": lambda u: change + (between @ u - before)},
    ]
    best = minimize(
        objective,
        np.zeros(HORIZON),
        method="SLSQP",
        bounds=[(-limit, limit)] * HORIZON,
        constraints=inside if rate < 1e6 else [],
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert best.success
    assert programs.first(7, free, last, total) == pytest.approx(best.x[0], abs=0.1)


@pytest.mark.longer
def test_preview_predicts_what_the_line_as_designed_does_under_other_commands():
    context = a_context(actuator="realistic")
    length, first = 100, 780
    line = preview(context, length, 0.005, 0.015)
    settings = {"speed_kmh": 250.0, "accuracy": "fast", "distance": 900.0, "spans": 23}
    settings["actuator"] = {"delay": 0.005, "lag": 0.015}
    task = Task(run_settings(settings), lanes=2, keep_samples=False)
    task.reset(np.arange(2), np.random.default_rng(0))
    entry = task.layout.index("contact force")
    commands = np.random.default_rng(5).uniform(-4, 4, size=20)
    answer, predicted = [], np.zeros(40 + length)
    for k in range(first + 40):
        force = commands[k - first] if first <= k < first + len(commands) else 0.0
        if k >= first:
            readings = 100 * task.results.observation[:, entry].astype(float)
            answer.append(readings[1] - readings[0])
            position = np.array([k * line.stride % context.alignment.mean_length])
            begin = k - first + 1
            predicted[begin : begin + length] += force * line.response[line.step(position)[0]]
        task.step(np.array([[0.0], [force / context.force_limit]]))
    seen = np.array(answer)
    assert np.std(seen) > 0.2
    assert np.std(seen - predicted[: len(seen)]) < 0.05 * np.std(seen)


TRAIN = {
    "catenary": "re330", "pantographs": ["dsa380"] * 2, "distances": [100.0], "controlled": 2,
    "speed_kmh": 250.0,
    "line_condition": "as-built", "actuator": "realistic", "sensors": "realistic",
}  # fmt: skip


def behind(policy, seed, **settings):
    return simulate(policy=policy, seed=seed, **TRAIN | settings).train[1].summary()


@pytest.mark.slow
@pytest.mark.parametrize(("line", "better"), [("re330", 3), ("en50318-2002", 6)])
def test_what_the_one_in_front_measured_calms_the_one_behind_on_lines_not_seen(line, better):
    """On top of what repeats from span to span: on each seed, or, where that is nearly all, in their mean."""
    gains = []
    for seed in range(6):
        passive, alone = (behind(each, seed, catenary=line) for each in (None, FrontPreview(base="")))
        assert alone.std < 0.8 * passive.std
        assert alone.mean == pytest.approx(passive.mean, rel=0.015)
        both, learnt = (behind(each, seed, catenary=line) for each in (FrontPreview(), "repetitive"))
        gains.append(1 - both.std / learnt.std)
    assert np.mean(gains) > 0.005
    assert np.sum(np.array(gains) > 0) >= better


def test_a_pantograph_without_one_in_front_is_refused():
    with pytest.raises(InputError, match="front"):
        simulate(policy=FrontPreview(base=""), **TRAIN | {"controlled": 1})
