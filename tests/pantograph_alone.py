"""Motion of a pantograph alone under the forces that a run recorded: a judge of what the run reports.

A recorded force is the mean over its time step, and the plant's forces are constant over a step, so the
equations of motion, written out here mass by mass and solved by SciPy's matrix exponential, must lead
through the very states that the run went through.
"""

import numpy as np
from scipy.linalg import expm


def equations(data):
    """Rates of displacements and velocities from themselves, and from forces on head and frame and the pair
    that pushes the head up and the mass below it down."""
    n = len(data.masses)
    rates, forces = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 3))
    rates[:n, n:] = np.eye(n)
    for k, (spring, damper) in enumerate(zip(data.stiffnesses, data.dampings, strict=True)):
        stretch = np.zeros(n)  # of the spring below mass k, whose lower end is the next mass or the ground
        stretch[k] = 1.0
        if k + 1 < n:
            stretch[k + 1] = -1.0
        rates[n:, :n] -= spring * np.outer(stretch, stretch)
        rates[n:, n:] -= damper * np.outer(stretch, stretch)
    forces[n, 0] = forces[2 * n - 1, 1] = forces[n, 2] = 1.0
    forces[n + 1, 2] -= 1.0
    mass = np.array(data.masses)[:, None]
    rates[n:] /= mass
    forces[n:] /= mass
    return rates, forces


def rest(data, lift, wire_stiffness, wire_height=0.0):
    """State at rest under ``lift`` (N) against a wire that is a spring (N/m) to the ground, or to a height
    above it (m)."""
    n = len(data.masses)
    rates, forces = equations(data)
    stiffness = -rates[n:, :n]
    stiffness[0, 0] += wire_stiffness / data.masses[0]
    push = forces[n:, 1] * lift + forces[n:, 0] * wire_stiffness * wire_height
    return np.concatenate([np.linalg.solve(stiffness, push), np.zeros(n)])


def replay(run, data, start):
    """States at the start and at the end of each step of a run, (steps + 1, 2 masses)."""
    rates, forces = equations(data)
    size = len(rates)
    whole = np.zeros((size + 3, size + 3))
    whole[:size] = np.hstack([rates, forces]) * run.time_step
    step = expm(whole)[:size]
    pushes = np.column_stack([-run.contact_force, run.lift + run.frame_force, run.head_force])
    states = [start]
    for push in pushes:
        states.append(step @ np.concatenate([states[-1], push]))
    return np.array(states)


def means(values):
    """Of each step's two ends."""
    return 0.5 * (values[1:] + values[:-1])
