"""The oracle: its knots, its responses, its optimum beside SciPy's, what it keeps to, what is stored."""

import json
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfilt

from panto_baselines.benchmark.run import evaluated_windows
from panto_baselines.benchmark.settings import Tape, load_benchmark
from panto_baselines.benchmark.single_pass import along
from panto_baselines.oracle import command, problem, report, search, stored
from panto_baselines.oracle import search as solver
from panto_baselines.oracle.problem import Knots, Problem
from panto_baselines.oracle.search import descend, find, noise
from panto_baselines.oracle.stored import oracle_settings
from panto_configs import find as find_config
from panto_env import InputError, simulate
from panto_env.base.checksums import with_checksum
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.actuators import actuator_settings
from panto_env.plant.state import Row

from ..finite_element.sections import line_of
from ..marks import some_at_once
from ..pages import check_page, tables_of
from .commands import called

SHORT = {"line_condition": "smooth", "actuator": "realistic", "speed_kmh": 300.0}
SPANS = (2, 2)
OVERLAP = SHORT | {
    "catenary": line_of(
        "en50318-2002", {"sequence": [{}] * 10, "overlaps": [{"first_span": 1, "rises": [0.1, 0.5]}]}
    ),
    "actuator": "ideal",
}
"""The wires change in the evaluated span."""
TRAILING = SHORT | {"pantographs": ("dsa380", "dsa380"), "distances": (35.0,), "controlled": 2}
WIRES = Row.CONTACT_FORCE, Row.SECOND_FORCE
LINEAR = {
    "catenary": "periodic-stiffness",
    "pantograph": "three-mass",
    "speed_kmh": 250.0,
    "actuator": "ideal:force_limit=25",
    "bilateral": True,
    "time_step": 2.5e-3,
}


def stored_ratio(given, spans):
    """σ of the stored oracle over the passive run's, mean over its seeds; None without one."""
    changes = stored.stored_changes(given, spans)
    return 1 + float(np.mean([*changes.values()])) / 100 if changes else None


@pytest.fixture(scope="module")
def short():
    return Problem(SHORT, seed=3, spans=SPANS)


@pytest.fixture(scope="module")
def descent(short):
    return descend(short, "zero", np.zeros((short.count, 1)), iterations=4)


@pytest.mark.parametrize("actuator", ["ideal", "realistic:rate_limit=1e8", "realistic"])
def test_commands_lead_the_force_from_knot_to_knot(actuator):
    chosen = actuator_settings(actuator)
    time_step, steps = 1e-4, 100
    knots = Knots(chosen, time_step, steps)
    wanted = knots.within(np.cumsum(np.random.default_rng(1).normal(0, 30, (60, 1)), axis=0))
    commands = knots.commands(wanted)[:, 0]
    assert np.abs(commands).max() <= chosen.force_limit
    # The actuator's own equation, by SciPy: f' = (u - f) / lag, no faster than the limit of rate.
    limits = (-chosen.rate_limit, chosen.rate_limit) if chosen.rate_limit else ()
    force, reached = 0.0, []
    for asked in commands:
        if chosen.lag == 0:
            force = asked
        else:
            rate = partial(lambda asked, _, f: np.clip((asked - f) / chosen.lag, *limits), asked)
            force = solve_ivp(rate, (0, 0.01), [force], max_step=2e-4, rtol=1e-8, atol=1e-8).y[0, -1]
        reached.append(force)
    assert np.abs(np.array(reached) - wanted[:, 0]).max() < 0.25


def test_limits_are_those_of_the_real_actuator():
    knots = Knots(actuator_settings("realistic"), 1.25e-3, 8)
    assert knots.maximum_change == pytest.approx(25.0)
    steepest = np.minimum(25.0 * np.arange(1, 5), 100.0)[:, None]
    assert knots.at_limits(steepest * 0.5) < 1.0
    assert np.allclose(knots.within(1000 * steepest).max(), knots.within(2000 * steepest).max())
    limits = knots.limits(4)
    assert (limits.matrix @ steepest[:, 0] > limits.bound).any()  # near its limit a lag cannot go on so fast
    assert (np.abs(limits.matrix @ knots.within(steepest)[:, 0]) <= limits.bound * (1 + 1e-12)).all()


RESPONSES = {"flexible": SHORT | {"actuator": "ideal"}, "overlap": OVERLAP}
RESPONSES["trailing"] = TRAILING | {"actuator": "ideal"}


@pytest.mark.longer
@pytest.mark.parametrize("name", some_at_once(RESPONSES, ["flexible"]))
def test_response_is_the_difference_of_whole_runs(name, monkeypatch):
    monkeypatch.setattr(problem, "MEMORY", 100.0)
    asked = Problem(RESPONSES[name], seed=3, spans=SPANS)
    knots = asked.knots.within(noise(asked))
    response = asked.response(knots)
    some = [0, 1, asked.count // 2, asked.count - 2]
    pushed = np.repeat(knots[None], len(some) + 1, axis=0)
    for k, knot in enumerate(some):
        pushed[k, knot, 0] += problem.PUSH
    free = asked._filtered(asked._free.forces(pushed))[:, asked.rows]
    expected = (free[:-1] - free[-1]) / problem.PUSH
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(response[:, some].T, expected, atol=1e-12)


def filtered_forces_by_scipy(asked):
    """Paper 3's equations solved by SciPy: passive force, filtered, and its change by each knot (N/N)."""
    line, data = load_catenary("periodic-stiffness"), load_pantograph("three-mass")
    (m1, m2, m3), (k1, k2, k3), (c1, c2, c3) = data.masses, data.stiffnesses, data.dampings
    speed = LINEAR["speed_kmh"] / 3.6

    def stiffness(t):
        turns = speed * t / line.span_length
        return line.mean_stiffness * (1 + line.stiffness_variation * np.cos(2 * np.pi * turns))

    def rates(t, y, lift):
        z1, z2, z3, v1, v2, v3 = y.reshape(6, -1)
        upper, middle = c1 * (v1 - v2) + k1 * (z1 - z2), c2 * (v2 - v3) + k2 * (z2 - z3)
        push = (lift + middle - c3 * v3 - k3 * z3) / m3
        return np.concatenate([v1, v2, v3, -(upper + stiffness(t) * z1) / m1, (upper - middle) / m2, push])

    count, step, steps = asked.count, asked.passive.time_step, asked.steps
    lift = np.zeros(count + 1)  # the last run is the passive one, the others the response to one knot
    lift[-1] = data.nominal_force(speed)
    stiff = np.array([[k1, -k1, 0], [-k1, k1 + k2, -k2], [0, -k2, k2 + k3]], dtype=float)
    stiff[0, 0] += stiffness(0)
    state = np.zeros((6, count + 1))
    state[:3, -1] = np.linalg.solve(stiff, [0, 0, lift[-1]])
    forces = []
    for interval in range(asked.begin + count):
        begin, own = interval * steps * step, lift.copy()
        if interval >= asked.begin:
            own[interval - asked.begin] = 1.0
        middles = begin + (np.arange(steps) + 0.5) * step
        answer = solve_ivp(
            rates, (begin, begin + steps * step), state.ravel(), t_eval=[*middles, begin + steps * step],
            args=(own,), rtol=1e-7, atol=1e-10,
        )  # fmt: skip
        heights = answer.y.reshape(6, count + 1, -1)
        forces.append(stiffness(middles)[:, None] * heights[0, :, :-1].T)
        state = heights[:, :, -1]
    force = np.concatenate(forces)
    filtered = sosfilt(butter(6, 20, fs=1 / step, output="sos"), force - lift[-1] * (lift > 0), axis=0)
    filtered[:, -1] += lift[-1]
    inside = asked.begin * steps + asked._inside
    return filtered[inside, -1], filtered[inside, :-1]


@pytest.mark.longer
def test_optimum_of_a_linear_line_is_that_of_scipys_least_squares(monkeypatch):
    monkeypatch.setattr(problem, "LEAD", 0.6)
    asked = Problem(LINEAR, spans=(3, 3))
    passive, response = filtered_forces_by_scipy(asked)
    assert passive.std() == pytest.approx(asked.figures.std, rel=0.01)
    held = 100 * np.sqrt(len(passive)) * response.mean(axis=0)  # the mean, which is to stay
    matrix = np.vstack([response - response.mean(axis=0), held])
    wanted = np.append(passive.mean() - passive, 0.0)
    best = lsq_linear(matrix, wanted, (-25.0, 25.0), tol=1e-12)
    std = (passive + response @ best.x).std()
    assert std < 0.9 * passive.std()
    reached = descend(asked, "zero", np.zeros((asked.count, 1))).std / asked.figures.std
    assert reached == pytest.approx(std / passive.std(), abs=0.005)


@pytest.mark.longer
def test_every_iteration_is_better_and_the_mean_stays(short, descent):
    passive = short.figures
    merits = [each.std + solver.MEAN_WEIGHT * abs(each.mean - passive.mean) for each in descent.iterations]
    assert all(after <= before for before, after in pairwise(merits))
    assert descent.iterations[0].std == pytest.approx(passive.std, rel=1e-12)
    assert descent.std < 0.8 * passive.std
    assert descent.iterations[-1].mean == pytest.approx(passive.mean, rel=search.MEAN_TOLERANCE)


@pytest.mark.slow
def test_an_oracle_is_found_where_wires_change():
    asked = Problem(OVERLAP, seed=3, spans=SPANS)
    found = descend(asked, "zero", np.zeros((asked.count, 1)), iterations=3)
    assert found.std < 0.8 * asked.figures.std
    forces = []
    run = simulate(
        **OVERLAP,
        policy=Tape(asked.knots.commands(found.knots) / asked.knots.limit),
        seed=3,
        watch=lambda task: forces.append([task.plant.of(0, row) for row in WIRES]),
    )
    assert run.summary(SPANS).std == pytest.approx(found.std, rel=1e-12)
    total, second = np.array(forces).T
    assert ((second > 0) & (second < total)).any()


@pytest.mark.slow
def test_the_oracle_of_a_trailing_pantograph_is_what_simulate_says_of_it():
    asked = Problem(TRAILING, seed=3, spans=SPANS)
    passive = simulate(**TRAILING, seed=3).train
    assert asked.figures.std == pytest.approx(passive[1].summary(SPANS).std, rel=1e-12)
    assert abs(asked.figures.std / passive[0].summary(SPANS).std - 1) > 0.05
    found = descend(asked, "zero", np.zeros((asked.count, 1)), iterations=4)
    assert found.std < 0.8 * asked.figures.std
    run = asked.replay(asked.knots.commands(found.knots))
    assert run.summary(SPANS).std == pytest.approx(found.std, rel=1e-12)
    assert run.policy == "Tape"
    # It waits until it comes onto the line, 35 m behind.
    assert asked.first_action * asked.interval == pytest.approx(35.0 / run.speed, abs=asked.interval)


@pytest.mark.longer
def test_simulate_says_the_same_to_the_digit_and_the_force_keeps_the_actuators_limits(short, descent):
    run, actuator = short.replay(short.knots.commands(descent.knots)), short.settings.actuator
    figures, force = run.summary(SPANS), run.frame_force
    assert figures.std == pytest.approx(descent.std, rel=1e-12)
    assert figures.mean == pytest.approx(descent.iterations[-1].mean, rel=1e-12)
    assert 0.5 * actuator.force_limit < np.abs(force).max() <= actuator.force_limit * (1 + 1e-9)
    largest = actuator.rate_limit * short.passive.time_step
    # What is recorded is the mean over a step, which may change by a little more than the force itself.
    assert 0.9 * largest < np.abs(np.diff(force)).max() <= 1.01 * largest
    assert not force[: short.begin * short.steps].any()


def test_broydens_correction_meets_what_was_seen():
    random = np.random.default_rng(0)
    response, step, change = random.normal(size=(5, 3)), random.normal(size=3), random.normal(size=5)
    after = solver.corrected(response, step, change)
    np.testing.assert_allclose(after @ step, change)
    across = np.cross(step, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(after @ across, response @ across)


def test_response_along_directions_is_that_of_their_knots(monkeypatch):
    monkeypatch.setattr(problem, "LEAD", 0.6)
    monkeypatch.setattr(problem, "MEMORY", 100.0)
    asked = Problem(LINEAR, spans=(3, 3))
    knots, basis = asked.knots.within(noise(asked)), search.span_periodic(asked)
    np.testing.assert_allclose(asked.response_along(knots, basis), asked.response(knots) @ basis, atol=1e-9)


@pytest.mark.slow
def test_hops_start_near_the_best_and_never_make_it_worse(short, monkeypatch):
    begun = []

    def followed(asked, start, knots, **more):
        begun.append(knots)
        return descend(asked, start, knots, iterations=2, **more)

    monkeypatch.setattr(search, "descend", followed)
    found = find(short, hops=2)
    assert [each.start for each in found.searches] == ["zero", "hop 1", "hop 2"]
    assert found.best.std == min(each.std for each in found.searches)
    for hop in (1, 2):
        before = min(found.searches[:hop], key=lambda each: each.std)
        share = np.vdot(begun[hop], before.knots) / np.vdot(before.knots, before.knots)
        shaken = np.sqrt(np.mean((begun[hop] / share - before.knots) ** 2))
        assert 0.3 < share < 1.1  # limits shrink the whole
        assert 0.5 * search.HOP_FORCE < shaken < 1.5 * search.HOP_FORCE


@pytest.mark.parametrize("first", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_stored_oracles_are_what_simulate_says_today(first):
    cells = stored.stored_cells()
    assert cells
    for cell in cells[:1] if first else cells[1:]:
        names = ["catenary", "speed_kmh", "actuator", "line_condition", "control_interval"]
        names += ["pantographs", "distances", "controlled"] if "pantographs" in cell else ["pantograph"]
        names += [name for name in ("pantograph_scatter", "speed_drift") if name in cell]
        given, spans = {name: cell[name] for name in names}, tuple(cell["spans"])
        assert stored.fingerprint(given) == cell["asked"]["fingerprint"]
        ratios = [each["oracle"]["std"] / each["passive"]["std"] for each in cell["passes"]]
        assert stored_ratio(given, spans) == pytest.approx(np.mean(ratios), rel=1e-12)
        kept = cell["passes"][0]
        asked = Problem(given, kept["seed"], spans)
        figures = asked.replay(np.array(kept["commands"])).summary(spans)
        assert asked.begin == kept["first_step"]
        assert asked.figures.std == pytest.approx(kept["passive"]["std"], rel=1e-6)
        assert figures.std == pytest.approx(kept["oracle"]["std"], rel=1e-6)
        assert figures.mean == pytest.approx(asked.figures.mean, rel=search.MEAN_TOLERANCE)


def test_a_stored_ratio_is_of_exactly_these_settings_and_spans():
    given, spans = {"speed_kmh": 300, "actuator": "realistic", "line_condition": "smooth"}, (10, 19)
    ratio = stored_ratio(given, spans)
    assert ratio is not None
    assert 0.2 < ratio < 0.75
    assert stored_ratio(given | {"sensors": "realistic", "observation": "full"}, spans) == ratio
    assert stored_ratio(given, (4, 9)) is None
    others = {"speed_kmh": 301, "line_condition": "new", "control_interval": 0.02, "pantograph": "dsa380"}
    others |= {"mean_force": 120.0, "time_step": 1e-3, "actuator": "realistic:delay=0.006"}
    for name, value in others.items():
        assert stored_ratio(given | {name: value}, spans) is None
    for actuator in ("realistic:place=head", "ideal", {"kind": "motor", "place": "frame"}):
        assert stored_ratio(given | {"actuator": actuator}, spans) is None


def test_no_oracle_is_that_of_a_line_of_another_length_or_of_a_train():
    """An irregular line with more spans is another line under the same seed."""
    given = {"speed_kmh": 300.0, "line_condition": "as-built", "pantograph": "dsa380"}
    train = {"pantographs": ["dsa380"] * 2, "distances": [200.0]}
    others = ({}, {"spans": 122}, {"distance": 3000.0}, train, train | {"controlled": 2})
    assert len({stored.fingerprint(given | other) for other in others}) == len(others)
    found = (stored.fingerprint(given | {"spans": 122} | more) for more in ({}, {"distance": 1000.0}))
    assert len(set(found)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("track", ["known-line", "head", "high-speed", "any-line"])
def test_tracks_of_the_benchmark_are_cells_of_the_oracle(track):
    config = "oracle-any-line" if track == "any-line" else "oracle"
    settings = load_benchmark(find_config(f"benchmark/{track}", "benchmark"))
    (line,) = settings.lines
    oracles = oracle_settings(config, {}, {})
    known = {each["fingerprint"] for each in stored.requests(oracles)}
    for speed in line.speeds_kmh:
        assert stored.fingerprint(along(settings, line) | {"speed_kmh": speed}) in known
    assert oracles.spans == evaluated_windows(settings, line).early


@pytest.mark.slow
def test_command_prints_and_writes_what_it_found(tmp_path, monkeypatch):
    monkeypatch.setattr(search, "descend", partial(descend, iterations=2))
    file, picture = tmp_path / "o.json", tmp_path / "o.png"
    words = "--actuator ideal --speed 300 --seed 0 --seed 1 --spans 2-2 --start random --hops 1 --output"
    result = called(command.oracle, *words.split(), file, "--plot", picture)
    assert result.exit_code == 0, result.output
    for word in ("random", "seed 0", "iteration", "local optimum"):
        assert word in result.output
    cell = json.loads(file.read_text())["cells"][0]
    assert [each["seed"] for each in cell["passes"]] == [0, 1]
    assert [each["start"] for each in cell["passes"][1]["searches"]] == ["seed 0", "hop 1"]
    given = {"speed_kmh": 300, "line_condition": "smooth"}
    monkeypatch.setattr(stored, "stored_cells", lambda: stored.read(file)["cells"])
    assert stored_ratio(given, SPANS) == pytest.approx(cell["ratio"])
    again = simulate(**given, seed=1, distance=None).summary((2, 2))
    assert cell["passes"][1]["passive"]["std"] == again.std
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "1 of 2 cells were in" in called(command.oracle, *words.split(), file, "--speed", 250).output
    assert [each["speed_kmh"] for each in stored.read(file)["cells"]] == [300.0, 250.0]
    assert stored.read(file)["cells"][0] == cell


@pytest.mark.slow
def test_a_line_of_each_seed_is_searched_by_itself(tmp_path, monkeypatch):
    """As built, under a pantograph of each seed, at a drifting speed: as a track of the benchmark is."""
    monkeypatch.setattr(search, "descend", partial(descend, iterations=2))
    track = load_benchmark(find_config("benchmark/any-line", "benchmark"))
    given = along(track, track.lines[0]) | {"speed_kmh": 275}
    file, config = tmp_path / "o.json", tmp_path / "o.toml"
    config.write_text(f"line_spans = {given['spans']}")
    words = "--catenary family:high-speed --pantograph dsa380 --actuator realistic --line-condition as-built"
    words += " --speed 275 --pantograph-scatter 0.05 --speed-drift 0.5 --seed 0 --seed 1 --spans 2-2"
    result = called(command.oracle, *words.split(), "--config", config, "--output", file)
    assert result.exit_code == 0, result.output
    (cell,) = stored.read(file)["cells"]
    assert cell["catenary"] == "family:high-speed"
    monkeypatch.setattr(stored, "stored_cells", lambda: [cell])
    assert stored_ratio(given, SPANS) == pytest.approx(cell["ratio"])
    assert stored_ratio(given | {"speed_drift": 0.0}, SPANS) is None
    assert stored.stored_actions(given) is None
    for seed, kept in enumerate(cell["passes"]):
        assert [each["start"] for each in kept["searches"]] == ["zero"]
        passive = simulate(**given, seed=seed).summary(SPANS)
        assert kept["passive"]["std"] == pytest.approx(passive.std, rel=1e-12)
        assert kept["oracle"]["std"] == pytest.approx(kept["searches"][0]["std"], rel=1e-4)
        assert kept["oracle"]["std"] < 0.8 * passive.std


def test_what_is_asked_for_otherwise_is_searched_anew(monkeypatch):
    settings = oracle_settings(None, {}, {})
    (before,) = stored.requests(settings)
    assert stored.requests(settings) == [before]
    for name, value in {"seeds": [1], "spans": [2, 2], "starts": ["random"], "hops": 1}.items():
        assert stored.requests(oracle_settings(None, {name: value}, {})) != [before]
    assert stored.requests(oracle_settings(None, {}, {"speeds_kmh": [301]})) != [before]
    monkeypatch.setattr(stored, "METHOD", search.METHOD + 1)
    assert stored.requests(settings) != [before]


def test_a_file_of_something_else_is_not_written_over(tmp_path):
    file, text = tmp_path / "o.json", json.dumps(with_checksum({"cells": [{"fingerprint": "0"}]}))
    file.write_text(text)
    told = called(command.oracle, "--output", str(file)).exception
    assert isinstance(told, InputError)
    assert "holds no oracles of this version" in str(told)
    assert file.read_text() == text


def test_stored_oracles_are_printed_as_the_page_shows_some_of_them():
    table = report.stored_table(stored.stored_cells())
    assert len(tables_of("oracle.md")[table.title][1]) > 5
    check_page("oracle.md", {table.title: table})
    assert "Stored oracles" in called(command.oracle, "--stored").output


def test_a_file_s_cells_are_replaced_by_one_on_the_command_line():
    whole = oracle_settings("oracle", {}, {})
    assert len(list(whole.runs())) == sum(len(cell.speeds_kmh) for cell in whole.cells)
    one = oracle_settings("oracle", {"seeds": [5]}, {"speeds_kmh": [310]})
    assert [given["speed_kmh"] for given in one.runs()] == [310.0]
    assert one.seeds == (5,)
    assert one.spans == whole.spans


@pytest.mark.parametrize(
    ("changes", "cell", "words"),
    [
        ({"starts": ["best"]}, {}, "starts"),
        ({"seeds": [-1]}, {}, "seeds"),
        ({}, {"actuator": "strong"}, "actuator"),
        ({}, {"speeds_kmh": []}, "speeds_kmh"),
    ],
)
def test_bad_settings_are_refused(changes, cell, words):
    with pytest.raises(InputError, match=words):
        oracle_settings(None, changes, cell)


def test_problems_without_an_oracle_are_refused(short):
    with pytest.raises(InputError, match="one speed"):
        Problem({"speed_kmh": (250, 300)})
    with pytest.raises(InputError, match="controls one pantograph of a train, not 1 and 2; name one"):
        Problem(TRAILING | {"controlled": (1, 2)})
    with pytest.raises(InputError, match="start must be one of zero, periodic, random, not 'best'"):
        find(short, ("best",))


@pytest.mark.parametrize("source", ["family:high-speed", "section:fast-line"])
def test_an_oracle_is_one_of_the_drawn_line(source):
    given = {"catenary": source, "speed_kmh": 300.0, "distance": 260.0}
    problem = Problem(given, seed=4, spans=(3, 3))
    line = simulate(**given, seed=4, record_droppers=False).design["catenary"]
    assert problem.settings.line.model_dump(mode="json") == line
    rest = np.zeros((1, problem.count, problem.places))
    force = low_pass(problem.passive.contact_force, problem.passive.time_step)[problem.passive.inside((3, 3))]
    np.testing.assert_allclose(problem.forces(rest)[0], force, atol=1e-6)
