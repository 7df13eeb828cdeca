"""One pass of a benchmark, and the passive pantograph at the mean contact force of that pass."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from panto_env import Trajectory, simulate
from panto_env.analysis.simulation import passive_at_mean, ready_pass
from panto_env.base.arrays import Array
from panto_env.base.errors import InputError
from panto_env.control import Task
from panto_env.control.entries import FULL as NOT_MEASURED
from panto_env.control.lines import fewest_spans
from panto_env.control.observation import Context
from panto_env.control.settings import run_settings
from panto_env.control.state import TaskRow
from panto_env.metrics.figures import LABELS, Figures, Label
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.train import MOST_COLLECTORS
from panto_env.policies import Policy, PolicyError, wishes

from ..line import CONDITIONS
from ..oracle.stored import stored_actions
from .actions import Played, Trace, trace
from .apart import find_apart
from .settings import (
    BLIND,
    ORACLE_TAPE,
    OTHER_SEED,
    REFERENCE,
    TAPE,
    BenchmarkSettings,
    Blind,
    Line,
    Placed,
    Tape,
    Windows,
    control_of,
    policy_of,
)


def passive_at_mean_of(
    run: Trajectory, spans: tuple[int, int], arguments: dict[str, Any]
) -> Trajectory | None:
    """Run of the passive pantograph on the same line, at the mean force of ``run`` over the spans.

    None if no static force gives this mean. Of a train each has the mean force that it had, and the run is
    that of the controlled one whose sigma is largest. arguments: those of ``simulate`` that the run was made
    with, except its policy.
    """
    means = [own.summary(spans).mean for own in run.train]
    if not min(means) > 0:
        return None
    try:
        mean = means if len(means) > 1 else means[0]
        passive = passive_at_mean(mean_force=mean, trimmed_over=spans, **arguments)
    except InputError:
        return None
    return None if passive.terminated else passive.worst_controlled(spans)


def by_kilometre(run: Trajectory, passive: Trajectory, spans: tuple[int, int]) -> tuple[float, ...]:
    """Relative change of sigma from a passive run in each whole kilometre of the spans."""
    begin, end = run.alignment.limits(spans)
    places = np.arange(begin, end - KILOMETRE + 1e-6, KILOMETRE)

    def deviations(own: Trajectory) -> Array:
        force, x = low_pass(own.contact_force, own.time_step), own.position
        return np.array([force[(x >= place) & (x < place + KILOMETRE)].std() for place in places])

    return tuple((deviations(run) / deviations(passive) - 1).tolist())


KILOMETRE = 1000.0
FULL = 0.999  # share of the actuator's maximum force above which a command counts as saturated
OWN_LABELS = {
    "action_rate": Label("rate of the commanded force, rms", "rate", "N/s"),
    "saturation": Label("share of commands at the limit", "at limit", "-"),
    "power": Label("mechanical power of the actuators", "mech. power", "W"),
}
"""Labels of the figures that ``Row`` has beside those of a run."""
ROW_LABELS = LABELS | OWN_LABELS
ROW_HEADINGS = {
    **{name: f"{name} ({label.unit})" for name, label in OWN_LABELS.items()},
    "pressed_std": "pressed_std (N)",
    "pressed_cost_function": "pressed_cost_function (N m)",
    **{f"mean_{number}": f"mean_{number} (N)" for number in range(1, MOST_COLLECTORS + 1)},
}
"""Headings with units, in files of tables, of what ``Row`` has beside the figures of a run."""
LATE = "late_"  # before the names of figures of the late window


@dataclass(frozen=True)
class Row(Placed):
    """Figures of one pass in one window; all are nan if it ended early (``terminated``)."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seed: int
    nominal_force: float  # N
    terminated: bool
    figures: Figures
    action_rate: float  # rms change of the commanded force between control steps, per second (N/s)
    saturation: float  # share of control steps that command the actuator's maximum force
    power: float  # mechanical, `Trajectory.mechanical_power` (W)
    pressed_std: float  # sigma of the passive pantograph at the same mean force (N)
    pressed_cost_function: float  # CF of that passive pantograph (N m)
    controlled_means: tuple[float, ...] = ()  # of several controlled pantographs, the first in front (N)
    case: str = ""
    kilometres: tuple[float, ...] = ()  # relative change of sigma in each, see ``by_kilometre``
    late: Row | None = field(default=None, repr=False)  # the same pass in the late window, if there is one

    @property
    def windows(self) -> tuple[Row, ...]:
        """The row of each window, the early one first."""
        return (self,) if self.late is None else (self, self.late)

    @property
    def means(self) -> tuple[float, ...]:
        """Mean force of each controlled pantograph (N)."""
        return self.controlled_means or (self.figures.mean,)

    @property
    def numbers(self) -> dict[str, float]:
        """All figures; means of several controlled pantographs follow, as mean_1, mean_2, ...

        Those of the late window come last, as late_mean, late_std, ...
        """
        own = {name: getattr(self, name) for name in (*OWN_LABELS, "pressed_std", "pressed_cost_function")}
        each = {f"mean_{agent}": mean for agent, mean in enumerate(self.controlled_means, start=1)}
        late = {} if self.late is None else self.late.numbers
        return self.figures.as_dict() | own | each | {f"{LATE}{name}": late[name] for name in late}

    def as_dict(self) -> dict[str, Any]:
        """What identifies the pass, and its figures, in one table."""
        names = ("policy", "catenary", "pantograph", "case", "speed_kmh", "seed", "nominal_force")
        kilometres = {f"km_{number}": change for number, change in enumerate(self.kilometres, start=1)}
        return {name: getattr(self, name) for name in (*names, "terminated")} | self.numbers | kilometres


class Pass(NamedTuple):
    """Figures of one pass, what the policy did in it, and what a page draws of it."""

    row: Row
    played: Played
    trace: Trace | None  # None if not requested, or if the pass ended early


def run_pass(
    settings: BenchmarkSettings,
    line: Line,
    windows: Windows,
    policy: str,
    speed_kmh: float,
    seed: int,
    *,
    traced: bool = False,
    played: Played | None = None,
) -> Pass:
    """Run one pass, and judge it in its windows.

    traced: whether to keep what a page draws of the pass, in the early window. played: of the policy in an
    earlier run of this pass, to play again instead of running the policy.

    Raises InputError, naming the policy, if the policy fails.
    """
    first, recorders = _record(settings, line, policy, speed_kmh, seed, played)
    arguments = _arguments(settings, line, speed_kmh, seed)
    judge = partial(_judged, settings, line, policy, speed_kmh, arguments, first, recorders)
    row = judge(windows.early)
    if windows.late is not None:
        row = replace(row, late=judge(windows.late))
    kept = traced and not row.terminated
    run = first.worst_controlled(windows.early)
    return Pass(row, played_by(recorders), trace(run, windows.early, policy, line) if kept else None)


def _judged(
    settings: BenchmarkSettings,
    line: Line,
    policy: str,
    speed_kmh: float,
    arguments: dict[str, Any],
    first: Trajectory,
    recorders: list[_CommandRecorder],
    spans: tuple[int, int],
) -> Row:
    """Row of a pass over ``spans``, first and last; first: the record of its first pantograph."""
    # Of several controlled pantographs the one with the largest sigma is judged.
    controlled = [first.train[number - 1] for number in line.controlled]
    run = first.worst_controlled(spans)
    recorder = next(each for each, own in zip(recorders, controlled, strict=True) if own is run)
    several = controlled if len(controlled) > 1 else []
    figures, passive = Figures.none(), None
    action_rate = saturation = watts = float("nan")
    if not run.terminated:
        figures = run.summary(spans)
        interval = arguments["control_interval"]
        commands = _within(recorder.forces(), run, spans, interval)
        changes = np.diff(commands, axis=0) / interval
        action_rate = float(np.sqrt(np.mean((changes**2).sum(axis=1))))
        saturation = float(np.mean(np.abs(commands) >= FULL * recorder.force_limit))
        watts = run.mechanical_power(spans)
        if "spans" in arguments:  # the line is given, so the passive run may end where its figures do
            behind = sum(line.distances) + SHORT_SPAN
            arguments = arguments | {"distance": run.alignment.limits(spans)[1] + behind}
        passive = run if policy == REFERENCE else passive_at_mean_of(first, spans, arguments)
    pressed = Figures.none() if passive is None else passive.summary(spans)
    return Row(
        policy=policy,
        catenary=line.catenary,
        pantograph=line.pantograph,
        speed_kmh=speed_kmh,
        seed=arguments["seed"],
        nominal_force=run.nominal_force,
        terminated=run.terminated,
        figures=figures,
        action_rate=action_rate,
        saturation=saturation,
        power=watts,
        pressed_std=pressed.std,
        pressed_cost_function=pressed.cost_function,
        controlled_means=tuple(
            float("nan") if first.terminated else own.summary(spans).mean for own in several
        ),
        case=line.case,
        kilometres=by_kilometre(run, passive, spans) if settings.by_kilometre and passive else (),
    )


def drive(
    settings: BenchmarkSettings,
    line: Line,
    policy: str,
    speed_kmh: float,
    seed: int,
    played: Played | None = None,
) -> tuple[Trajectory, Array]:
    """Run one pass: its record, and the commanded forces (N), (control steps, actions).

    Both are those of the first controlled pantograph. played: as for ``run_pass``.
    """
    run, recorders = _record(settings, line, policy, speed_kmh, seed, played)
    return run.controlled, recorders[0].forces()


def _within(commands: Array, run: Trajectory, spans: tuple[int, int], interval: float) -> Array:
    """Commands, (control steps, actions), whose first time step lies within the spans, as the figures do.

    Both end together; the record begins where its pantograph comes onto the line.
    """
    steps = round(interval / run.time_step)
    inside = np.zeros(max(len(commands) * steps, len(run.time)), dtype=np.bool_)
    inside[len(inside) - len(run.time) :] = run.inside(spans)
    return np.asarray(commands[inside[len(inside) - len(commands) * steps :][::steps]])


def _record(
    settings: BenchmarkSettings,
    line: Line,
    policy: str,
    speed_kmh: float,
    seed: int,
    played: Played | None = None,
) -> tuple[Trajectory, list[_CommandRecorder]]:
    players = tapes(played, line) if played else _players(settings, line, policy, speed_kmh, seed)
    recorders = [_CommandRecorder(player, policy, row) for row, player in enumerate(players)]

    def watch(task: Task) -> None:
        for recorder in recorders:
            recorder.watch(task)

    with _torch_on_one_thread():
        arguments = _arguments(settings, line, speed_kmh, seed)
        run = simulate(policy=recorders, watch=watch, record_droppers=False, **arguments)
    return run, recorders


BEYOND, SHORT_SPAN = 12, 40.0
"""Spans behind the last judged one, half of the longest window of a plant, and a short span (m)."""


def along(settings: BenchmarkSettings, line: Line) -> dict[str, Any]:
    """Settings of the runs along a line, by name, except the speed."""
    names = ("actuator", "sensors", *CONDITIONS)
    given = line.settings | {"distance": line.distance} | {name: getattr(settings, name) for name in names}
    if settings.late_spans is not None and line.distance is None and not line_ends(line.catenary):
        train = int(np.ceil(sum(line.distances) / SHORT_SPAN))
        given["spans"] = settings.late_spans[1] + BEYOND + train
    return given | line.run


@cache
def line_ends(catenary: str) -> bool:
    """Whether a line, or one that is drawn, ends after its sequence of spans."""
    return fewest_spans(run_settings({"catenary": catenary})) is not None


def _arguments(settings: BenchmarkSettings, line: Line, speed_kmh: float, seed: int) -> dict[str, Any]:
    """Arguments of ``simulate`` for a pass, except its policy."""
    return at_speed(along(settings, line), speed_kmh) | {"seed": seed}


def at_speed(given: dict[str, Any], speed_kmh: Any) -> dict[str, Any]:
    """Settings of a run with its speed (km/h), a number or a range, unless they have a speed profile."""
    return given if given.get("speed_profile") is not None else given | {"speed_kmh": speed_kmh}


def _players(
    settings: BenchmarkSettings, line: Line, policy: str, speed_kmh: float, seed: int
) -> Sequence[Policy]:
    """The policies that run in a pass, one for each controlled pantograph: itself, or a control of it."""
    if policy == ORACLE_TAPE:
        return [oracle_tape(settings, line, speed_kmh)]
    if control_of(policy) == TAPE:
        _, recorders = _record(settings, line, policy_of(policy), speed_kmh, seed + OTHER_SEED)
        return tapes(played_by(recorders), line)
    return [_player(settings, policy, number) for number in range(len(line.controlled))]


def check_beginnings(settings: BenchmarkSettings, line: Line) -> None:
    """Let every policy prepare for passes at a line's lowest and highest speed.

    One that refuses does so before any pass is run. Raises InputError, which names it.
    """
    names = sorted({policy_of(each) for each in settings.policies_on(line) if each != ORACLE_TAPE})
    contexts: dict[str, Context] = {}  # by the settings of their task
    for name, speed in product(names, sorted({min(line.speeds_kmh), max(line.speeds_kmh)})):
        player = _player(settings, name, 0)
        given = wishes(player) | at_speed(along(settings, line), speed)
        key = repr(sorted(given.items()))
        if key not in contexts:
            contexts[key] = ready_pass(player, given, settings.drawn_seeds[0])[0].context(0)
        player.reset(contexts[key])


def tapes(played: Played, line: Line) -> list[Tape]:
    """Tapes that play a pass again, one for each controlled pantograph."""
    each = np.split(played.actions, len(line.controlled), axis=1)
    return [Tape(actions, played.washout) for actions in each]


def _player(settings: BenchmarkSettings, policy: str, number: int) -> Policy:
    """The policy that drives one of the controlled pantographs, from 0: itself, or blind."""
    found = find_apart(policy_of(policy), settings.trusted, number)
    if wishes(found).get("observation") == NOT_MEASURED:
        raise PolicyError(
            f"The policy '{policy_of(policy)}' wishes the observation '{NOT_MEASURED}', which holds what no "
            "train can measure; let it take another one."
        )
    return Blind(found) if control_of(policy) == BLIND else found


def oracle_tape(settings: BenchmarkSettings, line: Line, speed_kmh: float) -> Tape:
    """The actions of the stored oracle. Raises InputError if there is none for this line and speed."""
    actions = stored_actions(along(settings, line) | {"speed_kmh": speed_kmh})
    if actions is None:
        raise InputError(
            f"No oracle is stored for '{line.catenary}' at {speed_kmh:g} km/h with this pantograph and "
            f"actuator, so leave out '{ORACLE_TAPE}'."
        )
    return Tape(actions)


class _CommandRecorder:
    """A wrapper that records a policy's actions and what is commanded, under that policy's name."""

    def __init__(self, policy: Policy, name: str, row: int) -> None:
        """row: of the task, that of the pantograph."""
        self._policy, self.name, self._row = policy, name, row
        vars(self).update(wishes(policy))
        self._actions: list[Array] = []
        self._commands: list[Array] = []

    def reset(self, context: Context) -> None:
        self.force_limit, self._washout = context.force_limit, context.washout
        self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        action = self._policy.act(observation)
        self._actions.append(np.array(action, dtype=float))  # a copy: a policy may change it later
        return action

    def watch(self, task: Task) -> None:
        """Record what the plant was commanded: the action, clipped, less a washout's slow average."""
        actions = len(task.actuator.places)
        self._commands.append(task.episode.table[self._row, TaskRow.ACTION : TaskRow.ACTION + actions].copy())

    def played(self) -> Played:
        """What the policy did."""
        return Played(np.clip(np.array(self._actions), -1, 1), self._washout)

    def forces(self) -> Array:
        """Commanded forces (N), (control steps, actions)."""
        return self.force_limit * np.array(self._commands)


def played_by(recorders: Sequence[_CommandRecorder]) -> Played:
    """What the policies of a pass did, the pantographs' actions side by side."""
    each = [recorder.played() for recorder in recorders]
    longest = max(len(own.actions) for own in each)
    actions = [np.pad(own.actions, ((0, longest - len(own.actions)), (0, 0))) for own in each]
    return Played(np.hstack(actions), each[0].washout)


@contextmanager
def _torch_on_one_thread() -> Iterator[None]:
    """Other passes need the cores, and results must not depend on how many of them are free."""
    torch = sys.modules.get("torch")
    if torch is None:  # no policy has imported it
        yield
        return
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
