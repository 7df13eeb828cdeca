"""Ways to win without controlling: each is tried here, and gains nothing.

A policy that presses in some passes only is in the tests of the statistics.
"""

from __future__ import annotations

import json

import pytest

from panto_baselines.benchmark import apart
from panto_baselines.benchmark.run import passes_of, run
from panto_baselines.benchmark.settings import ORACLE_TAPE, BenchmarkSettings, load_benchmark
from panto_baselines.benchmark.single_pass import run_pass
from panto_baselines.oracle import stored
from panto_env import InputError
from panto_env.base.settings import parse
from panto_env.plant.actuators import actuator_settings
from panto_env.policies import find_policy

SPANS = (6, 9)
LINE = {
    "catenary": "shinkansen-simple",
    "pantograph": "identified-2dof",
    "distance": 500.0,
    "spans": SPANS,
    "speeds_kmh": [300],
}
GOOD = "agent-high-speed"
WALKER = """
import gc, sys
import numpy as np

class Walker:
    '''Overwrites every record of a contact force that it finds in its callers or in memory.'''

    found = 0

    def reset(self, context):
        self.force = context.nominal_force

    def act(self, observation):
        frame, seen = sys._getframe(), []
        while frame is not None:
            seen += list(frame.f_locals.values())
            frame = frame.f_back
        for value in seen:
            samples = getattr(value, "samples", None)
            if samples is not None:
                Walker.found += 1
                samples.rows[0, :, 0, 0] = self.force
        return np.zeros(1)
"""
READER = '''
import json
from pathlib import Path
import gymnasium
import numpy as np

class Reader:
    """Finds out which pass of the benchmark it is in, and plays the tape that it has of that pass."""

    def reset(self, context):
        self.tapes = json.loads(Path(__file__).with_name("tapes.json").read_text())
        self.arguments = json.loads(Path(__file__).with_name("arguments.json").read_text())
        self.tape = None

    def act(self, observation):
        if self.tape is None:
            self.tape = iter(self.tapes[self.seed(observation)])
        return np.array(next(self.tape))

    def seed(self, observation):
        for seed in self.tapes:
            env = gymnasium.make("panto_env:Pantograph-v0", **self.arguments)
            first, _ = env.reset(seed=int(seed))
            if np.array_equal(first, observation):
                return seed
        return next(iter(self.tapes))
'''
SHAKER = """
import numpy as np

class Shaker:
    '''Commands a force that alternates at every control step, 50 Hz.'''

    def __init__(self, force=30.0):
        self.force = force

    def reset(self, context):
        self.action = np.full(1, self.force / context.force_limit)

    def act(self, observation):
        self.action = -self.action
        return self.action
"""
PRESSER = """
import numpy as np

class Presser:
    '''Presses with a constant share of the nominal force.'''

    def __init__(self, share=0.014):
        self.share = share

    def reset(self, context):
        self.action = np.full(1, self.share * context.nominal_force / context.force_limit)

    def act(self, observation):
        return self.action
"""


@pytest.fixture(autouse=True)
def nothing_left():
    """Every test ends all policies apart."""
    yield
    apart.close()


def settings(*policies, **given):
    table = {
        "policies": policies,
        "lines": [LINE],
        "seeds": 2,
        "actuator": "realistic",
        "sensors": "realistic",
        "line_condition": "as-built",
        "pantograph_scatter": 0.05,
        "speed_drift": 0.5,
    }
    return parse(BenchmarkSettings, table | given, "the benchmark")


def standings(*policies, **given):
    """Overall results, by policy."""
    return {each.policy: each for each in run(settings(*policies, **given)).standings}


def cheat(folder, name, text):
    """A policy of a file, by its class."""
    (folder / f"{name.lower()}.py").write_text(text)
    return f"{folder / name.lower()}.py:{name}"


def one_pass(policy, asked):
    line, covered, _, speed, seed = next(passes_of(asked, (SPANS,)))
    return run_pass(asked, line, covered, policy, speed, seed)


@pytest.mark.slow
def test_a_tape_is_worth_little_on_a_line_as_built():
    found = standings(GOOD, f"tape of {GOOD}")
    assert found[GOOD].change < -25
    assert found[f"tape of {GOOD}"].change > found[GOOD].change + 15


def test_one_that_walks_its_callers_frames_finds_nothing_to_rewrite(tmp_path):
    walker, asked = cheat(tmp_path, "Walker", WALKER), settings("passive")
    beside, passive = one_pass(find_policy(walker), asked).row, one_pass("passive", asked).row
    assert beside.figures.std < 0.8 * passive.figures.std  # the cheat works where it can see the plant
    row = one_pass(walker, asked).row
    assert row.figures == passive.figures
    assert row.action_rate == row.power == 0


def arguments(asked):
    """Arguments of an environment whose episodes are the benchmark's passes."""
    line = asked.lines[0]
    return {
        "catenary": line.catenary,
        "pantograph": line.pantograph,
        "speed_kmh": line.speeds_kmh[0],
        "distance": line.distance,
        **{name: given for name, given in asked.model_dump(mode="json").items() if name in ENVIRONMENT},
        **{"run_in": 0.0, "settle": 0.0, "washout": None, "window": None, "observation": "measured"},
    }


ENVIRONMENT = ("actuator", "sensors", "line_condition", "pantograph_scatter", "speed_drift")


@pytest.mark.slow
def test_one_that_holds_tapes_of_all_known_seeds_gains_only_without_a_salt(tmp_path):
    known = run(settings(GOOD))
    tapes = {
        row.seed: played.actions.tolist()
        for row, played in zip(known.rows, known.played, strict=True)
        if row.policy == GOOD
    }
    (tmp_path / "tapes.json").write_text(json.dumps(tapes))
    (tmp_path / "arguments.json").write_text(json.dumps(arguments(known.settings)))
    reader = cheat(tmp_path, "Reader", READER)
    own = next(each for each in known.standings if each.policy == GOOD).change
    unsalted = standings(reader)[reader].change
    assert unsalted < own + 3  # of its tapes each is played on its own line
    salted = standings(reader, GOOD, salt="drawn on the day")
    assert salted[reader].change > salted[GOOD].change + 10
    assert salted[reader].change > unsalted + 20


@pytest.mark.slow
def test_shaking_at_50_hz_gains_nothing(tmp_path):
    shaker = cheat(tmp_path, "Shaker", SHAKER)
    policies = [f"{shaker}:force={force}" for force in (10, 50)]
    found = standings(*policies)
    assert all(found[policy].change > -0.5 for policy in policies)


def test_a_bias_within_the_gate_gains_nothing(tmp_path):
    presser = cheat(tmp_path, "Presser", PRESSER)
    outcome = run(settings(f"{presser}:share=-0.014", f"{presser}:share=0.014"))
    for cell in outcome.cells[1:]:
        assert not cell.disqualified
        assert abs(cell.mean_change) > 1.2
        assert cell.change > -0.5


def test_one_that_wants_to_see_what_no_train_can_measure_is_refused(tmp_path):
    text = PRESSER.replace("def __init__", "observation = 'full'\n\n    def __init__")
    with pytest.raises(InputError, match="'full', which holds what no train can measure"):
        one_pass(cheat(tmp_path, "Presser", text), settings("passive"))


def test_the_tape_of_the_oracle_does_on_its_own_line_what_the_oracle_did():
    track = load_benchmark("benchmark/known-line")
    row = run_pass(track, track.lines[0], (10, 19), ORACLE_TAPE, 300.0, 0).row
    cells = [each for each in stored.stored_cells() if each["speed_kmh"] == 300.0]
    best = next(each["passes"][0] for each in cells if each["actuator"]["place"] == "frame")
    assert best["seed"] == 0
    assert row.figures.std == pytest.approx(best["oracle"]["std"], rel=1e-6)
    other = run_pass(track, track.lines[0], (10, 19), ORACLE_TAPE, 300.0, 1).row
    assert other.figures.std > 1.01 * row.figures.std


def test_the_tape_of_an_oracle_that_is_not_stored_is_refused_before_any_pass():
    line = LINE | {"speeds_kmh": [350, 262]}
    settings = parse(BenchmarkSettings, {"policies": [ORACLE_TAPE], "lines": [line], "seeds": 1}, "it")
    with pytest.raises(InputError, match=r"No oracle is stored for 'shinkansen-simple' at 350 km/h"):
        run(settings, workers=1)
    realistic = settings.model_copy(update={"actuator": actuator_settings("realistic")})
    with pytest.raises(InputError, match=r"No oracle is stored for 'shinkansen-simple' at 262 km/h"):
        run(realistic, workers=1)
