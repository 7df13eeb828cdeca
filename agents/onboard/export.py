"""A policy as a C99 file and its header, for a controller on a train."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from panto_env.base.arrays import to_kmh
from panto_env.base.checksums import __version__
from panto_env.base.errors import InputError
from panto_env.base.files import write_text
from panto_env.control import Task
from panto_env.control.lines import on_example
from panto_env.control.settings import run_settings
from panto_env.plant.state import Place
from panto_env.policies import find_policy, wishes

from ..evaluation import NOT_OF_A_PASS
from ..model_file import Facts
from ..policy import TrainedPolicy
from ..settings import arguments
from . import acting, seeing
from .parts import Table, parts_of, without_guard
from .translate import Translation

READINGS = (
    ("head_displacement", "m", "of the head, up, from the wire's height at rest"),
    ("frame_displacement", "m", "of the frame, up, from the height that goes with it"),
    ("head_velocity", "m/s", "positive upwards"),
    ("frame_velocity", "m/s", "positive upwards"),
    ("contact_force", "N", "between contact strip and wire"),
    ("place", "spans", "whole part: number of the span, rising; fraction: share of it that is passed"),
    ("speed", "m/s", "of the train"),
)
"""Name, unit and meaning of the readings of every policy, in the order of ``seeing``."""
WRAPPER = resources.files(__package__) / "wrapper"
WIDTH = 96
"""Letters of a line of comment."""


@dataclass(frozen=True)
class Variable:
    """An input or an output of a controller."""

    name: str
    unit: str
    description: str


@dataclass(frozen=True)
class Exported:
    """A policy as C99, and what a caller must know of it; ``controller`` runs the same in Python."""

    name: str  # with which all public names in C begin
    source: str  # the C file
    header: str  # NAME.h, which the C file includes
    inputs: tuple[Variable, ...]  # fields of NAME_readings, in order, all double
    outputs: tuple[Variable, ...]  # elements of ``force``, in order
    interval: float  # time between two calls of NAME_step (s)
    card: str  # what the policy is, and was made for
    constants: Table
    state: Table

    def controller(self) -> Controller:
        """The controller in Python, by the functions from which the C is made."""
        return Controller(self)

    def write(self, path: str | Path) -> tuple[Path, Path]:
        """Write the C file, and the header beside it; their paths. Raises InputError where that fails."""
        source = Path(path)
        header = source.with_name(f"{self.name}.h")
        write_text(header, self.header)
        write_text(source, self.source)
        return source, header


class Controller:
    """A controller that runs in plain Python: slow, for comparison."""

    def __init__(self, exported: Exported) -> None:
        self._constants = SimpleNamespace(**exported.constants)
        self._initial, self._outputs = exported.state, len(exported.outputs)
        self.begin()

    def begin(self) -> None:
        """Begin anew, as NAME_init does."""
        self._state = SimpleNamespace(**deepcopy(self._initial))
        acting.begin(self._constants, self._state)

    def step(self, readings: Sequence[float]) -> list[float]:
        """Forces (N) for the readings of a step, in the order of ``Exported.inputs``."""
        force = [0.0] * self._outputs
        acting.step(self._constants, self._state, readings, force)
        return [float(each) for each in force]


def exported(policy: Any, name: str | None = None, **settings: Any) -> Exported:
    """A policy as C99.

    policy: a model file, a name, or an object, as ``simulate`` takes it. name: for C; by default made of the
    policy's. settings: those of a run, such as catenary and pantograph; others are as in the policy's
    training, and for one that was not trained those of Pantograph-v0. Of several pantographs that are
    controlled it is for the first. Scales of readings, the length of
    spans, the guard's model and the force limit come from them.

    Raises InputError, one sentence, for a policy that has no form in C or does not fit the settings, and for
    a name that C does not take.
    """
    driver = find_policy(policy)
    words = str(policy) if isinstance(policy, str | Path) else type(policy).__name__
    called = name or name_in_c(words)
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,40}", called):
        raise InputError(
            f"'{called}' is not a name in C; give one of letters, digits and _, such as controller."
        )
    inner = without_guard(driver)
    facts = inner.facts if isinstance(inner, TrainedPolicy) else None
    task = _task(driver, facts, settings)
    context = task.context(0)
    driver.reset(context)  # refuses a task that it was not trained for
    constants, state = parts_of(driver, words, task)
    inputs = [Variable(*each) for each in READINGS]
    felt = "contact force that the pantograph in front felt"
    for k, place in enumerate(context.layout.front):
        inputs.append(Variable(f"front_force_{k}", "N", f"{felt} {place:g} m ahead"))
    places = [Place(channel).name.lower() for channel in context.channels]
    for k in range(constants["inputs"] - len(inputs)):
        inputs.append(Variable(f"actuator_force_{k}", "N", f"of the actuator on the {places[k]}"))
    limit = f"within {context.force_limit:g} N either way, positive upwards"
    outputs = tuple(
        Variable(f"{each}_force", "N", f"of the actuator on the {each}, {limit}") for each in places
    )
    translation = Translation(constants, state, f"{called}_state")
    translation.add(acting.begin)
    translation.add(acting.step)
    interval = context.control_interval
    varied = [] if facts is None else [item for each in facts.variants for item in each.items()]
    kinds = sorted({f"{key} {value}" for key, value in varied if key != "faults"})
    told: dict[str, Any] = {"name": words, "version": __version__, "facts": facts, "kinds": kinds}
    told |= {"guarded": inner is not driver, "kmh": [to_kmh(speed) for speed in task.settings.speeds]}
    card = rendered("card.txt", told | {"context": context})
    forces = "; ".join(f"[{k}] {each.description} ({each.unit})" for k, each in enumerate(outputs))
    call = (
        f"One control step, every {interval:g} s. force: {forces}. A reading that is no finite number, or "
        f"above {seeing.LARGEST:g}, counts as its last good one; until each was good once, force is 0. It "
        "stays finite and within its limit whatever is read."
    )
    given = {"name": called, "inputs": inputs, "translation": translation, "card": card, "call": call}
    source, header = (rendered(name, given) for name in ("controller.c", "controller.h"))
    return Exported(called, source, header, tuple(inputs), outputs, interval, card, constants, state)


def rendered(name: str, values: Mapping[str, Any]) -> str:
    """A text with values, from its template in the folder ``wrapper``."""
    from jinja2 import Environment, StrictUndefined  # slow to import

    options: Any = {"undefined": StrictUndefined, "trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(**options, keep_trailing_newline=True)
    environment.filters |= {"comment": _comment, "xml": partial(escape, entities={'"': "&quot;"})}
    return environment.from_string((WRAPPER / f"{name}.jinja").read_text()).render(values)


def name_in_c(words: str) -> str:
    """A policy's or a file's name, of the letters that C takes."""
    plain = re.sub(r"\.(safetensors|c)$", "", Path(words).name)
    return re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")


def _task(driver: Any, facts: Facts | None, settings: dict[str, Any]) -> Task:
    """A task that has been reset, with the settings of the policy's training where others are not given."""
    trained, variants = ({}, ()) if facts is None else (facts.environment, facts.variants)
    environment = arguments({"id": "Pantograph-v0"} | trained)
    given = {key: value for key, value in environment.items() if key not in NOT_OF_A_PASS[1:]}
    low, high = (np.ravel(given["speed_kmh"])[end] for end in (0, -1))
    slowest = min([low, *(np.min(each["speed_kmh"]) for each in variants if "speed_kmh" in each)])
    # The memory of earlier spans must hold them at the lowest speed of the training.
    given |= {"speed_kmh": (float(slowest), float(high)), "pantograph_scatter": 0.0, "faults": ()}
    given |= wishes(driver) | settings
    example = on_example(run_settings(given))
    # A drawn line may be for fewer speeds.
    speeds = (float(np.min(given["speed_kmh"])), float(np.max(example.speed_kmh)))
    task = Task(example.model_copy(update={"speed_kmh": speeds}), keep_samples=False)
    task.reset(0, np.random.default_rng(0))
    return task


def _comment(text: str) -> str:
    """A comment in C; no text of a model file can end it early, or hold letters that a compiler refuses."""
    plain = text.replace("??", "? ?").replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")
    plain = plain.encode("ascii", "replace").decode()
    lines = [line for each in plain.splitlines() for line in textwrap.wrap(each, WIDTH) or [""]]
    return "/*\n" + "\n".join(f" * {line}" for line in lines) + "\n */"
