"""The model file: arrays and a table of facts, as safetensors, so that no code runs from it.

The arrays under ``actor/`` are the deterministic policy, which runs without torch. Those under ``learner/``
and ``replay/`` let a training resume.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, field_validator

from panto_baselines.policies.repetitive import WashoutSettings
from panto_env.base.checksums import __version__, read_arrays, write_arrays
from panto_env.base.errors import InputError
from panto_env.base.settings import Positive, Settings
from panto_env.control.entries import READING_ENTRIES, present
from panto_env.control.observation import Context

Weights = NDArray[np.float32]
Arrays = dict[str, NDArray[Any]]
CELL = "actor/cell_"
"""How the names of a recurrent cell's arrays begin."""
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer."""


@dataclass(frozen=True)
class Actor:
    """Deterministic policy: a multilayer perceptron from an observation to an action, if need be recurrent.

    It is a policy (``panto_env.policies.Policy``) for every context of the right shape. With a cell its state
    is that of one episode: every policy has an actor of its own.
    """

    weights: tuple[Weights, ...]  # of each layer, (outputs, inputs)
    biases: tuple[Weights, ...]  # of each layer, (outputs,)
    activation: Literal["tanh", "relu"]  # of the hidden layers
    squashed: bool = False  # whether the last layer goes through tanh; otherwise it is clipped
    cell: Cell | None = None  # after the first layer; the second sees its state, then the first one's values
    _state: list[NDArray[np.float32]] = field(default_factory=list, compare=False, repr=False)

    @property
    def units(self) -> int:
        """Width of the cell; 0: there is none."""
        return 0 if self.cell is None else self.cell.weight_state.shape[1]

    def reset(self, context: Context) -> None:
        """Forget the episode before."""
        self._state[:] = [np.zeros(self.units, dtype=np.float32)]

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (actions,), each in -1..1, for an observation, (entries,)."""
        values = observation
        last = len(self.weights) - 1
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            values = weight @ values + bias
            if k < last:
                values = np.tanh(values) if self.activation == "tanh" else np.maximum(values, 0)
            if k == 0 and self.cell is not None:
                self._state[0] = self.cell.following(values, self._state[0])
                values = np.concatenate([self._state[0], values])
        if self.squashed:
            values = np.tanh(values)
        return np.clip(values, -1.0, 1.0).astype(np.float64)


class Cell(NamedTuple):
    """A gated recurrent unit, with its gates in torch's order: reset, update, new."""

    weight_input: Weights  # (3 units, inputs)
    weight_state: Weights  # (3 units, units)
    bias_input: Weights  # (3 units,)
    bias_state: Weights  # (3 units,)

    def check(self, inputs: int) -> None:
        """Raise ValueError unless its arrays hold finite numbers and fit each other and the inputs."""
        gates = 3 * self.weight_state.shape[1] if self.weight_state.ndim == 2 else -1
        shapes = ((gates, inputs), (gates, gates // 3), (gates,), (gates,))
        if tuple(each.shape for each in self) != shapes:
            raise ValueError("the cell of its network does not fit the layer before it")
        if not all(map(_finite, self)):
            raise ValueError("the cell of its network holds values that are not finite numbers")

    def following(self, values: NDArray[np.float32], state: NDArray[np.float32]) -> NDArray[np.float32]:
        """State after the present one (Cho et al., EMNLP 2014, as torch has it)."""
        given = self.weight_input @ values + self.bias_input
        kept = self.weight_state @ state + self.bias_state
        units = state.size
        gates = 1 / (1 + np.exp(-(given[: 2 * units] + kept[: 2 * units])))
        reset, update = gates[:units], gates[units:]
        new = np.tanh(given[2 * units :] + reset * kept[2 * units :])
        following: NDArray[np.float32] = (1 - update) * new + update * state
        return following


class Needs(Settings):
    """Observation and actuator that a policy was trained with, which every task that it runs in must have."""

    observation: str  # kind of the layout
    harmonics: int = 1  # of the position within the span
    history: int = 0  # earlier control steps that are observed
    front: tuple[float, ...] = ()  # places ahead whose contact force the pantograph in front measured (m)
    memory: tuple[float, ...] = ()  # times until places of which earlier spans are remembered (s)
    memory_spans: int = 1  # number of these spans
    line_values: bool = False  # whether the line's are observed
    normalise: tuple[float, float] | None = None  # speeds (km/h) of the passive runs that normalise readings
    entries: tuple[tuple[str, float, float], ...]  # name, centre and scale of each observation
    channels: tuple[int, ...]  # actuator that each action drives: 0 frame, 1 head
    force_limit: float  # N
    control_interval: float  # s
    washout: float = 0.0  # time constant (s) of what the environment subtracts from the actions; 0: nothing

    @field_validator("channels")
    @classmethod
    def _driven(cls, channels: tuple[int, ...]) -> tuple[int, ...]:
        if channels not in ((0,), (1,), (0, 1)):
            raise ValueError("no actuator drives that")
        return channels

    @classmethod
    def of(cls, context: Context) -> Needs:
        """Observation and actuator of an episode."""
        layout = context.layout
        # Normalised readings use each line's own centre and slope, which the policy is meant to see.
        names = (*(name for name, _, _ in READING_ENTRIES), "remembered force", "speed")
        hidden = names if layout.normalise else ()
        entries = tuple(
            (each.name, 0.0, 1.0) if present(each) in hidden else (each.name, each.centre, each.scale)
            for each in layout.entries
        )
        of_layout = ("harmonics", "history", "front", "memory", "memory_spans", "line_values", "normalise")
        of_context = ("channels", "force_limit", "control_interval", "washout")
        given = {name: getattr(layout, name) for name in of_layout}
        given |= {name: getattr(context, name) for name in of_context}
        return cls(observation=layout.kind, entries=entries, **given)


class Step(Settings):
    """A step from an observation to the network: scaled, or stacked with earlier ones, oldest first."""

    centre: tuple[float, ...] = ()  # is subtracted; (): it is stacked
    scale: tuple[Positive, ...] = ()  # divides the difference
    bound: Positive | None = None  # maximum magnitude, to which that is clipped
    frames: Annotated[int, Field(ge=1)] = 1  # that are stacked
    padding: tuple[float, ...] | None = None  # frame before the first one; None: that one, repeated


class Facts(Settings):
    """Facts that a model file holds about its policy."""

    format: Literal[2] = 2
    version: str = __version__  # of panto_env
    commit: str | None = None  # of the checkout that it was trained with
    command: str | None = None  # command that trained it
    algorithm: str
    seed: int
    steps: int  # environment steps that it has learnt from
    updates: int  # of the networks, as Stable-Baselines3 counts them
    environment: dict[str, Any]  # environment that it was trained in: id and arguments
    variants: tuple[dict[str, Any], ...] = ()  # changes of its arguments, each with a share of the training
    needs: Needs
    steps_before: tuple[Step, ...] = ()  # from the observation to the network
    residual_of: str | None = None  # policy that its action is added to
    residual_share: float = 1.0  # factor on its action when added
    washout: WashoutSettings | None = None  # the slow average that is subtracted from its action
    ratio: float | None = None  # from the last evaluation: mean of sigma over the passive pantograph's
    qualified: bool = False  # from the last evaluation: whether the mean force stayed within its range
    activation: Literal["tanh", "relu"]
    squashed: bool

    @property
    def inputs(self) -> int:
        """Number of the network's inputs. Raises ValueError where the steps do not fit each other."""
        width = len(self.needs.entries)
        for step in self.steps_before:
            given = (step.centre, step.scale) if step.centre else (step.padding,)
            if any(each is not None and len(each) != width for each in given):
                raise ValueError("the steps from its observation to its network do not fit each other")
            width *= step.frames
        return width


def write_model(path: Path, model: Any, actor: Actor, facts: Facts, replay: bool = False) -> None:
    """Write a model file, whole or not at all. replay: include the replay buffer.

    Settings of optimisers are not included: a new learner gets them from the training. Raises InputError if
    it can't be written.
    """
    tensors = {name: getattr(model, name) for name in model._get_torch_save_params()[1]}
    for name, state in model.get_parameters().items():
        if "param_groups" in state:  # of an optimiser
            for k, moments in state["state"].items():
                tensors |= {f"{name}/{k}/{key}": value for key, value in moments.items()}
        else:
            tensors |= {f"{name}/{key}": value for key, value in state.items()}
    arrays = {f"learner/{name}": tensor.detach().cpu().numpy() for name, tensor in tensors.items()}
    if replay:
        buffer = model.replay_buffer
        filled = buffer.buffer_size if buffer.full else buffer.pos
        arrays |= {f"replay/{name}": getattr(buffer, name)[:filled] for name in REPLAY}
        arrays["replay/position"] = np.array([buffer.pos, buffer.full])
    write_policy(path, facts, actor, arrays)


def write_policy(path: Path, facts: Facts, actor: Actor, others: Arrays | None = None) -> None:
    """Write a model file, by default without a state for further training.

    Raises InputError if it can't be written.
    """
    layers: Arrays = {f"actor/weight_{k}": weight for k, weight in enumerate(actor.weights)}
    layers |= {f"actor/bias_{k}": bias for k, bias in enumerate(actor.biases)}
    if actor.cell is not None:
        layers |= {f"{CELL}{name}": array for name, array in actor.cell._asdict().items()}
    write_arrays(path, facts.model_dump(mode="json"), layers | (others or {}))


def read_model(path: Path) -> tuple[Facts, Actor]:
    """Facts and policy of a model file.

    Raises InputError, naming the file, if it is damaged or not a model file of `panto train`.
    """
    return _read(path)[:2]


def restore(path: Path, model: Any) -> Facts:
    """Put a checkpoint's networks, optimisers, counts and replay buffer into a new learner.

    Raises InputError if the file is damaged or belongs to another algorithm or shape.
    """
    facts, _, arrays = _read(path)
    try:
        _learn_again(model, arrays)
    except (LookupError, RuntimeError, TypeError, ValueError) as error:
        reason = str(error).partition("\n")[0].rstrip(".")
        raise InputError(f"{path} does not fit the training's settings: {reason}.") from error
    model.num_timesteps, model._n_updates = facts.steps, facts.updates
    return facts


def _learn_again(model: Any, arrays: Arrays) -> None:
    import torch

    learner = [(name, array) for name, array in arrays.items() if name.startswith("learner/")]
    tensors = {name.removeprefix("learner/"): torch.from_numpy(array) for name, array in learner}
    parameters = model.get_parameters()
    for name, state in parameters.items():
        if "param_groups" in state:  # of an optimiser
            moments = state["state"] = dict[int, dict[str, Any]]()
            for path in (each for each in tensors if each.startswith(f"{name}/")):
                _, k, key = path.split("/")
                moments.setdefault(int(k), {})[key] = tensors[path]
        else:
            state.update({key: tensors[f"{name}/{key}"] for key in state})
    model.set_parameters(parameters)
    for name in model._get_torch_save_params()[1]:  # outside networks, such as SAC's coefficient of entropy
        getattr(model, name).data = tensors[name]
    if "replay/position" in arrays:
        buffer = model.replay_buffer
        for name in REPLAY:
            getattr(buffer, name)[: len(arrays[f"replay/{name}"])] = arrays[f"replay/{name}"]
        position, full = arrays["replay/position"]
        buffer.pos, buffer.full = int(position), bool(full)


def _read(path: Path) -> tuple[Facts, Actor, Arrays]:
    try:
        table, arrays = read_arrays(path)
        facts = Facts.model_validate(table)
        return facts, actor_of(arrays, facts), arrays
    except FileNotFoundError as error:
        raise InputError(f"The model file {path} does not exist; check the path.") from error
    except (OSError, ValueError) as error:
        reason = "its facts are not valid" if isinstance(error, ValidationError) else str(error)
        raise InputError(
            f"{path} is not a whole model file ({reason.rstrip('.')}); take another one, such as an earlier "
            "checkpoint, or train a model with `panto train`."
        ) from error


def actor_of(arrays: Arrays, facts: Facts) -> Actor:
    """The policy's network. Raises ValueError unless its layers fit each other and what the facts say."""
    layers = {name: array for name, array in arrays.items() if name.startswith("actor/")}
    parts = {name.removeprefix(CELL): layers.pop(name) for name in list(layers) if name.startswith(CELL)}
    if parts and set(parts) != set(Cell._fields):
        raise ValueError("its network has only a part of a cell")
    cell = Cell(**parts) if parts else None
    count, width = len(layers) // 2, facts.inputs
    names = [[f"actor/{kind}_{k}" for k in range(count)] for kind in ("weight", "bias")]
    if not count or set(layers) != {*names[0], *names[1]}:
        raise ValueError("its network has no layers, or not a weight and a bias in each")
    weights, biases = (tuple(layers[name] for name in each) for each in names)
    for k, (weight, bias) in enumerate(zip(weights, biases, strict=True), start=1):
        if not (_finite(weight) and _finite(bias)):
            raise ValueError(f"layer {k} of its network holds values that are not finite numbers")
        if weight.ndim != 2 or weight.shape[1] != width or bias.shape != weight.shape[:1]:
            raise ValueError(f"layer {k} of its network does not fit the one before, or what it observes")
        width = len(bias)
        if k == 1 and cell is not None:
            cell.check(width)
            width += cell.weight_state.shape[1]
    if width != len(facts.needs.channels):
        raise ValueError("its network differs in shape from its facts")
    return Actor(weights, biases, facts.activation, facts.squashed, cell)


def _finite(array: NDArray[Any]) -> bool:
    return array.dtype.kind == "f" and bool(np.isfinite(array).all())
