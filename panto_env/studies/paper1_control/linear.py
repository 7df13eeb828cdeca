"""What feedback does to the contact force at each frequency: pantograph and wire, linear, no droppers."""

from __future__ import annotations

import math

import numpy as np

from ...catalog import load_catenary, load_pantograph
from ...plant.catenary.flexible.schema import FlexibleCatenaryData
from ...plant.pantograph.build import matrices
from .cases import LINE, PANTOGRAPH


def amplification(frequency: float, gain: float, damping: float = 0.0) -> float:
    """Contact force under feedback over that without, where the wire moves at ``frequency`` (Hz).

    gain: of force feedback (N/N); damping: of the frame's velocity (N s/m), both on the frame and at
    once. The contact wire is an endless string, which yields as a damper of 2 sqrt(T m).
    """
    return abs(_force(frequency, gain, damping) / _force(frequency, 0.0, 0.0))


def _force(frequency: float, gain: float, damping: float) -> complex:
    """Contact force (N) per metre that the wire would move by without the pantograph."""
    line, pantograph = load_catenary(LINE), load_pantograph(PANTOGRAPH)
    if not isinstance(line, FlexibleCatenaryData) or pantograph.contact_stiffness == "rigid":
        raise TypeError("the linear model needs a contact wire and an elastic contact")
    s = 2j * math.pi * frequency
    a, b = matrices(pantograph)
    response = np.linalg.solve(s * np.eye(len(a)) - a, b)  # of the state to contact and frame force
    head, frame = response[0], response[len(pantograph.masses) - 1]
    control = -(gain + damping * s * frame[0]) / (1 + damping * s * frame[1])  # N per N of contact force
    contact = pantograph.contact_stiffness + pantograph.contact_damping * s
    wire = 1 / (2 * math.sqrt(line.contact_wire.tension * line.contact_wire.mass) * s)
    return complex(contact / (1 - contact * (head[0] + head[1] * control) + contact * wire))
