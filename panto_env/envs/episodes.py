"""What all environments share: one thread at a time, copies, checked arguments of reset, their episodes."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import wraps
from typing import Any, NoReturn, Self, TypeVar

import numpy as np
from gymnasium.envs.registration import EnvSpec

from ..base.errors import InputError, shown
from ..control import Task
from ..control.lines import draws_line, on_drawn_line, on_example
from ..control.settings import RunSettings, check_names, read_settings
from .settings import Whole

F = TypeVar("F", bound=Callable[..., Any])


class InUse:
    """Lock that shows whether a thread is using an environment; a copy is not in use.

    In a forked process it stays in use if another thread was using it: that thread does not exist there, and
    a random generator that it had locked would block forever.
    """

    def __init__(self) -> None:
        lock = threading.Lock()
        self.begin, self.end = lock.acquire, lock.release

    def __reduce__(self) -> tuple[type[InUse], tuple[()]]:
        return InUse, ()


def refuse() -> NoReturn:
    """Raise InputError: another thread is using an environment."""
    raise InputError(
        "Another thread is using this environment, or was when this process was forked; give each thread and "
        "each process one of its own."
    )


def one_at_a_time(method: F) -> F:
    """Decorator of a method of an environment with an ``InUse`` in ``_in_use``.

    The method raises InputError, and does nothing, while another thread is in one of these methods.
    """

    @wraps(method)
    def alone(self: Any, *arguments: Any, **named: Any) -> Any:
        in_use = self._in_use
        if not in_use.begin(False):
            refuse()
        try:
            return method(self, *arguments, **named)
        finally:
            in_use.end()

    return alone  # type: ignore[return-value]


class CopiedAlone(Whole):
    """Base of an environment with an ``InUse`` in ``_in_use``: no other thread steps it while it is copied.

    A copy, by ``copy`` or ``pickle``, raises InputError while another thread is using the environment.
    """

    _spec: EnvSpec | None = None
    _longest: int | None = None  # steps of an episode without options; None where that depends on its line

    @property
    def spec(self) -> EnvSpec | None:
        """The spec from `gymnasium.make` or `make_vec`, with the maximum steps of an episode."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy.copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self._longest
            # ``make_vec`` also adds it to the arguments; left there, a spec made from this one would differ.
            given = self._spec.kwargs.items()
            self._spec.kwargs = {key: value for key, value in given if key != "max_episode_steps"}

    def _state(self) -> dict[str, Any]:
        return vars(self)

    @one_at_a_time
    def __getstate__(self) -> dict[str, Any]:
        """A state of its own, which no thread changes while it is being pickled."""
        return deepcopy(self._state(), {id(self): self})

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)

    @one_at_a_time
    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        twin = memo[id(self)] = type(self).__new__(type(self))
        twin.__setstate__(deepcopy(self._state(), memo))
        return twin


def checked_seed(seed: Any, others: str = "") -> int | None:
    """A seed, or None. Raises InputError unless it is a whole number from 0 up or None, or ``others``."""
    if seed is None:
        return None
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if not whole or seed < 0:
        raise InputError(f"seed must be a whole number from 0 up{others}, or None, not {shown(seed)}.")
    return int(seed)


def checked_seeds(seed: Any, lanes: int) -> list[int | None]:
    """Seeds of lanes: of a number that number plus the lane, or one for each. Raises InputError otherwise."""
    others = f", or a list of {lanes} such numbers or None, one per lane"
    listed = isinstance(seed, Sequence) and not isinstance(seed, str | bytes)
    if listed or (isinstance(seed, np.ndarray) and seed.ndim):
        if len(seed) != lanes:
            raise InputError(f"seed must be a number or one per lane, {lanes}, not {len(seed)}.")
        return [checked_seed(each, others) for each in seed]
    first = checked_seed(seed, others)
    return [None if first is None else first + lane for lane in range(lanes)]


def check_whole_trains(mask: Any, agents: int) -> None:
    """Raise InputError where a mask, (lanes,), marks some of the lanes of a train, so many each."""
    trains = mask.reshape(-1, agents)
    parts = (trains != trains[:, :1]).any(1).tolist()
    if any(parts):
        first = parts.index(True) * agents
        several = f"lanes {first} to {first + agents - 1}"
        raise InputError(f"reset_mask marks a part of a train: mark all of {several}, or none of them.")


def checked_options(options: Any) -> dict[str, Any]:
    """Options by name; none for None. Raises InputError for anything else than a dictionary by names."""
    if options is None:
        return {}
    if not (isinstance(options, Mapping) and all(isinstance(name, str) for name in options)):
        raise InputError(
            "options must be a dictionary of arguments by name, such as {'speed_kmh': 250}, "
            f"not {shown(options)}."
        )
    return dict(options)


class Episodes:
    """Episodes with the same settings, on one line or each on a line that is drawn for it."""

    def __init__(self, settings: RunSettings, **of_task: Any) -> None:
        """of_task: arguments of ``Task``. Raises InputError where the settings are not valid together."""
        self.settings, self._of_task = settings, of_task
        self.draws_line = draws_line(settings)
        self.task = Task(on_example(settings), **of_task)
        """The task of all episodes. Where lines are drawn: one on an example, to know the spaces by."""
        for line in settings.catenary[1:] if isinstance(settings.catenary, tuple) else ():
            Task(settings.on_line(line), keep_samples=False)  # each is possible

    def draw(self, random: Callable[[], np.random.Generator]) -> Task:
        """The task of an episode, on a line drawn from the generator where lines are drawn."""
        if not self.draws_line:
            return self.task
        return Task(on_drawn_line(self.settings, random), **self._of_task)

    def with_options(self, options: Mapping[str, Any]) -> Episodes:
        """Episodes with ``options``: arguments of the environment, only for these episodes.

        Raises InputError where they are not valid, or would change a space.
        """
        check_names(options, "option")
        if not options:
            return self
        given = dict(self.settings) | ({"speed_profile": None} if "speed_kmh" in options else {})
        settings = read_settings(given | dict(options), type(self.settings))
        others = Episodes(settings, **self._of_task)
        if others._spaces != self._spaces:
            raise InputError(
                f"The options {', '.join(options)} would change the observation or action space; "
                "make another environment for that."
            )
        return others

    @property
    def _spaces(self) -> tuple[Any, ...]:
        layout = self.task.layout
        names = [entry.name for entry in layout.entries]
        scales = [] if layout.normalise else [(entry.centre, entry.scale) for entry in layout.entries]
        return layout.kind, layout.normalise, names, scales, self.task.actuator.places
