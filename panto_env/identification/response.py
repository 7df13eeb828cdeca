"""What the model does under a recorded plate motion or contact force, discretised exactly."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..plant.jit import kernel
from .model import Parameters, matrices


@kernel
def recur(transition, gains, states):
    """x[k + 1] = transition x[k] + gains[k], in place; states[0] is given."""
    size = states.shape[1]
    for k in range(gains.shape[0]):
        for i in range(size):
            total = gains[k, i]
            for j in range(size):
                total += transition[i, j] * states[k, j]
            states[k + 1, i] = total


def polynomials(values: Array, time_step: float) -> Array:
    """Value and three derivatives at the start of each step, (n - 1, 4), of the cubic spline through samples.

    Held or straight input would do to the small difference of plate and head what sampling ten times
    slower does; between samples of a smooth motion a spline is good to the fourth order.
    """
    from scipy.interpolate import CubicSpline  # slow to import

    coefficients = CubicSpline(time_step * np.arange(len(values)), values).c
    return np.ascontiguousarray(coefficients[::-1].T * np.array([1.0, 1.0, 2.0, 6.0]))


def respond(a: Array, b: Array, inputs: Array, time_step: float, initial: Array) -> Array:
    """States, (n, m), of x' = a x + b [u, u'], u given by ``polynomials``: exact but for rounding."""
    from scipy.linalg import expm  # slow to import

    size = len(a)
    block = np.zeros((size + 4, size + 4))
    block[:size, :size], block[:size, size : size + 2] = a, b
    block[range(size, size + 3), range(size + 1, size + 4)] = 1.0
    whole = expm(block * time_step)
    states = np.empty((len(inputs) + 1, size))
    states[0] = initial
    recur(whole[:size, :size].copy(), inputs @ whole[:size, size:].T, states)
    return states


def rest_on_plate(parameters: Parameters, plate: float) -> Array:
    """State, (4,), at rest on a plate held at ``plate`` (m)."""
    a, b = matrices(parameters)
    return np.asarray(np.linalg.solve(a, -b[:, 0] * plate))


def under_plate(parameters: Parameters, plate: Array, time_step: float, initial: Array) -> Array:
    """States [y_p2, y_p3, y_p2', y_p3'], (n, 4), while the plate moves as recorded (m)."""
    a, b = matrices(parameters)
    return respond(a, b, polynomials(plate, time_step), time_step, initial)


def contact_force(parameters: Parameters, plate: Array, states: Array, time_step: float) -> Array:
    """Contact force (N), (n,), between a plate (m) and the pan head, as the model has it."""
    inputs = polynomials(plate, time_step)
    last = inputs[-1] @ np.array([0.0, 1.0, time_step, time_step**2 / 2])
    speed = np.append(inputs[:, 1], last)
    return np.asarray(parameters["k1T"] * (plate - states[:, 0]) + parameters["c1T"] * (speed - states[:, 2]))


def under_force(parameters: Parameters, force: Array, time_step: float) -> Array:
    """Displacements y_p1, y_p2, y_p3 (m), (n, 3), under a recorded contact force (N): paper 1's validation.

    Starts at rest under the mean force. Raises InputError where a damper or spring is not above 0: the
    plate is then without an equation of its own.
    """
    if not min(parameters.values()) > 0:
        raise InputError(
            "The model can be driven by the contact force only if all its parameters are above 0."
        )
    k1, c1, m2 = (parameters[name] for name in ("k1T", "c1T", "m2"))
    a, b = matrices(parameters)
    # The plate has no mass: c1T (y_p1' - y_p2') = f - k1T (y_p1 - y_p2).
    whole, gain = np.zeros((5, 5)), np.zeros((5, 2))
    whole[:4, :4] = a + np.outer(b[:, 1], [k1 / c1, 0.0, 1.0, 0.0])
    whole[:4, 4] = b[:, 0] - b[:, 1] * k1 / c1
    whole[4] = [k1 / c1, 0.0, 1.0, 0.0, -k1 / c1]
    gain[2, 0], gain[4, 0] = 1 / m2, 1 / c1
    initial = np.linalg.solve(whole, -gain[:, 0] * force.mean())
    states = respond(whole, gain, polynomials(force, time_step), time_step, initial)
    return states[:, [4, 0, 1]]
