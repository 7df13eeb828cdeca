"""One pass along a line, under a policy or none."""

from __future__ import annotations

import inspect
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from functools import partial
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, shown
from ..control import Task, passive_mean, trim_of_pass
from ..control.arguments import check_arguments, parameters
from ..control.lines import on_drawn_line
from ..control.record import identity, settings_of
from ..control.settings import RunSettings, default, far_enough, run_settings
from ..control.state import Result
from ..metrics.figures import SpanChoice
from ..metrics.low_pass import low_pass
from ..metrics.trajectory import SUFFIXES, Trajectory
from ..plant.catenary import CATENARIES
from ..plant.state import Row
from ..policies import Policy, check_named, checked_action, errors_name, find_policy, wishes

OFF_LINE = 1e-6
"""Position before the line's start (m) from which on a pantograph waits: nearer is rounding."""
_LINE, _PANTOGRAPH, _SPEED_KMH = (default(name) for name in ("catenary", "pantograph", "speed_kmh"))


def simulate(
    catenary: Any = _LINE,
    pantograph: Any = _PANTOGRAPH,
    speed_kmh: float = _SPEED_KMH,
    policy: Any = None,
    *,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    watch: Callable[[Task], None] | None = None,
    record_droppers: bool = True,
    trimmed_over: SpanChoice = None,
    **settings: Any,
) -> Trajectory:
    """Simulate one pass of a pantograph along a line.

    policy: None, a name ("pd"), a model file, or an object with reset and act, which is named by its
    attribute ``name`` if it has one, else by its class. It gets the observation of its attribute
    ``observation``, unless that is among the settings. Each of several controlled pantographs has a copy of
    its own; or a list gives one for each. seed: of all random values and the sensors' noise.
    progress: called with the finished share. watch: called with the running task, lane 0 of which is this
    pass, after each control step, or after several without a policy; it must change nothing.
    record_droppers: keep the tension of every dropper. trimmed_over: spans over which a required mean force
    is met, as in ``Trajectory.summary``, whichever spans are evaluated later; by default those after the
    start, or the whole run where it has none. catenary, pantograph, speed_kmh and settings: those of
    ``RunSettings``; the full list is in the signature and in ``help(panto_env.envs.PantographEnv)``.

    A run that leaves the plant's valid range ends there, with or without a policy: it is ``terminated``, and
    its ``ending`` says where and why.

    Raises InputError for a value that is not valid, TypeError for an unknown argument.
    """
    check_arguments(settings, RunSettings, "simulate")
    if not (isinstance(seed, Integral) and seed >= 0):
        raise InputError(f"seed must be a whole number from 0 up, not {shown(seed)}.")
    if not isinstance(record_droppers, bool):
        raise InputError(f"record_droppers must be True or False, not {shown(record_droppers)}.")
    several = policy if isinstance(policy, list | tuple) else [policy]
    drivers = [] if policy is None else [find_policy(each) for each in several]
    given = {"catenary": catenary, "pantograph": pantograph, "speed_kmh": speed_kmh}
    given |= wishes(drivers[0] if drivers else None) | settings
    task = _ready(given, seed, trimmed_over, record_droppers)
    line = task.settings.line
    CATENARIES[line.kind].warn_if_short(line, task.settings.numerics, task.settings.runs)
    if not drivers:
        task.run_passively(watch)
        return task.trajectory(0, seed=seed, last=True)
    first = several[0]
    name = first if isinstance(first, str) else str(getattr(first, "name", type(first).__name__))
    for share in steps_of_policy(task, drivers, name):
        if progress is not None:
            progress(share)
        if watch is not None:
            watch(task)
    return task.trajectory(0, policy=name, seed=seed, last=True)


def passive_at_mean(
    *, mean_force: float | Sequence[float], trimmed_over: tuple[int, int], seed: int, **settings: Any
) -> Trajectory:
    """Pass without a policy whose mean force (N) over the spans is the given one; of a train, one for each.

    The same as ``simulate`` gives without droppers, but the pass that has met the mean is not run again.
    Raises InputError as ``simulate`` does.
    """
    given = {"catenary": _LINE, "pantograph": _PANTOGRAPH} | settings | {"mean_force": mean_force}
    checked = _on_its_line(given, np.random.default_rng(seed))
    met: deque[Trajectory] = deque(maxlen=1)
    still = all(each == each.in_still_air for each in checked.line_condition)
    if still and not checked.line.tunnels:  # it is trimmed in still air in the open
        trim_of_pass(checked, seed, trimmed_over, partial(passive_mean, keep=met.append))
    if met:
        return met[0]
    return simulate(**given, seed=seed, trimmed_over=trimmed_over, record_droppers=False)


def _on_its_line(given: dict[str, Any], random: np.random.Generator) -> RunSettings:
    """Settings of a pass, on the line that it has."""
    return far_enough(on_drawn_line(run_settings(given), lambda: random))


def _ready(given: dict[str, Any], seed: int, trimmed_over: SpanChoice, record_droppers: bool) -> Task:
    random = np.random.default_rng(seed)
    checked = _on_its_line(given, random)
    trim = trim_of_pass(checked, seed, trimmed_over, passive_mean)
    task = Task(checked, record_droppers=record_droppers, trim=trim)
    task.reset(0, random)
    return task


def ready_pass(policy: Any, settings: dict[str, Any], seed: int) -> tuple[Task, Policy]:
    """A task and its policy, ready for ``steps_of_policy``: the same pass as ``simulate`` makes.

    Raises InputError as ``simulate`` does.
    """
    driver = find_policy(policy)
    return _ready(wishes(driver) | settings, seed, None, record_droppers=False), driver


def steps_of_policy(task: Task, policy: Policy | Sequence[Policy], name: str) -> Iterator[float]:
    """Control lane 0, already reset, to the end of its run; yields the finished share after each step.

    policy: one, of which further controlled pantographs have copies, or one for each of them; each acts from
    where its pantograph comes onto the line. name: of the policy, for errors. Raises InputError where the
    policy fails, its action is not finite or has the wrong shape, or there are more or fewer policies than
    controlled pantographs.
    """
    given = list(policy) if isinstance(policy, Sequence) else [policy]
    # Each controlled pantograph has a policy of its own, which sees what that one feels.
    drivers = given if len(given) > 1 else [*given, *(deepcopy(given[0]) for _ in range(task.agents - 1))]
    if len(drivers) != task.agents:
        raise InputError(
            f"policy must be one, or one for each of the {task.agents} controlled pantographs, not "
            f"{len(drivers)}."
        )
    with errors_name(name, "reset"):
        for row, driver in enumerate(drivers):
            driver.reset(task.context(row))
    results, actions = task.results, np.zeros((task.agents, len(task.actuator.places)))
    while not (results.truncated[0] or results.terminated[0]):
        with errors_name(name, "act"):
            for row, driver in enumerate(drivers):
                let_act(task, row, driver, actions[row])
        task.step(actions)
        yield task.plant.of(0, Row.STEP) / task.end(0)


def let_act(task: Task, row: int, driver: Policy, action: Array) -> None:
    """Write a policy's next action into ``action``, (actions,), once its pantograph is on the line.

    Before that it waits: nothing there is worth learning. Raises InputError as ``checked_action`` does.
    """
    if task.results.values[row, Result.POSITION] >= -OFF_LINE:
        # A copy: a policy may keep its observation.
        observation = task.results.observation[row].copy()
        action[:] = checked_action(driver.act(observation), action.shape)


_named = inspect.signature(simulate).parameters
simulate.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
    [
        *(each for each in _named.values() if each.kind is not inspect.Parameter.VAR_KEYWORD),
        *(argument for argument in parameters() if argument.name not in _named),
    ]
)


TOLERANCE = 0.1
"""Maximum rms difference (N) of the low-passed force for the same run: the last digit of printed figures.
Rounding on another processor makes about 0.0002 N."""


def is_saved_run(source: Any) -> bool:
    """Whether a source is the file of a saved run, by its suffix."""
    return isinstance(source, str | Path) and Path(source).suffix.lower() in SUFFIXES


def load_with_settings(path: str | Path) -> tuple[Trajectory, dict[str, Any]]:
    """A saved run, and the settings with which ``simulate`` repeats it, besides its policy and seed.

    Raises InputError where the file is not a saved run, or its version did not save the line.
    """
    run = Trajectory.load(path)
    try:
        return run, _as_given(settings_of(run), run)
    except (KeyError, ValueError) as error:
        raise InputError(
            f"{path} was written by another version, {run.identity.version}, without its "
            "line or with other settings, so the run cannot be repeated; write it again with "
            "`panto simulate --output`."
        ) from error


def _as_given(settings: dict[str, Any], run: Trajectory) -> dict[str, Any]:
    """The settings without grid and time step, where the defaults give the same ones.

    A policy's own passive runs, which normalise its readings, are at other speeds, with other grids.
    """
    grid = ("time_step", "spacing", "window")
    without = {name: value for name, value in settings.items() if name not in grid}
    task = Task(run_settings(without), keep_samples=False)
    found = identity(task.settings, task.plant, task.length.own_distance)
    return without if found == run.settings else settings


def check_made_anew(run: Trajectory, settings: dict[str, Any], path: str | Path) -> None:
    """Repeat a saved run, and raise InputError unless its contact force is that of the file.

    Its policy must be an installed one or a model file: the run may be anyone's.
    """
    try:
        check_named(run.controlled.policy, "it")
        repeated = simulate(policy=run.controlled.policy, seed=run.seed, record_droppers=False, **settings)
    except InputError as error:
        raise InputError(f"The run of {path} cannot be repeated: {error}") from error
    how = f"it ends at {repeated.distance:.1f} m instead of {run.distance:.1f} m"
    if len(repeated.time) == len(run.time):
        pairs = zip(repeated.train, run.train, strict=True)
        differences = [low_pass(new.contact_force - old.contact_force, run.time_step) for new, old in pairs]
        rms = max(float(np.sqrt(np.mean(difference**2))) for difference in differences)
        if rms <= TOLERANCE:
            return
        how = f"its contact force differs by {rms:.2g} N rms"
    raise InputError(
        f"The run of {path} cannot be repeated: with its settings and policy '{run.controlled.policy}' it "
        f"comes out differently now, {how}. The policy or the version has changed, or its mean force was met "
        "over --spans, or its policy saw another observation, which the file does not record; write it again "
        "with `panto simulate --output`."
    )
