"""The constants and the state of an on-board controller, from a policy and the task that it is for."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from panto_baselines.policies.fb_ff import FORCE_RANGE, FeedbackFeedforward
from panto_baselines.policies.feedback import Proportional, ProportionalDerivative
from panto_baselines.policies.guard_rules import SENSORS
from panto_baselines.policies.guarded import Guard, Guarded, of_nominal_force, of_shown_force, state_of
from panto_baselines.policies.line_model import Sampled, line_model, mean_line
from panto_baselines.policies.repetitive import PEAKS, WASHED, Repetitive, WashoutSettings, harmonics
from panto_env.base.errors import InputError
from panto_env.control import Context, Task
from panto_env.control.entries import CENTRED, DEVIATIONS, MEASURED, READING_ENTRIES, Entry, present
from panto_env.policies import find_policy

from ..model_file import Actor, Facts
from ..policy import TrainedPolicy
from . import acting, seeing

Table = dict[str, Any]
Feedback: TypeAlias = Proportional | ProportionalDerivative | FeedbackFeedforward


def parts_of(policy: Any, name: str, task: Task) -> tuple[Table, Table]:
    """Constants and state, by name, of a policy in a task that has been reset.

    Raises InputError, one sentence with the policy's name, where the description does not cover it.
    """
    context, inner = task.context(0), without_guard(policy)
    law = inner
    if isinstance(inner, TrainedPolicy):
        base = inner.facts.residual_of
        law = None if base is None else find_policy(base)
    if not (law is None or isinstance(law, Feedback) or type(law) is Repetitive):  # not what is made of it
        raise InputError(
            f"The policy '{name}' cannot be exported: only p, pd, fb+ff, repetitive and a trained agent can, "
            "each also with guarded: before its name; of an ensemble export one member, such as "
            "agent-any-line:seed=1."
        )
    constants, state = _seen(name, task, context)
    constants |= {"law": acting.NONE, "layers": 0, "guarded": isinstance(policy, Guarded)}
    if isinstance(law, Repetitive):
        law.reset(context)
        _add_repetitive(constants, state, law, task, name)
    elif law is not None:
        _add_feedback(constants, state, law, context, name)
    if isinstance(inner, TrainedPolicy):
        _add_network(constants, state, inner.facts, inner.actor)
    if isinstance(policy, Guarded):
        _add_guard(constants, state, Guard(context, *policy.delays))
    return constants, state


def without_guard(policy: Any) -> Any:
    """The policy within a guard, or the policy itself."""
    return policy.policy if isinstance(policy, Guarded) else policy


def _seen(name: str, task: Task, context: Context) -> tuple[Table, Table]:
    layout, episode = context.layout, task.episode
    if layout.kind not in (MEASURED, CENTRED, DEVIATIONS) or layout.line_values:
        what = "the values of each span" if layout.line_values else f"the observation '{layout.kind}'"
        raise InputError(f"The policy '{name}' cannot be exported: it sees {what}, which no train reads.")
    front, actions = len(layout.front), context.actions
    places, spans = len(layout.memory), layout.memory_spans if layout.memory else 0
    steps = episode.memory.kept.shape[1] if places else 1
    sources = [_source(each, front, actions) for each in layout.entries]
    constants: Table = {
        "inputs": seeing.FURTHER + front + (actions if context.washout else 0),
        "averaged": layout.kind == DEVIATIONS,
        "average_share": float(episode.average_share),
        "front": front,
        "history": layout.history,
        "actions": actions,
        "entries": len(layout.entries),
        "source": np.array([source for source, _ in sources]),
        "number": np.array([number for _, number in sources]),
        "centre": layout.centre,
        "slope": layout.slope,
        "per_unit": 1 / layout.scale,
        "sight": float(episode.odometer.sight),
        "interval": context.control_interval,
        "mean_length": context.alignment.mean_length,
        "memory_spans": spans,
        "memory_places": places,
        "memory_steps": steps,
        "steps_ahead": np.array(layout.memory) / context.control_interval,
        "force_limit": context.force_limit,
        "washout_share": float(episode.washout_share),
    }
    constants |= of_shown_force(layout) | of_nominal_force(context)
    inputs, sensors = constants["inputs"], SENSORS
    shapes = {
        "input": inputs,
        "reading": sensors,
        "average": sensors,
        "ahead": max(front + places * spans * (1 + actions), 1),
        "past": actions + layout.history * (sensors + actions),
        "kept": (steps, 2 + actions),
    }
    state: Table = {"begun": 0} | _zeros({"known": inputs}, np.int64) | _zeros(shapes) | {"time": 0}
    state |= _zeros({"seen": len(layout.entries)}, np.float32)
    state |= _zeros({"action": actions, "base": actions, "washed": actions})
    each = actions + 1  # of a network's actions, and of the law's
    state |= _zeros({"average_force": each, "actuator_force": each})
    return constants | _zeros({"lag": each, "rate": each, "average_of_force": each}), state


def _zeros(shapes: Mapping[str, int | tuple[int, ...]], kind: type = float) -> Table:
    return {name: np.zeros(shape, dtype=kind) for name, shape in shapes.items()}


def _source(entry: Entry, front: int, actions: int) -> tuple[int, int]:
    """What an entry shows, and its number among these."""
    name, earlier = present(entry), entry.name.endswith(" ago")
    readings = [each for each, _, _ in READING_ENTRIES]
    base = name.removesuffix(" deviation")
    if base == "force":
        return (seeing.PAST_DEVIATION, entry.number) if earlier else (seeing.DEVIATION, 0)
    if name.startswith(("front force", "remembered")):
        return seeing.AHEAD, entry.number
    if re.fullmatch("last .* action", name) or (earlier and base in readings):
        return seeing.PAST, entry.number
    if base in readings:
        return seeing.READING, entry.number
    if " of span position" in name:
        return seeing.TURN, entry.number or (2 if name.startswith("sine") else 3)
    simple = {"speed": seeing.TRAIN_SPEED, "nominal force": seeing.NOMINAL}
    if name not in simple:
        raise InputError(f"No controller on a train can show the entry '{entry.name}' of the observation.")
    return simple[name], 0


def _add_network(constants: Table, state: Table, facts: Facts, actor: Actor) -> None:
    rows = np.array([len(bias) for bias in actor.biases])
    columns = np.array([weight.shape[1] for weight in actor.weights])
    constants |= {
        "network_share": 1.0 if facts.residual_of is None else facts.residual_share,
        "layers": len(rows),
        "rows": rows,
        "columns": columns,
        "weight": np.concatenate([weight.ravel() for weight in actor.weights]),
        "bias": np.concatenate(actor.biases),
        "weight_at": np.cumsum([0, *(rows * columns)])[:-1],
        "bias_at": np.cumsum([0, *rows])[:-1],
        "bent_by_tanh": actor.activation == "tanh",
        "squashed": actor.squashed,
        "units": actor.units,
        "washes_out": facts.washout is not None,
    }
    if actor.cell is not None:
        constants |= actor.cell._asdict()
    if facts.washout is not None:
        _add_washout(constants, facts.washout, slice(constants["actions"]))
    wide = add_steps_before(constants, state, facts)
    widest = max(wide, *rows.tolist(), *columns.tolist())
    state |= _zeros({"values": widest, "following": widest, "hidden": max(actor.units, 1)}, np.float32)


def _add_washout(constants: Table, washout: WashoutSettings, which: slice) -> None:
    constants["lag"][which], constants["rate"][which] = washout.lag, washout.rate
    constants["average_of_force"][which] = 1.0 - math.exp(-constants["interval"] / washout.time_constant)


def add_steps_before(constants: Table, state: Table, facts: Facts) -> int:
    """Add the steps before the network; the largest number of values between them."""
    names = ["width", "stacked", "step_at", "step_bound", "padded", "step_centre", "step_scale", "padding"]
    table: dict[str, list[Any]] = {name: [] for name in names}
    width, most, places = constants["entries"], constants["entries"], 0
    for step in facts.steps_before:
        frames, size = (0, width) if step.centre else (step.frames, width * step.frames)
        numbers = width, frames, places, step.bound or math.inf, int(step.padding is not None)
        of_values = (step.centre or (0.0,) * size, step.scale or (1.0,) * size)
        padding = (step.padding or (0.0,) * width) * (size // width)
        for name, own in zip(names, (*((each,) for each in numbers), *of_values, padding), strict=True):
            table[name] += own
        width, places, most = size, places + size, max(most, size)
    constants |= {name: np.array(values) for name, values in table.items()}
    constants["steps_before"] = len(facts.steps_before)
    constants["padding"] = constants["padding"].astype(np.float32)
    state["frames"] = np.zeros(places, dtype=np.float32)
    return int(most)


def _add_feedback(constants: Table, state: Table, policy: Feedback, context: Context, name: str) -> None:
    velocity = next(each for each in context.layout.entries if each.name == "frame velocity")
    constants |= {
        "law": acting.FEEDBACK,
        "feeds_forward": isinstance(policy, FeedbackFeedforward),
        "dead_zone": 0.0,
        "derivative": getattr(policy, "derivative", 0.0),
        "damping": getattr(policy, "damping", 0.0),
        "velocity_entry": context.layout.entries.index(velocity),
        "velocity_scale": velocity.scale,
    }
    state["last_error"] = 0.0
    if not isinstance(policy, FeedbackFeedforward):
        constants["gain"] = policy.gain
        return
    if len(policy.gains) > 1 or policy.reading != "span":
        raise InputError(
            f"The policy '{name}' cannot be exported: in C it is only with one gain, and the reading 'span'."
        )
    constants |= {
        "gain": next(iter(policy.gains.values())),
        "dead_zone": policy.dead_zone,
        "amplitude": policy.amplitude,
        "phase": policy.theta / (2 * math.pi),
        "lowest": FORCE_RANGE[0],
        "highest": FORCE_RANGE[1],
    }


def _add_repetitive(constants: Table, state: Table, policy: Repetitive, task: Task, name: str) -> None:
    context = task.context(0)
    if not policy.counts and constants["sight"] == 0.0:
        raise InputError(
            f"The policy '{name}' cannot be exported: these sensors do not measure the place; take "
            "repetitive:place='counted'."
        )
    model = line_model(context, mean_line(context), *policy.delays)
    sampled = Sampled(model, constants["interval"])
    poles, modes = np.linalg.eig(model.a)
    residues = (model.c[0] @ modes) * np.linalg.solve(modes, model.b[:, 0]) / (2 * math.pi)
    poles /= 2 * math.pi  # Hz
    most = len(harmonics(task.settings.speeds[0] / context.alignment.mean_length))
    constants |= {
        "law": acting.REPETITIVE,
        "counts": policy.counts,
        **dict(zip(("learning", "forgetting", "response"), np.abs(policy.gains).tolist(), strict=True)),
        "most_harmonics": most,
        "line_states": sampled.size,
        "line_a": sampled.a,
        "line_b": sampled.b,
        "line_c": sampled.c[0],
        "line_modes": len(poles),
        "pole": np.array([poles.real, poles.imag]),
        "residue": np.array([residues.real, residues.imag]),
        "line_delay": model.delay,
        "sine": np.sin(2 * np.pi * np.arange(PEAKS) / PEAKS),
    }
    _add_washout(constants, WASHED, slice(constants["actions"], None))
    state |= _zeros({"turn": (2, most), "towards": (2, most), "learnt": (2, most)})
    state |= _zeros({"line": sampled.size, "following_line": sampled.size, "sums": 4}) | {"harmonics": 0}
    numbers = "force_average force_share counted measured_speed learns_at span_share spans sum_steps"
    state |= dict.fromkeys((*numbers.split(), "first_spans", "first_count", "trust"), 0.0)


def _add_guard(constants: Table, state: Table, guard: Guard) -> None:
    """Add what is the guard's alone; the nominal force and the readings are those of the controller."""
    own = guard.constants | {"fault_steps": constants["memory_steps"] + 8}
    for table, given in ((constants, own), (state, state_of(own))):
        table |= {name: value for name, value in given.items() if name not in table}
