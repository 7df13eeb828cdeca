"""Policies as C: the same actions as in the environment, the same pass, and no harm whatever is read."""

import subprocess
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from panto_agents.model_file import Facts, Needs, Step
from panto_agents.onboard import exported
from panto_agents.onboard.acting import prepare
from panto_agents.onboard.parts import add_steps_before, parts_of
from panto_agents.onboard.translate import Translation
from panto_agents.policy import NetworkPolicy
from panto_baselines.policies.repetitive import Repetitive
from panto_env import InputError
from panto_env.analysis.simulation import ready_pass
from panto_env.catalog import pantograph
from panto_env.cli import make_app
from panto_env.policies import find_policy

from ..marks import some_at_once
from .onboard import AS_BUILT, COMPILERS, GCC, STRICT, Compiled, fed, needs_gcc, passed

HIGH_SPEED = {"catenary": "re330", "pantograph": "dsa380", "speed_kmh": 280.0, "distance": 900.0} | AS_BUILT
FAST_LINE = HIGH_SPEED | {"catenary": "section:fast-line"}
BEHIND = {
    "catenary": "en50318-2002",
    "pantographs": ["dsa380", "dsa380"],
    "distances": [200],
    "controlled": 2,
    "speed_kmh": 288.0,  # 250 control steps take it onto the line, so that it acts from its start
    "distance": 900.0,
} | AS_BUILT
IN_HEAD = HIGH_SPEED | {
    "catenary": "en50318-2002",
    "pantograph": "en50318-2002",
    "actuator": "head-motor:place='head'",
}
SHINKANSEN = HIGH_SPEED | {"catenary": "shinkansen-simple", "pantograph": "identified-2dof"}
FAULTY = HIGH_SPEED | {"faults": ["readings-silent"], "distance": 1500.0}
FROZEN = HIGH_SPEED | {"faults": ["force-frozen"], "distance": 1500.0}
BRAKING = HIGH_SPEED | {"speed_profile": "place:0=280,600=280,1100=230,1400=230", "distance": 1700.0}
TABLED = [[100.0, 12.0], [240.0, 60.0], [350.0, 80.0]]  # of the uplift, by speed
PRESSED = HIGH_SPEED | {"pantograph": pantograph({"uplift_over_speed": TABLED}, like="dsa380")}
OF_A_PASS = ("distance", "speed_kmh", "speed_profile", "line_condition", "faults")
CASES = {
    "robust": ("agent-robust", HIGH_SPEED),
    "any-line": ("agent-any-line", HIGH_SPEED | {"distance": 400.0}),
    "unlike-spans": ("agent-any-pantograph", FAST_LINE),
    "high-speed": ("agent-high-speed", SHINKANSEN),
    "head": ("agent-head", IN_HEAD),
    "trailing": ("agent-trailing", BEHIND),
    "guarded-silent": ("guarded:agent-any-pantograph", FAULTY),
    "guarded-frozen": ("guarded:agent-any-pantograph", FROZEN),
    "guarded-pd": ("guarded:pd", FROZEN),
    "guarded-harm": ("guarded:p:gain=2.5", HIGH_SPEED | {"distance": 2500.0}),
    "guarded-braking": ("guarded:agent-any-pantograph", BRAKING),
    "pd-uplift-by-table": ("pd", PRESSED),
    "forward": ("fb+ff:dead_zone=10,gain=0.3", HIGH_SPEED),
    "centred": ("pd", HIGH_SPEED | {"observation": "centred"}),
    "repetitive-counted": ("repetitive:place='counted'", HIGH_SPEED),
    "guarded-repetitive": ("guarded:repetitive", HIGH_SPEED | {"distance": 1500.0}),
    "added": ("agent-train", BEHIND),
    "small": ("agent-small", HIGH_SPEED),
    "washout": ("p:gain=0.3,washout=1.0", HIGH_SPEED),
}
"""Policies, and the passes in which they are compared."""
CLOSE = 1e-5


def made(policy, settings, name="controller"):
    kept = {key: value for key, value in settings.items() if key not in OF_A_PASS}
    return exported(policy, name, **kept)


def check_same(case, folder):
    policy, settings = CASES[case]
    if str(settings["catenary"]).startswith("section:"):  # the line of the pass, which a train knows
        settings = settings | {"catenary": ready_pass(policy, settings, 0)[0].settings.line}
    controller = made(policy, settings)
    compiled, noted = Compiled(controller, folder), []
    sigma, most = passed(policy, settings, compiled, noted=noted)
    assert most <= CLOSE
    actions = np.array([done for _, done, _ in noted])
    assert np.ptp(actions) > 0.05  # there was something to compare
    plain = controller.controller()
    limit = controller.constants["force_limit"]
    for read, done, _ in noted[:30]:
        forces = plain.step(read[: len(controller.inputs)])
        np.testing.assert_allclose(np.array(forces) / limit, done, atol=CLOSE)
    compiled.begin()
    closed, _ = passed(policy, settings | {"washout": 0.0}, compiled, closes=True)
    assert closed == pytest.approx(sigma, rel=5e-5)
    print(f"{case}: {most:.1e}, sigma {sigma:.4f} and {closed:.4f} N, state {compiled.bytes_of_state} bytes")


@pytest.mark.longer
@needs_gcc
@pytest.mark.parametrize("case", some_at_once(CASES, ["any-line"]))
def test_in_c_a_policy_acts_as_in_the_environment_and_closes_the_loop_alike(case, tmp_path):
    check_same(case, tmp_path)


def hostile(inputs, count, seed=0):
    """Readings, (count, inputs): plausible ones, among them jumps, standstills, and what no sensor reads."""
    random = np.random.default_rng(seed)
    usual = np.array([0.05, 0.08, 0.1, 0.1, 120.0, 0.0, 80.0, *[120.0] * (inputs - 7)])
    read = usual + 0.3 * np.abs(usual) * random.standard_normal((count, inputs))
    read[:, 5] = np.cumsum(random.normal(0.013, 0.01, count))
    kinds = random.integers(0, 12, (count, inputs))
    bad = np.array([np.nan, np.inf, -np.inf, 1e308, -1e308, 9e5, -9e5, 5e-324, 0.0])
    read = np.where(kinds == 0, random.choice(bad, (count, inputs)), read)
    with np.errstate(over="ignore"):
        read = np.where(kinds == 1, read * 10.0 ** random.integers(-9, 4, (count, inputs)), read)
    for begin in range(0, count, 500):  # stuck, one or all, for up to 4 s
        end, which = begin + random.integers(1, 400), random.random(inputs) < random.random()
        read[begin:end, which] = read[begin, which]
    return read


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    ("case", "count"),
    [("small", 1_000_000)]
    + [(case, 100_000) for case in ("robust", "high-speed", "trailing", "guarded-repetitive", "washout")],
)
def test_whatever_is_read_the_force_is_finite_and_within_its_limit(case, count, compiler, tmp_path):
    controller = made(*CASES[case])
    forces = fed(controller, tmp_path, hostile(len(controller.inputs), count), compiler)
    assert len(forces) == count
    assert np.isfinite(forces).all()
    assert np.abs(forces).max() <= controller.constants["force_limit"]
    assert np.ptp(forces) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("policy", ["repetitive", "agent-small"])
def test_every_compiler_s_code_does_what_the_description_does(policy, compiler, tmp_path):
    controller = made(policy, HIGH_SPEED)
    compiled, plain = Compiled(controller, tmp_path, compiler), controller.controller()
    steps = np.arange(800)
    readings = np.tile([0.05, 0.08, 0.1, 0.1, 120.0, 0.0, 80.0], (len(steps), 1))
    readings[:, 5] = 0.0123 * steps
    readings += np.random.default_rng(0).normal(0, [0.01, 0.01, 0.1, 0.1, 10.0, 0.0, 0.1], readings.shape)
    readings[:, 4] += 40 * np.sin(2 * np.pi * readings[:, 5])
    forces = np.array([compiled.step(read) for read in readings])
    np.testing.assert_allclose(forces, [plain.step(read) for read in readings], atol=1e-3)
    assert np.ptp(forces) > 1.0


class FromStart(Repetitive):
    """It begins with the speed at the start of a pass, as in C, not with the mean of all."""

    def begin(self, context, lanes):
        super().begin(replace(context, speed=280 / 3.6), lanes)


@pytest.mark.longer
@needs_gcc
def test_repetitive_control_learns_on_at_another_speed(tmp_path):
    controller = Compiled(made("repetitive", BRAKING), tmp_path)
    assert passed(FromStart(), BRAKING, controller)[1] < CLOSE


def test_memory_lasts_at_the_lowest_speed_of_the_training_or_at_one_that_is_given():
    usual, faster = (
        exported("agent-any-line", catenary="re330", pantograph="dsa380", **given).constants["memory_steps"]
        for given in ({}, {"speed_kmh": (290.0, 300.0)})
    )
    lowest = find_policy("agent-any-line").facts.environment["speed_kmh"][0]
    assert (usual - 2) / (faster - 2) == pytest.approx(290.0 / lowest, rel=0.01)


def test_plain_python_bears_the_same():
    controller = made("guarded:pd", HIGH_SPEED)
    plain = controller.controller()
    forces = np.array([plain.step(read) for read in hostile(len(controller.inputs), 200)])
    assert np.isfinite(forces).all()
    assert np.abs(forces).max() <= 100.0


@pytest.mark.longer
@needs_gcc
def test_begun_anew_it_does_the_same_again(tmp_path):
    controller = made("guarded:pd", HIGH_SPEED)
    compiled, readings = Compiled(controller, tmp_path), hostile(7, 200)
    first = [compiled.step(read) for read in readings]
    compiled.begin()
    assert [compiled.step(read) for read in readings] == first


def test_a_model_with_steps_before_its_network_sees_the_same():
    """Scaled, then stacked, once with a padding: the description beside ``Prepared``."""
    random = np.random.default_rng(0)
    task, _ = ready_pass("pd", HIGH_SPEED, 0)
    entries = len(task.layout.entries)
    steps = (
        Step(
            centre=tuple(random.normal(size=entries)), scale=tuple(random.uniform(0.1, 1, entries)), bound=2.0
        ),
        Step(frames=3),
        Step(frames=2, padding=tuple(random.normal(size=3 * entries))),
    )
    seen = []
    network = SimpleNamespace(reset=lambda context: None, act=lambda values: seen.append(values))
    prepared = NetworkPolicy(network, steps=steps)
    prepared.reset(task.context(0))
    constants, state = parts_of(find_policy("pd"), "pd", task)
    needs = Needs.of(task.context(0))
    given = {"algorithm": "ppo", "seed": 0, "steps": 0, "updates": 0, "environment": {}, "activation": "tanh"}
    facts = Facts(**given, squashed=False, needs=needs, steps_before=steps)
    width = add_steps_before(constants, state, facts)
    state["values"] = np.zeros(width, dtype=np.float32)
    own, table = SimpleNamespace(**state), SimpleNamespace(**constants)
    for _ in range(5):
        observation = random.normal(size=entries).astype(np.float32)
        prepared.act(observation)
        own.values[:entries] = observation
        prepare(table, own)
        own.begun = 1
        np.testing.assert_allclose(own.values[: 6 * entries], seen[-1], atol=1e-6)


REFUSED = [
    (("adaptive",), {}, "only p, pd, fb\\+ff, repetitive and a trained agent"),
    (("fb+ff:reading='printed'",), {}, "only with one gain"),
    (("agent-any-line-five",), {}, "export one member"),
    (("pd", "7up"), {}, "is not a name in C"),
    pytest.param(
        ("agent-any-line",),
        {"actuator": "head-motor:place='head'"},
        "trained with an actuator on place 'frame'",
        marks=pytest.mark.slow,
    ),
    (("pd",), {"observation": "full"}, "it sees the observation 'full', which no train reads"),
]


@pytest.mark.parametrize(("given", "settings", "reason"), REFUSED)
def test_what_has_no_form_in_c_is_refused_in_a_sentence(given, settings, reason):
    with pytest.raises(InputError, match=reason):
        exported(*given, **settings)


def test_outside_the_subset_is_refused():
    with pytest.raises(ValueError, match="cannot be translated to C"):
        Translation({}, {}, "state").add(_lists)


def _lists(x: float) -> float:
    """Not of the subset."""
    return sum([x, x])


def export(*given):
    return CliRunner().invoke(make_app(), ["export", *given])


@pytest.mark.longer
@needs_gcc
def test_the_command_writes_c_that_compiles_a_unit_and_a_network(tmp_path, monkeypatch):
    fmpy, onnx = pytest.importorskip("fmpy"), pytest.importorskip("onnx")
    monkeypatch.chdir(tmp_path)
    line = "--catenary", "re330", "--pantograph", "dsa380"
    told = export("pd", "--format", "c", *line).output
    assert {each.name for each in tmp_path.iterdir()} == {"pd.c", "pd.h"}
    assert "pd.c, pd.h: pd_init, pd_step every 0.01 s" in told
    subprocess.run([GCC, *STRICT, "-c", "pd.c"], check=True)
    told = export("pd", "damper.fmu", *line).output
    assert "damper.fmu: a step every 0.01 s" in told
    assert "contact_force" in told
    description = fmpy.read_model_description("damper.fmu")
    assert (description.fmiVersion, description.modelName) == ("3.0", "damper")
    assert [each.name for each in description.modelVariables][1:3] == [
        "head_displacement",
        "frame_displacement",
    ]
    result = fmpy.simulate_fmu("damper.fmu", stop_time=0.3, start_values={"contact_force": 120.0})
    assert abs(result["frame_force"]).max() <= 100.0
    assert export("agent-high-speed", "network.onnx").exit_code == 0
    assert onnx.load("network.onnx").graph.input[0].name == "observation"


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (["pd"], "Name a file to write"),
        (["pd", "pd.safetensors"], "has no model of its own"),
        (["pd", "pd.onnx"], "export it as C instead"),
        (["pd", "pd.c", "--format", "safetensors"], "must end in .safetensors"),
        (["pd", "--format", "rust"], "--format must be one of"),
        (["pd", "pd.txt"], "must end in one of"),
        (["agent-head", "head.safetensors", "--catenary", "re330"], "holds nothing of line"),
        (["agent-head", "head.onnx", "--catenary", "re330"], "holds nothing of line"),
    ],
)
def test_the_command_refuses_what_it_cannot_write(given, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = export(*given)
    assert result.exit_code != 0
    assert reason in " ".join(str(result.exception or result.output).split())
    assert not list(tmp_path.iterdir())
