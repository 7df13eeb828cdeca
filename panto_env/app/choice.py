"""What is chosen on the page, its run, and the same run as Python code and as commands."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Callable
from functools import cache
from itertools import chain
from typing import Any, NamedTuple

from ..analysis.options import RENAMED
from ..analysis.simulation import simulate
from ..base.errors import InputError, suggest
from ..catalog import available
from ..control.settings import default
from ..metrics.compliance import Requirement
from ..plant.line_condition import LINE_CONDITIONS
from ..policies import policy_names
from ..report.findings import Findings

PASSIVE = "passive"
HARDWARE = ("ideal", "realistic")  # presets that both actuators and sensors have
MEANS = ("as the pantograph", "en50367")
"""How the mean force is set: as the pantograph's data say, or trimmed for that standard's maximum."""
CODE = """\
from panto_env import simulate

run = simulate({arguments})
print(run.summary())
for _, each in run.requirements():
    print(each.heading, each.value, each.verdict)
"""
TITLES = {
    "catenary": "Line",
    "pantograph": "Pantograph",
    "speed_kmh": "Speed (km/h)",
    "policy": "Policy",
    "line_condition": "Condition of the line",
    "hardware": "Actuator and sensors",
    "mean_force": "Mean force",
    "seed": "Seed of all that is random",
}
"""Titles of the fields of a choice."""


class Choice(NamedTuple):
    """What is chosen on the page."""

    catenary: str = "re250"
    pantograph: str = "dsa380"
    speed_kmh: float = 250
    policy: str = PASSIVE
    line_condition: str = "new"
    hardware: str = HARDWARE[0]
    mean_force: str = MEANS[0]
    seed: int = 0

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of ``simulate`` without those that have their default."""
        given = self._asdict()
        given["actuator"] = given["sensors"] = given.pop("hardware")
        usual = {"policy": PASSIVE, "mean_force": MEANS[0], "seed": 0}
        usual |= {name: default(name) for name in ("line_condition", "actuator", "sensors")}
        return {name: value for name, value in given.items() if name not in usual or value != usual[name]}

    @property
    def title(self) -> str:
        """Pantograph, line, speed and policy in words."""
        return f"{self.pantograph} on {self.catenary} at {self.speed_kmh:g} km/h, {self.policy}"

    @property
    def texts(self) -> dict[str, str]:
        """The run as commands and as Python code that prints its figures, by what they are."""
        given = self.arguments
        flags = {name: f"--{RENAMED.get(name, name).replace('_', '-')}" for name in given if name != "policy"}
        options = [word for name, flag in flags.items() for word in (flag, str(given[name]))]
        policy = ["--policy", self.policy] if "policy" in given else []
        film = ["panto", "film", self.policy, *options, "--output", "pass.mp4"]
        return {
            "command": shlex.join(["panto", "simulate", *options, *policy]),
            "Python": CODE.format(arguments=", ".join(f"{name}={value!r}" for name, value in given.items())),
            "command of a film (extra 'render')": shlex.join(film),
        }


@cache
def offered() -> dict[str, list[str] | dict[str, list[str]]]:
    """What each field with names may be, by field; groups of names where there are several kinds."""
    agents = [name for name in policy_names() if name.startswith("agent")]
    references = [name for name in policy_names() if name not in (PASSIVE, *agents)]
    return {
        "catenary": {
            "lines": list(available("catenary")),
            "families, one line drawn": [f"family:{name}" for name in available("family")],
            "sections, one line drawn": [f"section:{name}" for name in available("section")],
        },
        "pantograph": list(available("pantograph")),
        "policy": {"without control": [PASSIVE], "references": references, "agents": agents},
        "line_condition": list(LINE_CONDITIONS),
        "hardware": list(HARDWARE),
        "mean_force": list(MEANS),
    }


def check(choice: Choice) -> None:
    """Raise InputError unless all names are offered ones.

    The page offers no others, but a program that pretends to be a browser could send any: as a policy, a file
    of Python code.
    """
    for field, names in offered().items():
        known = list(chain(*names.values())) if isinstance(names, dict) else names
        if getattr(choice, field) not in known:
            raise InputError(f"{TITLES[field]}: {suggest(str(getattr(choice, field)), known)}.")


class Seen(NamedTuple):
    """What came of a choice: findings and requirements, or a sentence that says why there are none."""

    choice: Choice
    found: Findings | None  # None: there was no run
    requirements: list[Requirement]  # none of a run that ended early
    error: str
    warnings: list[str]


def look(choice: Choice, progress: Callable[[float], None] | None = None) -> Seen:
    """Run a choice. Invalid input becomes the error of what is returned; progress: as ``simulate`` has it.

    The warnings of the whole process are caught meanwhile, so that one run at a time may be looked at.
    """
    found, requirements, error = None, [], ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            check(choice)
            run = simulate(**choice.arguments, record_droppers=False, progress=progress)
            found = Findings(run, choice.title)
            if run.terminated:
                error = f"{run.ending} It has no figures."
            else:
                requirements = run.requirements()
        except InputError as refused:
            error = str(refused)
    return Seen(choice, found, requirements, error, list(dict.fromkeys(str(each.message) for each in caught)))
