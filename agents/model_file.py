"""The model file: a Stable-Baselines3 zip with what a policy and a resumed training need in addition.

``panto.json`` holds the facts below, ``actor.npz`` the deterministic policy, and ``replay.npz``, in a
checkpoint of SAC, the replay buffer; ``sha256.json`` the checksums of all other parts. A policy is read from
the first two alone, so that running a model file needs no torch and unpickles nothing.
"""

from __future__ import annotations

import json
import os
import zipfile
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError, field_validator

from panto_baselines.policies.washout import WashoutSettings
from panto_env.base.checked_json import warn_unchecked
from panto_env.base.errors import InputError
from panto_env.base.files import write_whole
from panto_env.base.settings import Settings
from panto_env.base.version import __version__
from panto_env.control.context import Context
from panto_env.control.entries import READING_ENTRIES, present

from .actor import Actor
from .model_parts import (
    READ_ERRORS,
    check_checksums,
    check_sizes,
    layers_of,
    read_arrays,
    read_part,
    write_arrays,
    write_checksums,
)

FACTS, ACTOR, REPLAY = "panto.json", "actor.npz", "replay.npz"
MOST_FACTS, MOST_ACTOR = 2**20, 2**28
"""Bytes that facts and network may unpack to."""
DRIVEN = ((0,), (1,), (0, 1))
"""What the actions of a policy can drive: frame, head, or both."""
REPLAY_ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


class Needs(Settings):
    """What a policy was trained with and needs in every task that it runs in."""

    observation: str  # kind of the layout
    harmonics: int = 1  # of the position within the span
    history: int = 0  # earlier control steps that are observed
    normalise: tuple[float, float] | None = None  # speeds (km/h) of the passive runs that readings count from
    entries: tuple[tuple[str, float, float], ...]  # name, centre and scale of each observation
    channels: tuple[int, ...]  # what each action drives: 0 frame, 1 head
    force_limit: float  # N
    control_interval: float  # s

    @field_validator("channels")
    @classmethod
    def _driven(cls, channels: tuple[int, ...]) -> tuple[int, ...]:
        if channels not in DRIVEN:
            raise ValueError("no actuator drives that")
        return channels

    @classmethod
    def of(cls, context: Context) -> Needs:
        """What an episode offers a policy."""
        layout = context.layout
        # What readings are counted from is then that of each line: the policy is meant to take it so.
        names = (*(name for name, _, _ in READING_ENTRIES), "speed") if layout.normalise else ()
        return cls(
            observation=layout.kind,
            harmonics=layout.harmonics,
            history=layout.history,
            normalise=layout.normalise,
            entries=tuple(
                (entry.name, 0.0, 1.0) if present(entry) in names else (entry.name, entry.centre, entry.scale)
                for entry in layout.entries
            ),
            channels=context.channels,
            force_limit=context.force_limit,
            control_interval=context.control_interval,
        )


class Facts(Settings):
    """What a model file says about itself."""

    format: Literal[2] = 2
    version: str = __version__  # of panto_env
    commit: str | None = None  # of the checkout that it was trained with
    command: str | None = None  # that trained it
    algorithm: str
    seed: int
    steps: int  # environment steps that it has learnt from
    updates: int  # of the networks, as Stable-Baselines3 counts them
    environment: dict[str, Any]  # that it was trained in: id and arguments
    needs: Needs
    residual_of: str | None = None  # policy that its action is added to
    residual_share: float = 1.0  # to which share
    washout: WashoutSettings | None = None  # the slow average that is taken off its action
    ratio: float | None = None  # when last evaluated: mean of sigma over that of the passive pantograph
    qualified: bool = False  # when last evaluated: whether the mean force kept within its range
    activation: Literal["tanh", "relu"]
    squashed: bool


def write_model(path: Path, model: Any, actor: Actor, facts: Facts, replay: bool = False) -> None:
    """Write a model file, whole or not at all. replay: with the replay buffer.

    Raises InputError where it can't be written.
    """
    with write_whole(path) as temporary:
        try:
            model.save(temporary)
        except RuntimeError as error:  # torch's, where the disk is full
            raise InputError(f"{path} cannot be written: {str(error).splitlines()[0]}") from error
        with zipfile.ZipFile(temporary, "a") as archive:
            archive.writestr(FACTS, facts.model_dump_json(indent=1))
            write_arrays(archive, ACTOR, _arrays_of(actor))
            if replay:
                buffer = model.replay_buffer
                filled = buffer.buffer_size if buffer.full else buffer.pos
                arrays = {name: getattr(buffer, name)[:filled] for name in REPLAY_ARRAYS}
                arrays["position"] = np.array([buffer.pos, buffer.full])
                write_arrays(archive, REPLAY, arrays)
            write_checksums(archive)


def export_model(source: Path, target: Path) -> None:
    """Write the parts of a model file that a policy needs, facts and arrays, and nothing that is pickled.

    Raises InputError, naming the file, where ``source`` is damaged or ``target`` cannot be written.
    """
    facts, actor = read_model(source)
    with write_whole(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(FACTS, facts.model_dump_json(indent=1))
        write_arrays(archive, ACTOR, _arrays_of(actor))
        write_checksums(archive)


def read_model(path: Path) -> tuple[Facts, Actor]:
    """The parts of a model file that a policy needs.

    UncheckedWarning where it is of an older version, without checksums. Raises InputError, naming the file,
    where it is damaged, would unpack to far more than it is, or `panto train` did not write it.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            check_sizes(archive, os.path.getsize(path))
            checked = check_checksums(archive)
            if FACTS not in archive.namelist():
                raise ValueError(f"it holds no {FACTS}, so `panto train` has not written it")
            facts = Facts.model_validate(json.loads(read_part(archive, FACTS, MOST_FACTS)))
            arrays = read_arrays(archive, ACTOR, MOST_ACTOR)
        weights, biases = layers_of(arrays, len(facts.needs.entries), len(facts.needs.channels))
        actor = Actor(weights, biases, facts.activation, facts.squashed)
    except FileNotFoundError as error:
        raise InputError(f"The model file {path} does not exist; check the path.") from error
    except READ_ERRORS as error:
        reason = f"its {FACTS} is not valid" if isinstance(error, ValidationError) else str(error)
        reason = reason.partition("\n")[0].rstrip(".") or type(error).__name__
        raise InputError(
            f"{path} is not a whole model file ({reason}); take another, such as an earlier "
            "checkpoint, or train anew with `panto train`."
        ) from error
    if not checked:
        warn_unchecked(path)
    return facts, actor


def restore(path: Path, model: Any) -> Facts:
    """Put a checkpoint's networks, optimisers, counts and replay buffer into a new learner.

    Raises InputError where the file is damaged or of another algorithm or shape.
    """
    from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr

    facts, _ = read_model(path)
    try:
        _, parameters, variables = load_from_zip_file(path, load_data=False, device="cpu")
        model.set_parameters(parameters)
        for name, value in (variables or {}).items():
            recursive_setattr(model, f"{name}.data", value.data)
        model.num_timesteps, model._n_updates = facts.steps, facts.updates
        with zipfile.ZipFile(path) as archive:
            if REPLAY in archive.namelist():
                buffer = model.replay_buffer
                stores = {name: getattr(buffer, name) for name in REPLAY_ARRAYS}
                most = sum(store.nbytes for store in stores.values()) + MOST_FACTS
                arrays = read_arrays(archive, REPLAY, most)
                for name, store in stores.items():
                    store[: len(arrays[name])] = arrays[name]
                buffer.pos, buffer.full = int(arrays["position"][0]), bool(arrays["position"][1])
    except (*READ_ERRORS, UnpicklingError) as error:
        reason = str(error).partition("\n")[0].rstrip(".")
        raise InputError(f"{path} does not fit the training's settings: {reason}.") from error
    return facts


def _arrays_of(actor: Actor) -> dict[str, Any]:
    weights = {f"weight_{k}": weight for k, weight in enumerate(actor.weights)}
    return weights | {f"bias_{k}": bias for k, bias in enumerate(actor.biases)}
