"""A trained policy's network as ONNX: an observation and states in, an action and the next states out.

What is around a network, a base policy or a guard, is not in it: the export as C has these.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_baselines.policies.repetitive import WashoutSettings
from panto_env.base.errors import InputError
from panto_env.base.extras import require
from panto_env.base.files import write_whole
from panto_env.policies import Policy

from ..model_file import Actor, Cell, Needs, Step
from ..policy import TrainedPolicy

OPSET, FORMAT = 17, 8
"""Version of the operators, and of the file's format that goes with it: run by tools since 2022."""
PASSES = "passes"
"""First axis of every input and output: passes that are controlled side by side."""


def write_onnx(policy: Policy, path: str | Path) -> None:
    """Write a trained policy's network, whole or not at all.

    Inputs are the observation, (passes, entries) in float32, and the policy's states. A state's input is
    at first what the metadata's "start" has, then the step's output of its name after ``next_``. The output
    "action", (passes, actions) in float32, is in -1..1 of the actuator's force limit. Steps before the
    network and a washout of the policy itself are included. Raises InputError for a policy that is more than
    its network, where the package onnx is missing, or if the file can't be written.
    """
    require("ONNX", "onboard", "onnx")
    if not isinstance(policy, TrainedPolicy):
        held = type(policy).__name__
        raise InputError(f"ONNX holds the network of one trained policy, not {held}; export it as C instead.")
    facts = policy.facts
    if facts.residual_of is not None:
        raise InputError(
            f"{policy.path} adds its action to that of {facts.residual_of}, which is no network; export it "
            "as C instead."
        )
    if facts.needs.washout:
        raise InputError(
            f"{policy.path} needs a task that subtracts the slow average of its force (washout), which no "
            "network does; export it as C instead."
        )
    graph = _Graph()
    width, actions = len(facts.needs.entries), len(facts.needs.channels)
    values = graph.input("observation", width, "Observation: the metadata has its entries and their scales")
    for number, step in enumerate(facts.steps_before):
        values, width = _prepared(graph, values, width, step, number)
    action = _network(graph, values, policy.actor)
    if facts.washout is not None:
        action = _washed_out(graph, action, actions, facts.washout, facts.needs)
    graph.output("action", action, actions, "Forces as shares of the actuator's limit, -1..1")
    model = graph.model(policy.path.stem, _metadata(policy) | {"start": json.dumps(graph.start)})
    with write_whole(path) as temporary:
        temporary.write_bytes(model.SerializeToString(deterministic=True))


def _metadata(policy: TrainedPolicy) -> dict[str, str]:
    """What the policy is for, as text: names of its observation, its limits, and what trained it."""
    facts = policy.facts
    needs = facts.needs.model_dump(mode="json")
    entries = [dict(zip(("name", "centre", "scale"), each, strict=True)) for each in needs.pop("entries")]
    told: dict[str, Any] = {name: getattr(facts, name) for name in ("algorithm", "command", "commit", "seed")}
    told |= {"panto_env": facts.version, "environment steps": facts.steps, "environment": facts.environment}
    told |= {"variants": list(facts.variants), "needs": needs, "observation": entries}
    return {name: each if isinstance(each, str) else json.dumps(each) for name, each in told.items()}


class _Graph:
    """A graph that is built from front to back; values are known by their names."""

    def __init__(self) -> None:
        from onnx import helper, numpy_helper

        self.start: dict[str, Any] = {}  # of each state
        self._helper, self._arrays = helper, numpy_helper
        self._nodes: list[Any] = []
        self._constants: list[Any] = []
        self._inputs: list[Any] = []
        self._outputs: list[Any] = []

    def constant(self, array: Any, kind: type[np.generic] = np.float32) -> str:
        """A constant array."""
        name = f"constant_{len(self._constants)}"
        self._constants.append(self._arrays.from_array(np.asarray(array, dtype=kind), name))
        return name

    def node(self, operator: str, *inputs: str, skipped: int = 0, **attributes: Any) -> str:
        """An operator's output: the one after those that are skipped."""
        name = f"value_{len(self._nodes)}"
        outputs = [""] * skipped + [name]
        self._nodes.append(self._helper.make_node(operator, inputs, outputs, name, **attributes))
        return name

    def cast(self, value: str, kind: type[np.generic]) -> str:
        """A value in another type."""
        return self.node("Cast", value, to=self._element(kind))

    def input(self, name: str, width: int, text: str, kind: type[np.generic] = np.float32) -> str:
        """An input, (passes, width)."""
        self._inputs.append(self._information(name, width, kind, text))
        return name

    def state(self, name: str, width: int, start: Any, text: str, kind: type[np.generic] = np.float32) -> str:
        """A state, (passes, width). start: its first value, (width,) or one for all."""
        self.start[name] = start
        return self.input(name, width, text, kind)

    def output(
        self, name: str, value: str, width: int, text: str, kind: type[np.generic] = np.float32
    ) -> None:
        """A value as an output, (passes, width)."""
        self._nodes.append(self._helper.make_node("Identity", [value], [name], name))
        self._outputs.append(self._information(name, width, kind, text))

    def model(self, name: str, metadata: dict[str, str]) -> Any:
        """The graph as a model."""
        graph = self._helper.make_graph(self._nodes, name, self._inputs, self._outputs, self._constants)
        given = {"opset_imports": [self._helper.make_opsetid("", OPSET)], "ir_version": FORMAT}
        model = self._helper.make_model(graph, **given, producer_name="panto-env")
        self._helper.set_model_props(model, metadata)
        return model

    def _element(self, kind: type[np.generic]) -> int:
        return int(self._helper.np_dtype_to_tensor_dtype(np.dtype(kind)))

    def _information(self, name: str, width: int, kind: type[np.generic], text: str) -> Any:
        return self._helper.make_tensor_value_info(name, self._element(kind), [PASSES, width], text)


def _prepared(graph: _Graph, values: str, width: int, step: Step, number: int) -> tuple[str, int]:
    """Values after a step before the network, as ``Prepared`` has it, and their number."""
    if step.centre:
        exact = graph.cast(values, np.float64)
        exact = graph.node("Sub", exact, graph.constant(step.centre, np.float64))
        exact = graph.node("Div", exact, graph.constant(step.scale, np.float64))
        if step.bound is not None:
            bounds = (graph.constant(each, np.float64) for each in (-step.bound, step.bound))
            exact = graph.node("Clip", exact, *bounds)
        return graph.cast(exact, np.float32), width
    earlier = step.frames - 1
    if not earlier:
        return values, width
    # Without padding the first frame is repeated: no frame is known yet, which NaN says.
    start = "NaN" if step.padding is None else list(step.padding) * earlier
    text = f"The {earlier} frames before this one, oldest first"
    frames = graph.state(f"frames_{number}", earlier * width, start, text)
    if step.padding is None:
        repeated = graph.node("Concat", *[values] * earlier, axis=1)
        frames = graph.node("Where", graph.node("IsNaN", frames), repeated, frames)
    stacked = graph.node("Concat", frames, values, axis=1)
    limits = (graph.constant([each], np.int64) for each in (width, step.frames * width, 1))
    graph.output(f"next_frames_{number}", graph.node("Slice", stacked, *limits), earlier * width, text)
    return stacked, step.frames * width


def _network(graph: _Graph, values: str, actor: Actor) -> str:
    """The layers of an actor, with its cell if it has one."""
    last = len(actor.weights) - 1
    for k, (weight, bias) in enumerate(zip(actor.weights, actor.biases, strict=True)):
        values = graph.node("Gemm", values, graph.constant(weight), graph.constant(bias), transB=1)
        if k < last:
            values = graph.node("Tanh" if actor.activation == "tanh" else "Relu", values)
        if k == 0 and actor.cell is not None:
            values = graph.node("Concat", _cell(graph, values, actor.cell), values, axis=1)
    if actor.squashed:
        values = graph.node("Tanh", values)
    return graph.node("Clip", values, graph.constant(-1.0), graph.constant(1.0))


def _cell(graph: _Graph, values: str, cell: Cell) -> str:
    """The state of a gated recurrent unit after a step. ONNX has its gates in another order than torch."""
    units = cell.weight_state.shape[1]
    text = "State of the gated recurrent unit"
    state = graph.state("cell", units, 0.0, text)

    def ordered(array: NDArray[np.float32]) -> NDArray[np.float32]:
        reset, update, new = np.split(array, 3)
        return np.concatenate([update, reset, new])

    weights = [graph.constant(ordered(each)[None]) for each in (cell.weight_input, cell.weight_state)]
    biases = graph.constant(np.concatenate([ordered(cell.bias_input), ordered(cell.bias_state)])[None])
    first = graph.constant([0], np.int64)  # the axis of steps, of which there is one, or of directions
    sequence, before = (graph.node("Unsqueeze", each, first) for each in (values, state))
    given = {"hidden_size": units, "linear_before_reset": 1}
    after = graph.node("GRU", sequence, *weights, biases, "", before, skipped=1, **given)
    after = graph.node("Squeeze", after, first)
    graph.output("next_cell", after, units, text)
    return after


def _washed_out(graph: _Graph, action: str, width: int, settings: WashoutSettings, needs: Needs) -> str:
    """The action without its slow average, as ``Washout`` has it, in its precision."""
    lag, rate, interval = settings.lag, settings.rate, needs.control_interval

    def number(value: float) -> str:
        return graph.constant(value, np.float64)

    words = ("Slow average of the actuator's force (N)", "Actuator's force (N)")
    average = graph.state("washout_average", width, 0.0, words[0], np.float64)
    force = graph.state("washout_force", width, 0.0, words[1], np.float64)
    requested = graph.node("Mul", graph.cast(action, np.float64), number(needs.force_limit))
    limits = number(-needs.force_limit), number(needs.force_limit)
    left = graph.node("Clip", graph.node("Sub", requested, average), *limits)
    ahead = graph.node("Sub", left, force)
    change = ahead
    if lag:  # at the limit of rate, then by the lag; without a lag it is there at once
        distance = graph.node("Abs", ahead)
        over = graph.node("Max", graph.node("Sub", distance, number(rate * lag)), number(0.0))
        by_rate = graph.node("Min", over, number(rate * interval))
        # exp(-(interval - by_rate / rate) / lag)
        exponent = graph.node("Sub", graph.node("Div", by_rate, number(rate * lag)), number(interval / lag))
        nearer = graph.node("Sub", number(1.0), graph.node("Exp", exponent))
        rest = graph.node("Mul", graph.node("Sub", distance, by_rate), nearer)
        change = graph.node("Mul", graph.node("Sign", ahead), graph.node("Add", by_rate, rest))
    force = graph.node("Add", force, change)
    share = number(1.0 - math.exp(-interval / settings.time_constant))
    average = graph.node("Add", average, graph.node("Mul", force, share))
    graph.output("next_washout_average", average, width, words[0], np.float64)
    graph.output("next_washout_force", force, width, words[1], np.float64)
    return graph.cast(graph.node("Div", left, limits[1]), np.float32)
