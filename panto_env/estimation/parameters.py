"""Extended Kalman filter: the contact force and parameters of the pantograph together (paper 2, section 4.1).

The state is z with the logarithms of parameters over their known values. Since the contact force is itself
unknown, the collector head's mass cannot be seen: whatever it is wrong by, the force takes up. The frame
carries no unknown force, so that its mass, springs and dampers can be seen, but only if the lift is known:
were it not, all of them and the lift could be scaled alike. ``information`` measures both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError, suggest
from ..plant.pantograph.schema import PantographData
from .estimate import filter_motion, first_settled, model_of
from .kalman import corrected, correction, steady_gains
from .model import PAPER2, EstimatorSettings, Model
from .motion import Motion, check_motion

HEAD_MASS = "masses.1"
LIFT = "lift"
PRIOR = 0.1
"""How far a parameter may be from its known value, rms, relative. Own choice."""
STEP = 1e-4
"""Relative change of a parameter with which derivatives are taken."""
MOVED = 0.01
"""Change of a parameter, relative, after which the model is built anew about it."""


@dataclass(frozen=True)
class Parameters:
    """What was found with the force. p parameters."""

    names: tuple[str, ...]
    values: Array  # (p,): at the end of the record, SI units
    deviation: Array  # (p,): standard deviation by the filter, relative
    history: Array  # (n, p): values over the record
    force: Array  # (n,): contact force (N)
    pantograph: PantographData  # with these values

    @property
    def resolved(self) -> Array:
        """Share of each parameter's prior uncertainty that the record removed, (p,): 0 none, 1 all."""
        return 1 - self.deviation / PRIOR


def parameter_names(pantograph: PantographData) -> tuple[str, ...]:
    """All of the chain, as "masses.1" for the head's mass, without those that are 0."""
    keys = ("masses", "stiffnesses", "dampings")
    return tuple(
        f"{key}.{k}" for key in keys for k, value in enumerate(getattr(pantograph, key), start=1) if value
    )


def frame_parameters(pantograph: PantographData) -> tuple[str, ...]:
    """Those that can be seen: all but the head's mass."""
    return tuple(name for name in parameter_names(pantograph) if name != HEAD_MASS)


def estimate_parameters(
    motion: Motion,
    pantograph: PantographData,
    settings: EstimatorSettings | None = None,
    names: Sequence[str] | None = None,
) -> Parameters:
    """Contact force and parameters of a motion; names: of parameters, by default those that can be seen.

    Raises InputError for a motion that can't be a pantograph's, or names that are not its parameters.
    """
    from scipy.linalg import block_diag  # slow to import

    # A suspension whose error wanders takes up what the lift determines: all parameters then drift together.
    settings = (settings or EstimatorSettings()).model_copy(update=PAPER2)
    check_motion(motion, pantograph)
    names = frame_parameters(pantograph) if names is None else tuple(names)
    if not names:
        raise InputError("Name at least one parameter.")
    _check(names, pantograph)
    known, p = np.array([_get(pantograph, name) for name in names]), len(names)

    def model_at(logarithms: Array) -> Model:
        values = dict(zip(names, known * np.exp(logarithms), strict=True))
        return model_of(motion, changed(pantograph, values), settings)

    def linearised(about: Array) -> tuple[Model, Array, Array]:
        """The model, and derivatives of its transition, (p, N, N), and inputs, (p, N, 2), by logarithms."""
        sides = [[model_at(about + sign * STEP * row) for sign in (1, -1)] for row in np.eye(p)]
        transitions = np.array([(a.transition - b.transition) / (2 * STEP) for a, b in sides])
        return model_at(about), transitions, np.array([(a.inputs - b.inputs) / (2 * STEP) for a, b in sides])

    about = np.zeros(p)
    model, transitions, gains = linearised(about)
    measured, inputs = motion.measured(len(model.observed)), motion.inputs
    size = len(model.force)
    observed = np.hstack([model.observed, np.zeros((len(model.observed), p))])
    state = np.concatenate([model.start(measured[0], motion.lift), np.zeros(p)])
    covariance = block_diag(model.start_covariance, PRIOR**2 * np.eye(p))
    noise = block_diag(model.process_noise, np.zeros((p, p)))
    history, force = np.empty((len(measured), p)), np.empty(len(measured))
    for k, sample in enumerate(measured):
        gain, _ = correction(covariance, observed, model.measurement_noise)
        state = state + gain @ (sample - observed @ state)
        covariance = corrected(covariance, gain, observed, model.measurement_noise)
        history[k], force[k] = state[size:], model.force @ state[:size]
        z, logarithms = state[:size], state[size:]
        if np.abs(logarithms - about).max() > MOVED:
            about = logarithms.copy()
            model, transitions, gains = linearised(about)
        transition = model.transition + np.tensordot(logarithms - about, transitions, 1)
        driven = model.inputs + np.tensordot(logarithms - about, gains, 1)
        jacobian = np.eye(size + p)
        jacobian[:size, :size] = transition
        jacobian[:size, size:] = (transitions @ z + gains @ inputs[k]).T
        state[:size] = transition @ z + driven @ inputs[k]
        covariance = jacobian @ covariance @ jacobian.T + noise
    values = known * np.exp(history)
    return Parameters(
        names=names,
        values=values[-1],
        deviation=np.sqrt(np.diag(covariance)[size:]),
        history=values,
        force=force,
        pantograph=changed(pantograph, dict(zip(names, values[-1], strict=True))),
    )


def information(
    motion: Motion, pantograph: PantographData, settings: EstimatorSettings, names: Sequence[str]
) -> Array:
    """Fisher information, (p, p), on logarithms of parameters, "lift" among them, in a motion's innovations.

    The inverse bounds the covariance of any unbiased estimate of them (Cramér and Rao). A parameter without
    information cannot be seen; a direction without any, no combination of its parameters. The gain is held:
    what the noise would add, were its intensities known, does not count.
    """
    check_motion(motion, pantograph)
    _check([name for name in names if name not in (HEAD_MASS, LIFT)], pantograph)
    first = first_settled(motion)
    gains = steady_gains(model_of(motion, pantograph, settings))
    unit = np.linalg.cholesky(gains.innovation[0])

    def innovations(name: str, factor: float) -> Array:
        moved = replace(motion, lift=factor * motion.lift) if name == LIFT else motion
        values = {} if name == LIFT else {name: factor * _get(pantograph, name)}
        other = changed(pantograph, values)
        model = model_of(moved, other, settings)
        filtered = filter_motion(model, gains, moved)
        return np.linalg.solve(unit, filtered.innovations[first:].T).ravel()

    columns = [(innovations(name, 1 + STEP) - innovations(name, 1 - STEP)) / (2 * STEP) for name in names]
    slopes = np.array(columns)
    return np.asarray(slopes @ slopes.T)


def changed(pantograph: PantographData, values: dict[str, float]) -> PantographData:
    """A pantograph with other values of some parameters, by name."""
    update: dict[str, tuple[float, ...]] = {}
    for name, value in values.items():
        key, _, place = name.partition(".")
        chain = list(update.get(key, getattr(pantograph, key)))
        chain[int(place) - 1] = float(value)
        update[key] = tuple(chain)
    return pantograph.model_copy(update=update)


def _check(names: Sequence[str], pantograph: PantographData) -> None:
    if HEAD_MASS in names:
        raise InputError(
            f"The head's mass, '{HEAD_MASS}', can't be estimated with an unknown contact force, which takes "
            "up whatever it is wrong by; weigh the head, and leave it out."
        )
    known = parameter_names(pantograph)
    for name in names:
        if name not in known:
            raise InputError(
                f"'{name}' is no parameter of '{pantograph.name}' that can be estimated: "
                f"{suggest(name, known)}."
            )


def _get(pantograph: PantographData, name: str) -> float:
    key, _, place = name.partition(".")
    value: float = getattr(pantograph, key)[int(place) - 1]
    return value
