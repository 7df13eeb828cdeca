"""What can't be computed or understood is refused in one sentence, and changes nothing."""

import os
import re
from decimal import Decimal

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

import panto_env
from panto_baselines.benchmark import run as benchmark
from panto_baselines.benchmark.settings import BenchmarkSettings
from panto_env import InputError, simulate
from panto_env.analysis.options import parse_spans
from panto_env.analysis.plots import plot_run, save
from panto_env.analysis.sweep import sweep
from panto_env.base import machine
from panto_env.base.checksums import remembered
from panto_env.base.errors import LONGEST_LINE, AccuracyWarning, beside, shown
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse, parse_inline
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.control import Task
from panto_env.control.length import SHARE
from panto_env.control.settings import run_settings
from panto_env.envs import BARE
from panto_env.plant.catenary.flexible.model import FlexibleCatenary
from panto_env.plant.catenary.flexible.static import hang
from panto_env.plant.pantograph import schema as build
from panto_env.policies import find_policy
from panto_env.studies import Outcome
from panto_env.studies import write as write_study

from ..command import panto

OWN = """
class Own:
    def __init__(self, gain=0.5):
        self.gain = gain
    def reset(self, context):
        self.actions = context.actions
    def act(self, observation):
        if self.gain < 0:
            raise ValueError("the gain is negative")
        return [self.gain] * self.actions

class Broken(Own):
    def __init__(self):
        raise ZeroDivisionError("no gain")

class Lost(Own):
    def reset(self, context):
        context.layout.index("contact farce")

class Odd(Own):
    def act(self, observation):
        return {"complex": [1j], "text": ["0.5"], "word": "up"}[self.gain]
"""
TRAINING = """
algorithm = "ppo"
total_steps = 1000
checkpoint_steps = 100
lanes = 2
environment = { id = "Pantograph-v0" }
evaluation = { interval_steps = 100 }
"""
QUICK = {"catenary": "periodic-stiffness", "pantograph": "three-mass"}
DIVERGED = "diverged, so it has no result: .*±3 m; use a time_step below"
HUGE = 10**400


# --- runs -------------------------------------------------------------------------------------------


@pytest.fixture
def diverging(monkeypatch):
    """Settings of a run that diverges: a stiff contact that may pull, with nothing that keeps it stable."""
    monkeypatch.setattr(build, "STABILITY_MARGIN", np.inf)
    monkeypatch.setattr(FlexibleCatenary, "contact_share", 0.0)
    stiff = load_pantograph("en50318-2002").model_copy(update={"contact_stiffness": 1e6})
    return {"pantograph": stiff, "bilateral": True, "accuracy": "fast"}


def test_a_run_that_diverges_gives_no_figures(diverging):
    with pytest.raises(InputError, match=DIVERGED):
        simulate(**diverging)
    env = gymnasium.make("panto_env:Pantograph-v0", **BARE | diverging)
    env.reset(seed=0)
    still, ended = np.zeros(1, dtype=np.float32), False
    with pytest.warns(AccuracyWarning, match=DIVERGED):  # noqa: PT031 - at which step is not known
        while not ended:
            _, _, *ends, info = env.step(still)
            ended = any(ends)
    assert info["figures"] == {}


LONG = {"spans": 1000, "distance": 59e3, "speed_kmh": 20.0}
"""A train that takes three hours under a line of a thousand supports."""


def test_what_would_not_fit_into_memory_is_refused_with_the_estimate(monkeypatch):
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 16e9)
    steps = "14,868,000 time steps with 999 supports and"
    words = rf"{steps} [\d,]+ droppers would take [\d,.]+ GB, but .*record_droppers"
    with pytest.raises(InputError, match=words):
        simulate(**LONG)
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 4e9)
    with pytest.raises(InputError, match=f"{steps} 0 droppers would take 10.0 GB, but"):
        simulate(**LONG, record_droppers=False)
    monkeypatch.setattr("panto_env.analysis.sweep.simulate", lambda **_: pytest.fail("a pass was run"))
    needed = Task(run_settings({"distance": 540.0}), record_droppers=True).cost.memory
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 1.5 * needed / SHARE)
    with pytest.raises(InputError, match=r"The record of 2 passes at once would take .*, or fewer workers"):
        sweep({"pantograph.masses.1": [7.0, 8.0]}, distance=540.0, workers=2)


def test_a_sweep_of_millions_is_refused_before_it_begins():
    values = list(np.linspace(200.0, 300.0, 400))
    with pytest.raises(InputError, match="This sweep has 160,000 passes; the maximum is 100,000"):
        sweep({"speed_kmh": values, "pantograph.masses.1": values})
    assert "10,000,000 values" in panto("sweep", "speed_kmh=100:300:10000000").stderr


def test_a_sweep_s_line_may_have_more_spans():
    given = {"distance": 150.0, "spans": "all"}
    (row,) = sweep({"speed_kmh": [300.0]}, line_spans=6, **given)
    assert row["std"] == simulate(spans=6, distance=150.0, record_droppers=False).summary("all").std


def test_a_folder_that_is_asked_for_is_made(tmp_path):
    study = Outcome("A study", ())
    write_study(study, tmp_path / "new" / "folder")
    assert (tmp_path / "new" / "folder" / "numbers.json").is_file()
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match=r"The folder .*file/folder cannot be made: Not a directory"):
        write_study(study, tmp_path / "file" / "folder")


@pytest.mark.parametrize("seed", [np.nan, -1, 1j, str(HUGE), [], None])
def test_an_odd_seed_is_refused(seed):
    with pytest.raises(InputError, match="seed must be a whole number from 0 up"):
        simulate(**QUICK, seed=seed)


@pytest.mark.parametrize("text", ["²-³", "٣-٤", "-1-2", "1-", "1-2-3", f"1-{HUGE}", ""])
def test_odd_digits_are_no_spans(text):
    with pytest.raises(InputError):
        parse_spans(text)


@pytest.mark.longer
def test_a_name_that_is_no_mathematics_is_drawn_as_it_is(tmp_path, caplog):
    line = load_catenary("periodic-stiffness").model_copy(update={"name": r"$\bad{$ and $_$"})
    save(plot_run(simulate(line, "three-mass", distance=100.0), "all"), tmp_path / "run.png")
    figure = Figure()
    figure.subplots().set(title=r"$\sigma$" + "\nover two lines", ylabel="force\n(N)")
    save(figure, tmp_path / "figure.png")
    assert caplog.records == []


# --- policies ---------------------------------------------------------------------------------------


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    return tmp_path / "own.py"


def test_a_policy_of_ones_own_is_found_in_a_file(own):
    assert find_policy(f"{own}:Own").gain == 0.5
    run = simulate(**QUICK, policy=f"{own}:Own:gain=0.25", distance=50.0)
    assert run.frame_force == pytest.approx(25.0)
    assert find_policy("fb+ff:gain={250: 0.5, 300: 1.5},theta=0").gains == {250: 0.5, 300: 1.5}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own.py", "must name a class in the file, as .*own.py:Name"),
        ("own.py:Other", "has no class 'Other': it has Own, Broken, Lost, Odd"),
        ("own.py:Own:gian=1", r"has no parameter 'gian': did you mean 'gain'\? known are gain"),
        ("own.py:Own:gain", "Own:gain': 'gain' must read name=value"),
        ("own.py:Own:gain=1,gain=2", "'gain' is given twice"),
        ("own.py:Broken:gain=1", "has no parameter 'gain': it has none"),
        ("own.py:Broken", "cannot be made, at .*own.py:14: ZeroDivisionError: no gain"),
        ("none.py:Own", "does not exist"),
        ("broken.py:Own", r"broken.py cannot be run, at .*broken.py:1: ZeroDivisionError: div"),
        ("hollow.py:Own", "must have the methods reset and act"),
    ],
)
def test_what_is_wrong_with_a_policy_s_file_is_said(own, name, message):
    own.with_name("broken.py").write_text("1 / 0")
    own.with_name("hollow.py").write_text("class Own:\n    pass\n")
    with pytest.raises(InputError, match=message):
        find_policy(f"{own.parent}/{name}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Own:gain=-1", r"Own:gain=-1' failed in act, at .*own.py:9: ValueError: the gain is negative"),
        ("Lost", r"Lost' failed in reset: The observation has no entry 'contact farce': did you mean"),
        ("Odd:gain=complex", "its action must be finite numbers"),
    ],
)
def test_a_policy_that_fails_is_named_alike_wherever_it_runs(own, name, message):
    with pytest.raises(InputError, match=message):
        simulate(**QUICK, policy=f"{own}:{name}", distance=50.0)
    line = QUICK | {"distance": 300.0, "speeds_kmh": [300], "spans": (2, 6)}
    given = {"policies": [f"{own}:{name}"], "lines": [line], "seeds": 1}
    with pytest.raises(InputError, match=message):
        benchmark.run(parse(BenchmarkSettings, given, "the benchmark"), workers=1)


def test_text_is_no_action(own):
    for kind in ("text", "word"):
        with pytest.raises(InputError, match="its action must be finite numbers"):
            simulate(**QUICK, policy=f"{own}:Odd:gain={kind}", distance=50.0)


# --- commands ---------------------------------------------------------------------------------------


CONFIGS = {
    "c": "[[lines]]\nspans = [1]",
    "d": "seeds = -1",
    "e": f"seeds = 1000\npolicies = ['p']\n[[lines]]\nspeeds_kmh = {list(range(100, 151))}",
    "f": "seed = 3",
    "g": "[[lines]]\nspeeds_kmh = 250",
    "h": TRAINING.replace('"ppo"', '["ppo"]'),
    "i": TRAINING.replace('"Pantograph-v0"', "3"),
    "j": TRAINING.replace("lanes = 2", "lanes = 100_000_000"),
    "k": TRAINING + "[hyperparameters]\nn_steps = 100_000_000\n",
    "p": text_of("three-mass").replace("[7.5,", "[1, 1, 1, 1, 1, 1, 7.5,"),
}
SAID = {
    "simulate --spans ²-3": "--spans must read first-last, e.g. 5-6, or all, not '²-3'",
    "simulate --distance 0.1": "at least the 0.8333 m that a train covers in one control interval",
    "simulate --distance 60 --control-interval 5": "at least the 416.7 m",
    "simulate --distance 1e9": "distance must be at most 59,520 m on line 'en50318-2002'",
    "simulate --line-spans 2": "A line's spans must be a whole number from 3 to 1000, not 2",
    "simulate --policy own.py:": "must name a class in the file, as own.py:Name",
    "sweep speed_kmh=300:300:5": "speed_kmh has the value 300 twice",
    "sweep policy.gain=-1 --policy own.py:Own": r"At policy.gain = -1: .*own.py:Own:gain=-1.0'",
    "benchmark --config c.toml": "key 'lines.1.spans.2' is missing",
    "benchmark --config d.toml": r"key 'seeds' must be a whole number from 1 to 1,000, or a list",
    "benchmark --config e.toml": "This benchmark has 102,000 passes; the maximum is 100,000",
    "benchmark --config f.toml": r"'seed' is not known: did you mean 'seeds'\.$",
    "benchmark --config g.toml": r"key 'lines.1.speeds_kmh' must be a list, such as \[250\]\.$",
    "benchmark --config none.toml": "The benchmark file none.toml does not exist; give a TOML file",
    "train h.toml": r"h.toml: unknown algorithm \['ppo'\]: did you mean 'ppo'",
    "train i.toml": r"i.toml: \[environment\]: unknown id 3: known are Pantograph-v0",
    "train j.toml": "key 'lanes' must be less than or equal to 65536",
    "train k.toml": r"lanes x n_steps = 200,000,000 must be at most 50,000,000",
    "evaluate p --seeds 90000": "This evaluation has 540,000 passes; the maximum is 100,000",
    "list p.toml": "p.toml is not a valid entry: key 'masses' must hold at most 8 values",
}


@pytest.mark.parametrize("words", SAID)
def test_it_is_said_in_one_sentence_what_is_wrong(words, own):
    for name, text in CONFIGS.items():
        (own.parent / f"{name}.toml").write_text(text)
    done = panto(*words.split(), cwd=own.parent)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert re.search(SAID[words], done.stderr.rstrip("\n"))


def test_the_command_says_its_version():
    assert panto("--version").stdout == f"panto-env {panto_env.__version__}\n"


# --- actions of environments ------------------------------------------------------------------------


ODD = np.ma.masked_array(np.zeros(1), mask=True)


def made(name, **given):
    return gymnasium.make(f"panto_env:{name}", disable_env_checker=True, **given).unwrapped


@pytest.mark.parametrize("action", [np.full(1, 1 + 0j), np.full(1, "0.5"), np.full(1, None), ODD, [b"1"]])
def test_what_numpy_would_cast_is_no_action(action):
    env = made("PantographStiffness-v0")
    env.reset(seed=3)
    with pytest.raises(InputError, match="must be numbers"):
        env.step(action)


def test_the_largest_numbers_are_clipped_like_any_beyond_the_range():
    env, twin = (made("PantographStiffness-v0") for _ in range(2))
    for each, action in ((env, 1e308), (twin, 1.0)):
        each.reset(seed=3)
        each.step(np.full(1, action))
    np.testing.assert_array_equal(env.step(np.zeros(1))[0], twin.step(np.zeros(1))[0])


def test_the_lane_of_a_bad_action_and_a_missing_entry_are_named():
    env = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=3)
    env.reset(seed=0)
    with pytest.raises(InputError, match=re.escape("The action of lane 2 must be finite, not [nan]")):
        env.step(np.array([[0.0], [0.0], [np.nan]]))
    env = made("PantographStiffness-v0")
    observation, _ = env.reset(seed=0)
    with pytest.raises(InputError, match="no entry 'contact farce': did you mean 'contact force'"):
        env.context.layout.read(observation, "contact farce")


# --- settings and names -----------------------------------------------------------------------------


@pytest.mark.parametrize("odd", [HUGE, np.nan, 1j, "", "x" * 5000, "[/]", [], {}, None, b"new", int])
def test_an_odd_name_is_refused_in_a_sentence(odd):
    for find in (load_catenary, load_pantograph, find_policy):
        with pytest.raises(InputError, match=r"[.?]$") as caught:
            find(odd)
        assert len(str(caught.value)) <= LONGEST_LINE + 10


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = " + "[" * 20_000, "it is nested too deeply"),
        ("a = 1" + "0" * 5000, "is not valid TOML"),
        ("a = 1 2 # 1,5\n", "correct the file"),
        ("a\nb = 1,5\n", "correct the file"),
        ("a = 1\r\nmass = 1,35 # kg/m\r\n", "decimals need a point, not a comma, as in 1.35"),
        ("sag = [0,024, 0,041]\n", "decimals need a point, not a comma, as in 0.024"),
    ],
)
def test_a_toml_file_that_can_t_be_read_is_named(text, message, tmp_path):
    (tmp_path / "odd.toml").write_bytes(text.encode())
    with pytest.raises(InputError, match=f"odd.toml .*{message}"):
        read_toml(tmp_path / "odd.toml")


def test_a_byte_order_mark_is_no_part_of_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text_of("re250"), encoding="utf-8-sig")
    assert load_catenary(path).contact_wire == load_catenary("re250").contact_wire


def test_a_list_that_a_decimal_comma_made_twice_as_long_is_noticed(tmp_path):
    path, flat = tmp_path / "mine.toml", ", ".join(9 * ["0.0"])
    path.write_text(text_of("dsa250").replace("[7.51, 5.855, 4.645]", "[7,5, 5,8, 4,6]"))
    with pytest.raises(InputError, match=r"but 3 stiffnesses \(decimals need a point: a comma"):
        load_pantograph(path)
    for sags, message in (
        (", ".join(9 * ["0,0"]), r"9 positions are given, but 18 sags \(decimals need a point"),
        ("0.0, 0.0", r"9 positions are given, but 2 sags(?!.*decimals)"),
    ):
        path.write_text(text_of("en50318-2002").replace(flat, sags))
        with pytest.raises(InputError, match=message):
            load_catenary(path)


def kinds(parent=Settings):
    for each in parent.__subclasses__():
        yield each
        yield from kinds(each)


def test_a_truth_value_is_true_or_false():
    found = {
        (kind, name)
        for kind in kinds()
        for name, field in kind.model_fields.items()
        if kind.__module__.startswith("panto_") and field.annotation is bool
    }
    assert {name for _, name in found} >= {"bilateral", "line_values", "blind", "wear_drawn", "trusted"}
    for kind, name in found:
        for value in ("yes", 1, None):
            with pytest.raises(InputError, match=f"key '{name}' must be true or false"):
                parse(kind, {name: value}, "it")
    with pytest.raises(InputError, match="record_droppers must be True or False"):
        simulate(**QUICK, distance=50.0, record_droppers=1)
    assert run_settings({"sensors": "realistic:blind=true"}).sensors.blind


class Odd(Settings):
    whole: int = 1
    number: float = 1.0
    several: tuple[int, ...] = ()
    perhaps: int | None = None


@pytest.mark.parametrize("key", ["whole", "number", "several", "perhaps"])
@pytest.mark.parametrize("value", ["1", "1.0", True, b"1"])
def test_text_and_truth_values_are_no_numbers(key, value):
    with pytest.raises(InputError, match=rf"key '{key}(\.1)?' must be a (whole )?number"):
        parse(Odd, {key: [value] if key == "several" else value}, "it")


def test_a_missing_table_is_named_with_its_keys():
    class Outer(Settings):
        wire: Odd
        count: int

    with pytest.raises(InputError, match=r"'wire' is missing: a table of .*; key 'count' is missing: a"):
        parse(Outer, {}, "the file")


def test_of_many_wrong_keys_the_first_are_told_and_the_others_counted():
    with pytest.raises(InputError, match=r"and 32 more keys are wrong\.$") as caught:
        simulate(actuator={f"key{k}": k for k in range(40)})
    assert str(caught.value).count("is not known") == 8


def test_values_in_a_line_are_literals_truths_or_words():
    assert parse_inline("blind=true,b=[1, (2, 3)],c='x,y'") == {"blind": True, "b": [1, (2, 3)], "c": "x,y"}
    assert parse_inline("a=),b=1") == {"a": ")", "b": 1}
    for text in ("(" * 5000, "-" * 5000 + "1", "{[]: 1}"):
        assert parse_inline(f"a={text}") == {"a": text}


# --- messages and the machine -----------------------------------------------------------------------


def test_a_message_is_one_line_whatever_it_quotes():
    told = str(InputError("The line 'a\nb\r\x1b[31m\0\udc80" + "x" * 9000 + "y, z' is not known."))
    assert told.startswith(r"The line 'a\nb\r\x1b[31m\x00\udc80xxx")
    assert told.endswith("z' is not known.")
    assert len(told) < LONGEST_LINE == 1000
    assert str(InputError("σ ≤ 3 µm; give „more“.")) == "σ ≤ 3 µm; give „more“."
    assert shown("x" * 298) == repr("x" * 298)
    assert shown("x" * 299) == f"'{'x' * 149}...{'x' * 99}'"


@pytest.mark.parametrize(
    ("value", "limit", "form", "text"),
    [
        (1.504, 1.5, "+.1f", "+1.504"),
        (1.56, 1.5, ".1f", "1.6"),
        (1.5, 1.5, ".1f", "1.5"),
        (0.30004, 0.3, ".2g", "0.30004"),
        (12345.6, 12345.5, ",.6g", "12,345.6"),
        (np.nan, 1.0, ".1f", "nan"),
        (1.0 + 2**-52, 1.0, ".1f", "1.0000000000000002"),
    ],
)
def test_a_value_beside_a_limit_stands_on_its_side(value, limit, form, text):
    assert beside(value, limit, form) == text


@given(st.decimals("-99", "99", places=6), st.decimals("-99", "99", places=1), st.integers(0, 2))
def test_a_value_beside_a_limit_has_as_few_digits_as_show_its_side(value, limit, digits):
    text = beside(float(value), float(limit), f"+.{digits}f")
    fewer, side = len(text.partition(".")[2]) - 1, (value > limit) - (value < limit)
    assert (Decimal(text) > limit) - (Decimal(text) < limit) == side
    if fewer >= digits:
        rounded = Decimal(format(float(value), f".{fewer}f"))
        assert (rounded > limit) - (rounded < limit) != side


@pytest.mark.skipif(not machine.CAN_CHOOSE_CORES, reason="cores can be chosen on Linux alone")
def test_within_the_body_there_are_so_many_cores_and_then_all_again():
    before = os.sched_getaffinity(0)
    with pytest.raises(KeyError), machine.on_cores(1):  # noqa: PT012
        assert os.sched_getaffinity(0) == {min(before)}
        assert machine.cores() == 1
        raise KeyError
    assert os.sched_getaffinity(0) == before
    assert machine.cores() == len(before)


def test_a_machine_that_does_not_report_its_memory_has_no_limit(monkeypatch):
    def refuse(name):
        raise ValueError

    monkeypatch.setattr("os.sysconf", refuse)
    assert machine.memory() == float("inf")


def test_equal_arguments_get_the_cached_result_and_others_another():
    calls = []

    @remembered
    def doubled(x):
        calls.append(x)
        return np.full(3, 2 * x) if isinstance(x, float) else x

    assert doubled(1.5) is doubled(1.5)
    assert doubled(2.5)[0] == 5.0
    assert doubled([1]) == doubled([1]) == [1]  # has no hash
    assert calls == [1.5, 2.5, [1], [1]]


def test_a_line_that_differs_in_one_value_has_another_shape():
    line = load_catenary("en50318-2002")
    assert hash(line.model_copy(update={"sources": {}})) == hash(line)
    assert hang(line) is hang(load_catenary("en50318-2002"))
    changed = line.droppers.model_copy(update={"contact_clamp_mass": 0.1})
    heavier = hang(line.model_copy(update={"droppers": changed})).dropper_tension
    assert (heavier > hang(line).dropper_tension).all()
    listed = line.droppers.model_copy(update={"sag": list(line.droppers.sag)})
    again = hang(line.model_copy(update={"droppers": listed})).dropper_tension
    np.testing.assert_array_equal(again, hang(line).dropper_tension)
