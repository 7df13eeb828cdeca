"""Energy over a run of the finite elements: what lift and train give is what is stored and lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.pantograph.schema import PantographData

from .hermite import Array
from .simulation import Newmark, _chain, _Contact
from .system import build


@dataclass(frozen=True)
class Balance:
    """Of a run."""

    error: float
    """Largest difference of what was given from what is stored and lost (J)."""
    turnover: float
    """Integral of the magnitude of the power (J)."""
    steps_with_slack: int
    """Number of steps in which a dropper was slack."""
    wire_forces: Array
    """On each pair's contact wire, (n_steps, n_pairs) (N)."""


def balance(
    line: FlexibleCatenaryData,
    pantograph: PantographData,
    speed_kmh: float,
    distance: float,
    step: float = 5e-4,
) -> Balance:
    """A run of ``distance`` (m) on a line without damping, under a head with some; both lose none elsewhere.

    Lift and train (F v y') give what is in wires, droppers (also slack), masses, contacts and dampers.
    """
    values = line.model_dump(exclude_none=True)
    values["damping"] = {"alpha": 0.0, "beta": 0.0}
    values["support"]["damping"] = 0.0
    line = FlexibleCatenaryData.model_validate(values)
    pantograph = pantograph.model_copy(update={"contact_damping": 100.0})
    speed = speed_kmh / 3.6
    system = build(line, line.spans, 1.0)
    assert abs(system.damping).max() == 0
    wires = Newmark(system.mass, system.damping, system.stiffness, step)
    solver = _Contact(system, wires, pantograph, speed)
    chain, mass = solver.chain, np.diag(_chain(pantograph)[0])
    stretched_by = system.dropper_tension, system.dropper_stiffness

    def stored_and_given(x: float, forces: Array) -> tuple[float, float]:
        """Energy (J) and what increases it (W)."""
        stretched, (tension, k) = system.extension @ wires.u, stretched_by
        now = np.maximum(tension + k * stretched, 0.0)
        slack = (now**2 - tension**2) / (2 * k) - tension * stretched - 0.5 * k * stretched**2
        energy = 0.5 * (wires.u @ (system.stiffness @ wires.u) + wires.v @ (system.mass @ wires.v))
        energy += slack.sum() + 0.5 * (chain.u @ chain.stiffness @ chain.u + mass @ chain.v**2)
        power = solver.lift @ chain.v - chain.v @ chain.damping @ chain.v
        for pair in system.hangs_over(x):
            unknowns, values, slopes, height, incline = system.contact_point(x, pair)
            climb = speed * (incline + slopes @ wires.u[unknowns])
            pressed = solver.k * max(chain.u[0] - height - values @ wires.u[unknowns], 0.0)
            damped = forces[pair] - pressed
            if min(pressed, forces[pair]) > 0:
                lost = damped**2 / solver.c
            else:  # all of a force without the spring, and what a spring holds that the head leaves behind
                lost = damped * (chain.v[0] - values @ wires.v[unknowns] - climb)
            energy += 0.5 * pressed**2 / solver.k
            power -= forces[pair] * climb + lost
        return float(energy), float(power)

    forces, *_ = solver.start()
    first, before = stored_and_given(0.0, forces)
    given = error = turnover = 0.0
    slack, all_forces = 0, [forces]
    for n in range(1, int(distance / (speed * step))):
        (forces, *_), tension = solver.advance(speed * step * n)
        energy, now = stored_and_given(speed * step * n, forces)
        given += step * (before + now) / 2
        turnover += step * abs(before + now) / 2
        error = max(error, abs(energy - first - given))
        slack, before = slack + bool((tension <= 0).any()), now
        all_forces.append(forces)
    return Balance(error, turnover, slack, np.array(all_forces))
