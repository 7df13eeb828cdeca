"""An option that takes one value is given once: of two the last had been taken, without a word."""

import pytest

from ..command import panto, whole


def single_options(command, words=()):
    """Words of every command, and those of its options that take one value."""
    for name, below in getattr(command, "commands", {}).items():
        yield from single_options(below, (*words, name))
    if not hasattr(command, "commands"):
        for each in command.params:
            if each.param_type_name == "option" and not (each.multiple or each.is_eager):
                yield words, each


OPTIONS = [
    pytest.param(words, each, id=f"{' '.join(words)} {max(each.opts, key=len)}")
    for words, each in single_options(whole())
]


def test_there_are_hundreds():
    assert len(OPTIONS) > 150
    assert len({words for words, _ in (each.values[:2] for each in OPTIONS)}) > 20


@pytest.mark.parametrize(("words", "option"), OPTIONS)
def test_an_option_given_twice_is_refused(words, option, tmp_path):
    value = [] if option.is_flag else ["1"] * option.nargs
    for flag in option.opts:
        done = panto(*words, flag, *value, option.opts[0], *value, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr == f"panto: {max(option.opts, key=len)} is given twice; give it once.\n"
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("simulate", "--catenary", "a", "--speed", "3", "--catenary=b"), "--catenary is given twice"),
        (("simulate", "--json", "--json", "--json"), "--json is given 3 times; give it once"),
        (("benchmark", "--speed", "x", "--speed", "x"), "Invalid value for '--speed'"),  # it may be repeated
        (("simulate", "--pantograph", "a", "--pantograf", "b"), "No such option"),
        (("simulate", "--pantograph", "x", "--", "--pantograph"), "unexpected extra argument"),
    ],
)
def test_in_one_sentence(arguments, words):
    done = panto(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


def test_help_may_be_asked_for_twice():
    assert panto("simulate", "--help", "-h").returncode == 0
    assert panto("--version", "--version").returncode == 0
