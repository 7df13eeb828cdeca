"""Plug-ins of others: what they raise is said of them, and stops nothing but themselves."""

import json
import re
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from panto_agents.stored import FOLDER
from panto_env import InputError
from panto_env.base import errors, plugins
from panto_env.policies import find_policy

from ..command import panto
from ..plugin import install

SOURCES = {
    "raises": "raise RuntimeError('of their own')",
    "exits": "raise SystemExit(3)",
    "misses": "import no_such_module_anywhere",
    "misspells": "from panto_env import no_such_name",
    "garbled": "def",
}
SAID = {
    "raises": r"fails at .*their_raises\.py:1: RuntimeError: of their own; correct or uninstall it",
    "exits": r"fails at .*their_exits\.py:1: SystemExit: 3; correct or uninstall it",
    "misses": r"needs the module 'no_such_module_anywhere', which is not installed; install it",
    "misspells": r"fails at .*: ImportError: cannot import name 'no_such_name'",
    "garbled": r"fails at .*: SyntaxError: invalid syntax",
    "odd": r"fails at .*: TypeError: 42 is not",
    "gone": r"fails at .*: AttributeError: module 'their_other' has no attribute",
}
OTHER = """
import typer
LEFT = open(__file__.replace(".py", ".mark"), "w").close()
odd = 42

def greet(name: str = "you", times: int = 1):
    "Say hello."
    print("hello", name)

apps = typer.Typer()
apps.command()(greet)

def unlike(value: list[list[int]]):
    pass

class Mine:
    def __init__(self, wish=object()):
        pass
    def reset(self, context):
        pass
    def act(self, observation):
        return [0.0]

def load(path):
    raise KeyError(str(path))
"""

quiet = pytest.mark.filterwarnings("ignore::panto_env.base.errors.PlugInWarning")


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Somebody's installed package: some of it can't be imported, and some takes names of ours."""
    broken = {name: f"their_{name}:it" for name in SOURCES}
    other = {"odd": "their_other:odd", "gone": "their_other:gone"}
    modules = {f"their_{name}": source for name, source in SOURCES.items()} | {"their_other": OTHER}
    commands = {"greet": "their_other:greet", "apps": "their_other:apps", "unlike": "their_other:unlike"}
    taken = {"simulate": "their_other:greet", "benchmark": "their_other:greet"}
    policies = {"mine": "their_other:Mine", "pd": "their_other:Mine"}
    points = {
        plugins.COMMANDS: broken | other | commands | taken,
        plugins.POLICIES: broken | other | policies,
        plugins.LOADERS: broken | {"their": "their_other:load", "safetensors": "their_other:load"},
    }
    install(tmp_path / "site", points, modules)
    monkeypatch.syspath_prepend(tmp_path / "site")
    yield tmp_path / "site"
    for name in modules:
        sys.modules.pop(name, None)


def test_what_this_package_brings_is_installed_in_the_order_of_names():
    assert {"passive", "p", "pd", "fb+ff"} <= set(plugins.installed(plugins.POLICIES))
    assert list(plugins.installed(plugins.COMMANDS)) == sorted(plugins.installed(plugins.COMMANDS))
    assert "safetensors" in plugins.installed(plugins.LOADERS)


def test_a_missing_package_is_named():
    point = EntryPoint("cleverest", "no_such_package.policies:Policy", plugins.POLICIES)
    with pytest.raises(
        InputError, match=r"'cleverest' of an unknown package needs the module 'no_such_package'"
    ):
        plugins.load(point)


@pytest.mark.slow
@quiet
def test_a_plug_in_that_can_t_be_loaded_stops_no_other_command(site):
    for words in ("--version", "--help", "simulate --help", "list pd"):
        assert panto(*words.split()).returncode == 0
    assert not (site / "their_other.mark").exists()
    assert "A plug-in of plugin." in panto("--help").stdout
    assert panto("greet", "--name", "them").stdout == "hello them\n"
    assert panto("apps", "greet").stdout == "hello you\n"
    assert (site / "their_other.mark").exists()
    told = json.loads(panto("list", "--json").stdout)["policy"]
    assert "RuntimeError: of their own" in told["raises"]["description"]
    assert told["mine"]["parameters"]["wish"].startswith("<object object")
    assert np.isclose(told["pd"]["parameters"]["gain"], find_policy("pd").gain)


@pytest.mark.longer
@quiet
def test_it_is_said_what_is_wrong_with_it(site):
    for name, why in SAID.items():
        said = rf"The plug-in '{name}' of plugin {why}"
        (line,) = [each for each in panto(name).stderr.splitlines() if "is left out" not in each]
        assert re.match(f"panto: {said}", line)
        with pytest.raises(InputError, match=said):
            find_policy(name)


@quiet
def test_a_command_that_typer_does_not_take_and_a_loader_that_fails(site, tmp_path):
    done = panto("unlike")
    assert done.returncode == 2
    assert "The plug-in 'unlike' of plugin fails at " in done.stderr
    (tmp_path / "a.their").touch()
    with pytest.raises(
        InputError, match=r"The plug-in 'their' of plugin fails at .*their_other\.py:\d+: KeyError"
    ):
        find_policy(str(tmp_path / "a.their"))


def test_one_that_takes_a_name_of_ours_is_left_out_and_named(site):
    for name, arguments in (("benchmark", ["benchmark", "--help"]), ("simulate", ["simulate", "--help"])):
        done = panto(*arguments)
        assert "Say hello." not in done.stdout
        assert f"The plug-in '{name}' (panto_env.commands) of plugin is left out" in done.stderr
        assert "that name is taken by panto-env; uninstall one of them" in done.stderr
    with pytest.warns(errors.PlugInWarning, match=r"The plug-in 'pd' \(panto_env.policies\) of plugin"):
        assert type(find_policy("pd")).__module__.startswith("panto_baselines")
    with pytest.warns(errors.PlugInWarning, match="The plug-in 'safetensors'"):
        assert type(find_policy(str(FOLDER / "head.safetensors"))).__module__.startswith("panto_agents")


@pytest.mark.longer
@quiet
def test_a_tuning_does_not_load_them(site):
    from panto_baselines.tuning.tune import tunable

    assert tunable("tuned-pd").TUNED
    with pytest.raises(InputError, match=r"'p' has no gains to tune; policies with gains are .*tuned-pd"):
        tunable("p")
