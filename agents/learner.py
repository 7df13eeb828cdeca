"""State of a Stable-Baselines3 learner as arrays by name, and its restoration into a new learner."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer."""


def learnt(model: Any, replay: bool) -> Arrays:
    """Arrays of networks, optimisers and the coefficient of entropy. replay: include the replay buffer.

    Settings of optimisers are not included: a new learner gets them from the training.
    """
    tensors = dict(_variables(model))
    for name, state in model.get_parameters().items():
        if _is_optimiser(state):
            for k, own in state["state"].items():
                tensors |= {f"{name}/{k}/{key}": value for key, value in own.items()}
        else:
            tensors |= {f"{name}/{key}": value for key, value in state.items()}
    arrays = {f"learner/{name}": tensor.detach().cpu().numpy() for name, tensor in tensors.items()}
    if replay:
        buffer = model.replay_buffer
        filled = buffer.buffer_size if buffer.full else buffer.pos
        arrays |= {f"replay/{name}": getattr(buffer, name)[:filled] for name in REPLAY}
        arrays["replay/position"] = np.array([buffer.pos, buffer.full])
    return arrays


def learn_again(model: Any, arrays: Arrays) -> None:
    """Put arrays of ``learnt`` into a new learner.

    Raises LookupError, RuntimeError, TypeError or ValueError if the algorithm or a shape differs.
    """
    import torch

    tensors = {
        name.removeprefix("learner/"): torch.from_numpy(array)
        for name, array in arrays.items()
        if name.startswith("learner/")
    }
    parameters = model.get_parameters()
    for name, state in parameters.items():
        if _is_optimiser(state):
            moments: dict[int, dict[str, Any]] = {}
            for path in (each for each in tensors if each.startswith(f"{name}/")):
                _, k, key = path.split("/")
                moments.setdefault(int(k), {})[key] = tensors[path]
            state["state"] = moments
        else:
            state.update({key: tensors[f"{name}/{key}"] for key in state})
    model.set_parameters(parameters)
    for name, tensor in _variables(model):
        tensor.data = tensors[name]
    if "replay/position" in arrays:
        buffer = model.replay_buffer
        for name in REPLAY:
            getattr(buffer, name)[: len(arrays[f"replay/{name}"])] = arrays[f"replay/{name}"]
        position, full = arrays["replay/position"]
        buffer.pos, buffer.full = int(position), bool(full)


def _is_optimiser(state: Any) -> bool:
    """Whether a state dictionary belongs to a torch optimiser, not to a network."""
    return "param_groups" in state


def _variables(model: Any) -> Iterator[tuple[str, Any]]:
    """Tensors outside networks and optimisers, by name, such as SAC's coefficient of entropy."""
    for name in model._get_torch_save_params()[1]:
        yield name, getattr(model, name)
