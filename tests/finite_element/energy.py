"""Energy over a run of the finite elements: what lift and train give is what is stored and lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData

from .contacts import Collector, Contacts
from .hermite import Array
from .newmark import Newmark
from .simulation import Motion
from .system import build


@dataclass(frozen=True)
class Balance:
    """Of a run."""

    error: float  # largest difference of what was given from what is stored and lost (J)
    turnover: float  # integral of the magnitude of the power (J)
    steps_with_slack: int  # number of steps in which a dropper was slack
    wire_forces: Array  # on each pair's contact wire, (n_steps, n_collectors, n_pairs) (N)


def balance(
    line: FlexibleCatenaryData,
    collectors: Sequence[Collector],
    speed_kmh: float,
    distance: float,
    step: float = 5e-4,
    motion: Motion | None = None,
) -> Balance:
    """A run of ``distance`` (m) on a line without damping, under heads with some; all lose none elsewhere.

    Lift and train (F v y') give what is in wires, droppers (also slack), masses, contacts and dampers.
    motion: of a train whose speed changes, instead of ``speed_kmh``.
    """
    values = line.model_dump(exclude_none=True)
    values["damping"] = {"alpha": 0.0, "beta": 0.0}
    values["support"]["damping"] = 0.0
    line = FlexibleCatenaryData.model_validate(values)
    collectors = [
        replace(own, pantograph=own.pantograph.model_copy(update={"contact_damping": 100.0}))
        for own in collectors
    ]
    speed = speed_kmh / 3.6
    motion = motion or Motion(np.array([0.0]), np.array([speed]))
    _, places, speeds = motion.until(distance, step)
    system = build(line, line.spans, 1.0)
    assert abs(system.damping).max() == 0
    wires = Newmark(system.mass, system.damping, system.stiffness, step)
    solver = Contacts(system, wires, collectors, speed)

    def stored_and_given(x: float, forces: Array) -> tuple[float, float]:
        """Energy (J) and what increases it (W)."""
        energy, power = _of_wires(solver), 0.0
        for chain in solver.chains:
            energy += 0.5 * (chain.u @ chain.stiffness @ chain.u + chain.v @ chain.mass @ chain.v)
            power += chain.load @ chain.v - chain.v @ chain.damping @ chain.v
        for touch in solver.touches(x):
            chain, force = solver.chains[touch.collector], forces[touch.collector, touch.pair]
            height, velocity, climb = touch.wire(wires)
            pressed = chain.strip * max(chain.u[0] - height, 0.0)
            damped = force - pressed
            if min(pressed, force) > 0:
                lost = damped**2 / chain.strip_damping
            else:  # all of a force without the spring, and what a spring holds that the head leaves behind
                lost = damped * (chain.v[0] - velocity - climb)
            energy += 0.5 * pressed**2 / chain.strip
            power -= force * climb + lost
        return float(energy), float(power)

    forces = solver.start().forces
    first, before = stored_and_given(0.0, forces)
    given = error = turnover = 0.0
    slack, all_forces = 0, [forces]
    for x, speed in zip(places[1:].tolist(), speeds[1:].tolist(), strict=True):
        solver.set_speed(speed)
        forces, *_, tension = solver.advance(x)
        energy, now = stored_and_given(x, forces)
        given += step * (before + now) / 2
        turnover += step * abs(before + now) / 2
        error = max(error, abs(energy - first - given))
        slack, before = slack + bool((tension <= 0).any()), now
        all_forces.append(forces)
    return Balance(error, turnover, slack, np.array(all_forces))


def _of_wires(solver: Contacts) -> float:
    """In wires and droppers, of which slack ones hold what they were stretched by at rest (J)."""
    system, wires = solver.system, solver.wires
    stretched, tension, k = system.extension @ wires.u, system.dropper_tension, system.dropper_stiffness
    now = np.maximum(tension + k * stretched, 0.0)
    slack = (now**2 - tension**2) / (2 * k) - tension * stretched - 0.5 * k * stretched**2
    linear = wires.u @ (system.stiffness @ wires.u) + wires.v @ (system.mass @ wires.v)
    return float(0.5 * linear + slack.sum())
