"""A guard around any policy: readings that cannot be are held, and a command that does harm fades to passive.

In the literature such a guard is a simplex architecture, or run-time assurance (Seto and Sha, "An engineering
method for safety region development", CMU/SEI-99-TR-018, 1999): a simple and trusted controller, here none at
all, takes over where a monitor sees a better performing one leave what is safe.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from panto_env.base.arrays import METRES_PER_SECOND
from panto_env.control.entries import (
    AVERAGED,
    CENTRED,
    DEVIATION,
    DEVIATIONS,
    FORCE_DEVIATION,
    READING_ENTRIES,
    earlier,
)
from panto_env.control.observation import Context, Layout
from panto_env.plant.speed import STRONGEST
from panto_env.policies import find_policy, wishes

from . import guard_rules
from .guard_rules import HIGHEST, SENSORS, SHIFT_WINDOW, SHORT_WINDOW, SHOWN, SPEED, WINDOW
from .line_model import DELAY, LAG, Sampled, line_model, mean_line

Array = NDArray[np.float64]
Observation = NDArray[np.float32]

FORCES = ("contact force", "force deviation", f"contact force{DEVIATION}")
"""Names of the entry that has the contact force, by kind of observation."""
LOOKED_BACK = 4000  # control steps in which a fault is remembered, where no memory's length is known


class Guarded:
    """A policy whose readings are checked, and whose command fades to passive where it does harm.

    Rules, each with a constant in ``guard_rules``:

    - a reading that stands still, or is exactly zero, is held at its last value; what memory shows of
      that time is taken for unknown. After ``PATIENCE`` the command fades out, until the reading has moved
      again for ``RETURN``. Nothing is heard meanwhile, and a command that has faded does not come back.
    - from a model of pantograph and mean line (``line_model``) and the command that was given, it knows what
      control has added to the contact force. If the force would vary less without (``HARM``), the command
      fades out, unless control adds next to nothing (``SLIGHT``).
    - so it does where the force varies more than it did while passive (``SPREAD``), which needs no model,
      where it is farther off than it was then (``PEAK``), and where the mean force is moved (``SHIFT``).
    - if by the model it would vary far more without control than it did while passive (``CLAIM``), but varies
      no less than then, one of the two is wrong: it fades, and listens.
    - where the force hardly varies while passive, it stays passive (``QUIET``).
    - where the force is low and control has taken some away, the command takes no more (``LOW``).

    It comes back by itself after a pause, in which it listens when the waves of control have died out
    (``CALM``). If the force varied less then than before, control did harm, and the next pause is longer; if
    not, the line or the speed has changed, and the next is as short as the first. Where the speed is another
    one (``FASTER``), it pauses and listens anew.
    """

    AROUND_ANOTHER = True  # the other's name follows its own: "guarded:pd"

    def __init__(self, policy: str, delay: float = DELAY, lag: float = LAG) -> None:
        """policy: its name, as a benchmark takes it. delay of actuator and sensors together, lag of the
        actuator: s.

        Raises InputError where the policy does not exist.
        """
        self.policy, self.delays = find_policy(policy), (delay, lag)
        vars(self).update({"observation": "measured"} | wishes(self.policy))

    def reset(self, context: Context) -> None:
        """Prepare for an episode. Raises InputError for a line without wires."""
        self.policy.reset(context)
        self._guard = Guard(context, *self.delays)

    def act(self, observation: Observation) -> Array:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        seen = self._guard.checked(observation)
        return self._guard.limited(self.policy.act(seen))


class GuardedEnv(gymnasium.Wrapper[Observation, Any, Observation, Any], RecordConstructorArgs):
    """An environment behind the guard: who acts in it sees held readings, and actions fade that do harm.

    ``info["gate"]`` is the factor of the last action, 0 to 1. Rewards are those of what was done. For one
    pantograph: ``gymnasium.make_vec`` with ``vectorization_mode="sync"`` takes it among its ``wrappers``.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], delay: float = DELAY, lag: float = LAG) -> None:
        """delay, lag: as ``Guarded`` takes them."""
        RecordConstructorArgs.__init__(self, delay=delay, lag=lag)
        gymnasium.Wrapper.__init__(self, env)
        self._delays = delay, lag

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Begin an episode; as the environment's own."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._guard = Guard(self.get_wrapper_attr("context"), *self._delays)
        return self._guard.checked(observation), info | {"gate": 0.0}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """One control step; as the environment's own."""
        limited = self._guard.limited(action).astype(np.float32)
        observation, reward, terminated, truncated, info = self.env.step(limited)
        seen = self._guard.checked(observation)
        return seen, reward, terminated, truncated, info | {"gate": self._guard.gate}


class Guard:
    """The guard of one pantograph in an episode: in each control step what is seen, then what may be done.

    constants, state: tables by name for ``guard_rules``, whose functions run here as they stand.
    """

    def __init__(self, context: Context, delay: float, lag: float) -> None:
        self.constants = _of_readings(context) | _of_monitor(context, delay, lag)
        self.state = state_of(self.constants)
        entries = context.layout.entries
        self._speed = next(((k, entry) for k, entry in enumerate(entries) if entry.name == "speed"), None)
        self._commands = [k for k, entry in enumerate(entries) if re.fullmatch("last .* action", entry.name)]
        self._c, self._s = (
            SimpleNamespace(**{name: _plain(value) for name, value in table.items()})
            for table in (self.constants, self.state)
        )
        self._s.begun, self._s.input = 0, [0.0] * SPEED + [context.speed]
        guard_rules.begin_guard(self._c, self._s)

    def checked(self, observation: Observation) -> Observation:
        """The observation with held values for those that cannot be."""
        state = self._s
        state.seen = observation.copy()
        if self._speed is not None:
            place, entry = self._speed
            state.input[SPEED] = entry.centre + entry.scale * float(observation[place])
        guard_rules.check_readings(self._c, state)
        return np.array(state.seen)

    def limited(self, action: Any) -> Array:
        """Action, (actions,), each in -1..1, as far as it may be done after what was seen last."""
        state = self._s
        state.past = state.seen[self._commands].tolist()
        state.action = np.clip(np.asarray(action, dtype=float), -1.0, 1.0).tolist()
        guard_rules.act_within_guard(self._c, state)
        state.begun = 1
        return np.array(state.action)

    @property
    def gate(self) -> float:
        """Factor of the last action, 0 to 1."""
        return float(self._s.gate)


def _plain(value: Any) -> Any:
    """Arrays as lists, or by their places in dictionaries: plain Python reads these several times as fast."""
    if np.ndim(value) == 0:
        return value
    numbers = value.ravel().tolist()
    return numbers if value.ndim == 1 else dict(zip(np.ndindex(value.shape), numbers, strict=True))


def _of_readings(context: Context) -> dict[str, Any]:
    """Constants by which readings are checked: their places in the observation, and what a zero is there."""
    layout, interval = context.layout, context.control_interval
    names = [entry.name for entry in layout.entries]
    ending = DEVIATION if layout.kind == DEVIATIONS else ""
    own = [f"{name}{ending}" for name, _, _ in READING_ENTRIES]
    if layout.kind == CENTRED:
        own[-1] = "force deviation"
    present = np.array([names.index(name) for name in own])
    entries = [layout.entries[place] for place in present]
    zeros = [-1.0 / FORCE_DEVIATION if e.name == "force deviation" else -e.centre / e.scale for e in entries]
    by_speed = np.array([entry.slope / entry.scale for entry in entries])  # of an entry, for each m/s
    if layout.kind == CENTRED:
        lift = 2 * of_nominal_force(context)["aerodynamic"] * context.speed
        by_speed[-1] += lift / context.nominal_force / entries[-1].scale
    past = [[names.index(earlier(name, k)) for name in own] for k in range(1, layout.history + 1)]
    memory = [
        (place, int(span.split()[0]), float(ahead.split()[0]) / interval)
        for place, name in enumerate(names)
        if name.startswith("remembered force")
        for _, span, ahead in [name.split(", ")]
    ]
    entry, spans, ahead = zip(*memory, strict=True) if memory else ((0,), (0,), (0.0,))
    unknown = [layout.entries[place] for place in entry]  # shows the nominal force
    return {
        "interval": interval,
        "mean_length": context.alignment.mean_length,
        "history": layout.history,
        "present": present,
        "earlier": np.array(past or [[0]]),
        "zero": np.where([ending != "" or entry.slope != 0 for entry in entries], np.inf, zeros),
        "same": guard_rules.SAME + STRONGEST * interval * np.abs(by_speed),
        # of an average, in a step
        "guard_share": 1 - math.exp(-interval / AVERAGED) if ending else 0.0,
        "fault_steps": LOOKED_BACK,
        "remembered": len(memory),
        "remembered_entry": np.array(entry),
        "remembered_spans": np.array(spans, dtype=float),
        "remembered_ahead": np.array(ahead),
        "unknown_centre": np.array([each.centre for each in unknown]),
        "unknown_slope": np.array([each.slope for each in unknown]),
        "unknown_share": np.array([0.0 if ending else 1 / each.scale for each in unknown]),
    }


def of_shown_force(layout: Layout) -> dict[str, Any]:
    """Constants by which the contact force is read from an observation: see ``guard_rules.shown_force``."""
    force = next(entry for entry in layout.entries if entry.name in FORCES)
    return {
        "force_entry": layout.entries.index(force),
        "of_nominal": force.name == "force deviation",
        "force_scale": force.scale,
        "force_centre": force.centre,
        "force_slope": force.slope,
    }


def of_nominal_force(context: Context) -> dict[str, Any]:
    """Constants by which the nominal force follows from the speed: see ``guard_rules.nominal_force``."""
    pantograph, speed = context.pantograph, context.speed
    aerodynamic = pantograph.aerodynamic_coefficient * METRES_PER_SECOND**2
    uplift = np.array(pantograph.uplift_table or ((0.0, 0.0),))
    return {
        "static_force": context.nominal_force - aerodynamic * speed**2 - pantograph.tabled_uplift(speed),
        "aerodynamic": aerodynamic,
        "uplift_points": len(pantograph.uplift_table),
        "uplift_speed": uplift[:, 0] / METRES_PER_SECOND,
        "uplift": uplift[:, 1].copy(),
    }


def _of_monitor(context: Context, delay: float, lag: float) -> dict[str, Any]:
    """Constants by which control is judged: the force that is seen, a model of what it adds, the windows."""
    from scipy.signal import butter, lfilter_zi  # slow to import

    interval, line = context.control_interval, mean_line(context)
    models = [
        Sampled(line_model(replace(context, channels=(channel,)), line, delay, lag), interval)
        for channel in context.channels
    ]
    low_pass = butter(2, min(HIGHEST, 0.3 / interval), fs=1 / interval)
    return {
        **of_shown_force(context.layout),
        **of_nominal_force(context),
        "actions": context.actions,
        "force_limit": context.force_limit,
        "knows_force": context.layout.kind != DEVIATIONS,
        "states": models[0].size,
        "model_a": np.array([model.a for model in models]),
        "model_b": np.array([model.b for model in models]),
        "model_c": np.array([model.c[0] for model in models]),
        "low_pass_a": low_pass[1],
        "low_pass_b": low_pass[0],
        "at_rest": lfilter_zi(*low_pass),
        "shares": 1 - np.exp(-interval / np.array([WINDOW, SHORT_WINDOW, SHIFT_WINDOW])),
    }


def state_of(constants: dict[str, Any]) -> dict[str, Any]:
    """The guard's state before the first step, by name: all of it 0, of the sizes that the constants give."""
    states = constants["states"]
    shapes = {"shows": SENSORS, "last": SENSORS, "shown": (SHOWN, SENSORS), "shift": SENSORS}
    shapes |= {"model": (constants["actions"], states), "following_model": states, "now": 3}
    shapes |= {"means": (2, 3), "squares": (2, 3), "filter": (2, 3)}
    whole = {"stood": SENSORS, "faulty": constants["fault_steps"]}
    numbers = "held waits pause fade_in heard heard_at most before gate mean_added deviation passive_for"
    return (
        {name: np.zeros(shape) for name, shape in shapes.items()}
        | {name: np.zeros(shape, np.int64) for name, shape in whole.items()}
        | dict.fromkeys(("shown_steps", "fault_at", "sound_for", "heard_any"), 0)
        | dict.fromkeys((*numbers.split(), "listened", "acted_for", "settles", "quiet"), 0.0)
    )
