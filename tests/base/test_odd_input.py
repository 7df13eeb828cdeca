"""What no user means to give, to the library: one sentence, and nothing has changed."""

from __future__ import annotations

import copy
import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from matplotlib.figure import Figure

from panto_env import InputError, simulate
from panto_env.analysis.options import parse_spans
from panto_env.analysis.plots import plot_run, save
from panto_env.base import machine
from panto_env.base.errors import LONGEST_LINE, beside, shown
from panto_env.base.files import read_toml, write_whole
from panto_env.base.settings import Settings, parse, parse_inline
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.envs import IDS
from panto_env.policies import find_policy

HUGE = 10**400
LONG = "x" * 5000


class Strange:
    """Cannot even be shown."""

    def __repr__(self):
        raise RuntimeError("no")

    def __array__(self, *_, **__):
        raise RuntimeError("no")


ODD = {
    "huge": HUGE,
    "huge as text": str(HUGE),
    "minus": -HUGE,
    "nan": np.nan,
    "infinite": np.inf,
    "complex": 1j,
    "empty": "",
    "long": LONG,
    "null file": "\0.toml",
    "broken file": "\udc80.toml",
    "markup": "[/]",
    "list": [],
    "a table": {},
    "nothing": None,
    "bytes": b"new",
    "strange": Strange(),
    "a type": int,
}


def sentence(error):
    message = str(error)
    assert message.endswith((".", "?")), message[-200:]
    assert message.isprintable()
    assert len(message) <= LONGEST_LINE + 10


@pytest.mark.parametrize("odd", ODD)
def test_an_odd_name_is_refused_in_a_sentence(odd):
    for find in (load_catenary, load_pantograph, find_policy):
        with pytest.raises(InputError) as caught:
            find(ODD[odd])
        sentence(caught.value)


@pytest.mark.parametrize(
    "odd", ["nan", "infinite", "minus", "complex", "huge as text", "list", "strange", "nothing"]
)
def test_an_odd_seed_is_refused(odd):
    with pytest.raises(InputError, match="seed must be a whole number from 0 up"):
        simulate("periodic-stiffness", "three-mass", seed=ODD[odd])


@pytest.mark.parametrize(
    "text", ["²-³", "٣-٤", "1-²", "-1-2", "1-", "1-2-3", f"1-{HUGE}", f"1-{'9' * 5000}", "", "\0"]
)
def test_odd_digits_are_no_spans(text):
    with pytest.raises(InputError):
        parse_spans(text)


def test_spans_beyond_any_line_are_refused():
    spans = (1, HUGE)
    with pytest.raises(InputError, match="counted from 1 to 1000"):
        simulate("periodic-stiffness", "three-mass", distance=100.0, trimmed_over=spans).summary(spans)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = " + "[" * 20_000, "it is nested too deeply"),
        ("a = 1" + "0" * 5000, "is not valid TOML"),
        ("a = [", "is not valid TOML"),
    ],
)
def test_a_toml_file_that_can_t_be_read_is_named(text, message, tmp_path):
    (tmp_path / "odd.toml").write_text(text)
    with pytest.raises(InputError, match=f"odd.toml .*{message}"):
        read_toml(tmp_path / "odd.toml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (f"{LONG}.toml", "cannot be a file: the maximum is 200"),
        ("\0.toml", "null byte"),
        ("\udc80", "UTF-8"),
    ],
)
def test_a_name_that_no_file_can_have_is_refused(name, message):
    with pytest.raises(InputError, match=message):
        read_toml(name)
    with pytest.raises(InputError, match=message), write_whole(name):
        pytest.fail("something would have been written")


def test_a_value_that_is_no_literal_is_a_word():
    for text in ("(" * 5000, "-" * 5000 + "1", "{[]: 1}"):
        assert parse_inline(f"a={text}") == {"a": text}


def test_commas_outside_brackets_separate_also_behind_one_that_closes_nothing():
    assert parse_inline("b=[1, (2, 3)],c='x,y'") == {"b": [1, (2, 3)], "c": "x,y"}
    assert parse_inline("a=),b=1") == {"a": ")", "b": 1}


def test_values_are_shown_whole_up_to_300_letters():
    assert shown("x" * 298) == repr("x" * 298)
    assert shown("x" * 299) == f"'{'x' * 149}...{'x' * 99}'"


def test_a_machine_that_does_not_report_its_memory_has_no_limit(monkeypatch):
    for error in (OSError, ValueError, AttributeError):

        def refuse(name, error=error):
            raise error

        monkeypatch.setattr("os.sysconf", refuse)
        assert machine.memory() == float("inf")


def test_a_missing_table_is_named_with_its_keys():
    class Inner(Settings):
        mass: float

    class Outer(Settings):
        wire: Inner
        count: int

    with pytest.raises(
        InputError, match="'wire' is missing: a table of mass; key 'count' is missing: a value"
    ):
        parse(Outer, {}, "the file")


def test_a_name_that_is_no_mathematics_is_drawn_as_it_is(tmp_path):
    line = load_catenary("periodic-stiffness").model_copy(update={"name": r"$\bad{$ and $_$"})
    run = simulate(line, "three-mass", distance=100.0)
    save(plot_run(run, "all"), tmp_path / "run.png")
    assert (tmp_path / "run.png").stat().st_size > 1000


def test_a_label_of_two_lines_is_drawn_without_a_word(tmp_path, caplog):
    figure = Figure()
    figure.subplots().set(title=r"$\sigma$" + "\nover two lines", ylabel="force\n(N)")
    save(figure, tmp_path / "figure.png")
    assert caplog.records == []


# --- actions --------------------------------------------------------------------------------------


def odd_actions(shape):
    """Of an environment with this shape of actions: what is given, and a word of what is said of it."""

    def filled(value, dtype=None):
        return np.full(shape, value, dtype=dtype)

    masked = np.ma.masked_array(np.zeros(shape), mask=True)
    return [
        (masked, "must be numbers"),
        (np.ma.masked_array(np.zeros(shape, dtype=np.float32)), "must be numbers"),
        (filled(0.5 + 0j), "must be numbers"),
        (filled(0.5 + 0j).tolist(), "must be numbers"),
        (filled("0.5"), "must be numbers"),
        (filled("0.5").tolist(), "must be numbers"),
        (filled(b"1"), "must be numbers"),
        (filled(None), "must be numbers"),
        (filled(None, object), "must be numbers"),
        (filled(HUGE, object), "must be numbers"),
        (filled(object(), object), "must be numbers"),
        (filled(np.datetime64("2020-01-01")), "must be numbers"),
        (filled(np.nan), "must be finite"),
        (filled(np.inf, np.float32), "must be finite"),
        (filled(-np.inf), "must be finite"),
        (None, "must be numbers"),
        ("up", "must be numbers"),
        (b"up", "must be numbers"),
        (Strange(), "must be numbers"),
        ({}, "must be numbers"),
        ({0.5}, "must be numbers"),
        ([[0.5], [0.5, 0.5]], "must be numbers"),
        (0.5, "must have the shape"),
        (np.zeros((*shape, 1)), "must have the shape"),
        (np.zeros(0), "must have the shape"),
        (np.zeros((7, *shape)), "must have the shape"),
    ]


def made(name, lanes, place):
    actuator = {"place": place}
    if lanes is None:
        return gymnasium.make(f"panto_env:{name}", actuator=actuator, disable_env_checker=True).unwrapped
    return gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, actuator=actuator).unwrapped


@pytest.mark.parametrize("place", ["frame", "both"])
@pytest.mark.parametrize("lanes", [None, 1, 3])
@pytest.mark.parametrize("name", IDS)
def test_an_odd_action_is_refused_and_changes_nothing(name, lanes, place):
    env = made(name, lanes, place)
    env.reset(seed=3)
    shape = env.action_space.shape
    usual = np.full(shape, 0.25, dtype=np.float32)
    env.step(usual)
    twin = copy.deepcopy(env)
    for action, words in odd_actions(shape):
        with pytest.raises(InputError, match=words) as caught:
            env.step(action)
        sentence(caught.value)
    for _ in range(3):
        ours, theirs = env.step(usual), twin.step(usual)
        np.testing.assert_array_equal(ours[0], theirs[0])
        np.testing.assert_array_equal(ours[1], theirs[1])


@pytest.mark.parametrize("lanes", [None, 3])
def test_the_largest_numbers_are_clipped_like_any_beyond_the_range(lanes):
    """However many: their sum is no number."""
    env, twin = (made("Pantograph-v0", lanes, "both") for _ in range(2))
    for each in (env, twin):
        each.reset(seed=3)
    shape = env.action_space.shape
    for sign in (1, -1):
        ours, theirs = env.step(np.full(shape, sign * 1e308)), twin.step(np.full(shape, float(sign)))
        np.testing.assert_array_equal(ours[0], theirs[0])
        np.testing.assert_array_equal(ours[1], theirs[1])


def test_the_lane_of_a_bad_action_is_named():
    env = made("PantographStiffness-v0", 3, "frame")
    env.reset(seed=0)
    with pytest.raises(InputError, match=re.escape("The action of lane 2 must be finite, not [nan]")):
        env.step(np.array([[0.0], [0.0], [np.nan]]))


@pytest.mark.parametrize(
    "returned", ["np.ma.masked_array([0.5], mask=[True])", "np.array([1j])", "['0.5']", "'up'"]
)
def test_an_odd_action_of_a_policy_is_refused(returned, tmp_path: Path):
    (tmp_path / "odd.py").write_text(
        "import numpy as np\n"
        "class Odd:\n"
        "    def reset(self, context): pass\n"
        f"    def act(self, observation): return {returned}\n"
    )
    with pytest.raises(InputError, match="its action must be finite numbers"):
        simulate("periodic-stiffness", "three-mass", policy=f"{tmp_path}/odd.py:Odd", distance=100.0)


def test_a_message_is_one_line_whatever_it_quotes():
    odd = "a\nb\r\x1b[31m\0\udc80" + "x" * 5000 + " " * 5000 + "y, z" * 3000
    told = str(InputError(f"The line '{odd}' is not known."))
    assert told.isprintable()
    assert len(told) < LONGEST_LINE
    assert told.startswith(r"The line 'a\nb\r\x1b[31m\x00\udc80xxx")
    assert told.endswith("z' is not known.")
    assert str(InputError("σ ≤ 3 µm; give „more“.")) == "σ ≤ 3 µm; give „more“."


def test_of_many_wrong_keys_the_first_are_told_and_the_others_counted():
    table = {f"key{k}": k for k in range(40)}
    with pytest.raises(InputError, match=r"and 32 more keys are wrong\.$") as caught:
        simulate(actuator=table)
    assert str(caught.value).count("is not known") == 8


@pytest.mark.parametrize(
    ("value", "limit", "form", "text"),
    [
        (1.504, 1.5, "+.1f", "+1.504"),
        (-1.50001, -1.5, "+.1f", "-1.50001"),
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
