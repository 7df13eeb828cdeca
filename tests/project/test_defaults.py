"""A default is part of the interface: whoever changes one changes results, and says so here.

python -m tests.project.test_defaults   # writes defaults.txt anew
"""

import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

from panto_env.base.settings import Settings
from panto_env.control.faults import FAULTS
from panto_env.control.reward import REWARDS
from panto_env.envs import IDS
from panto_env.estimation.model import ESTIMATORS
from panto_env.plant.actuators import ACTUATOR_PRESETS
from panto_env.plant.line_condition import LINE_CONDITIONS
from panto_env.plant.sensors import SENSOR_PRESETS

from ..command import whole

STORED = Path(__file__).with_name("defaults.txt")
PACKAGES = ("panto_env", "panto_baselines", "panto_agents")
PRESETS = {
    "actuator": ACTUATOR_PRESETS,
    "estimator": ESTIMATORS,
    "fault": FAULTS,
    "line condition": LINE_CONDITIONS,
    "reward": REWARDS,
    "sensors": SENSOR_PRESETS,
}


def kinds(parent=Settings):
    """All classes of settings, whose modules have been imported."""
    for each in parent.__subclasses__():
        yield each
        yield from kinds(each)


def functions(module):
    """Name and defaults of the functions that users import from a module: those in its ``__all__``."""
    for name in getattr(module, "__all__", ()):
        if inspect.isfunction(function := getattr(module, name)):
            parameters = inspect.signature(function).parameters.values()
            given = {each.name: each.default for each in parameters if each.default is not each.empty}
            yield f"function {function.__module__}.{name}", given


def options(command, name="panto"):
    """Name and defaults of the options of a command and those below it; without those that have none."""
    for word, below in getattr(command, "commands", {}).items():
        yield from options(below, f"{name} {word}")
    yield name, {each.name: each.default for each in command.params if each.default not in (None, False)}


def defaults():
    """One line per class of settings, preset, id, function and command: its name, and what it sets."""
    told = dict(options(whole()))
    for package in map(importlib.import_module, PACKAGES):
        told |= functions(package)
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if "__main__" not in module.name:
                told |= functions(importlib.import_module(module.name))
    told = {name: given for name, given in told.items() if given}
    told |= {
        f"{kind.__module__}.{kind.__qualname__}": {
            name: field.get_default(call_default_factory=True)
            for name, field in kind.model_fields.items()
            if not field.is_required() and name != "version"
        }
        for kind in kinds()
        if kind.__module__.partition(".")[0] in PACKAGES
    }
    told |= {f"{name} {key}": each for name, preset in PRESETS.items() for key, each in preset.items()}
    told |= {f"id {name}": each for name, each in IDS.items()}
    return "".join(f"{name}: {value}\n" for name, value in sorted(told.items()))


@pytest.mark.plain
def test_defaults_are_those_that_are_stored():
    pytest.importorskip("stable_baselines3")
    assert defaults() == STORED.read_text(encoding="utf-8")


if __name__ == "__main__":
    STORED.write_text(defaults(), encoding="utf-8")
