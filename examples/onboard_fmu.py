"""A pantograph here, its controller in a unit of FMI 3.0: agent-any-line as a vehicle's model would run it.

Each control step the unit gets what the sensors read, in physical units, does a step of its interval, and
gives the actuator's force. It is made from the agent's C, by a C compiler; `pip install fmpy` runs it.

    python examples/onboard_fmu.py

printed

    passive: sigma 27.8 N, mean 156.7 N
    agent-any-line in a unit: sigma 12.7 N, mean 157.1 N
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray

from panto_agents.onboard import exported, write_fmu
from panto_env import simulate
from panto_env.control import Context

SPEED_KMH, SECONDS = 300.0, 10.0
TRAIN: dict[str, Any] = {
    "catenary": "re330",
    "pantograph": "dsa380",
    "actuator": "realistic",
    "sensors": "realistic",
}
"""What the controller's constants are for."""
PASS = TRAIN | {
    "speed_kmh": SPEED_KMH,
    "distance": SPEED_KMH / 3.6 * SECONDS,
    "line_condition": "as-built",
}


class InUnit:
    """A policy that asks a unit for its force."""

    observation = "measured"

    def __init__(self, path: Path, folder: str) -> None:
        """path: of the unit. folder: to unpack it into."""
        description = fmpy.read_model_description(path)
        self.references = {each.name: each.valueReference for each in description.modelVariables}
        self.outputs = [
            each.valueReference for each in description.modelVariables if each.causality == "output"
        ]
        self.unit = FMU3Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(path, unzipdir=folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="controller",
        )
        self.unit.instantiate()

    def reset(self, context: Context) -> None:
        """Begin a pass."""
        self.context, self.steps, self.place = context, 0, 0.0
        self.unit.reset()
        self.unit.enterInitializationMode(startTime=0.0)
        self.unit.exitInitializationMode()

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (1,), as a share of the actuator's limit, from an observation, (entries,)."""
        readings = self.readings(observation)
        self.unit.setFloat64([self.references[name] for name in readings], list(readings.values()))
        interval = self.context.control_interval
        self.unit.doStep(self.steps * interval, interval)
        self.steps += 1
        return np.array(self.unit.getFloat64(self.outputs)) / self.context.force_limit

    def readings(self, observation: NDArray[np.float32]) -> dict[str, float]:
        """The unit's inputs, in their units; the spans that the train has passed are counted here."""
        names = ("head displacement", "frame displacement", "head velocity", "frame velocity")
        read = self.context.layout.read
        found = {
            name.replace(" ", "_"): read(observation, name) for name in (*names, "contact force", "speed")
        }
        sine, cosine = (read(observation, f"{each} of span position") for each in ("sine", "cosine"))
        share = math.atan2(sine, cosine) / (2 * math.pi)
        self.place += (share - self.place + 0.5) % 1.0 - 0.5
        return found | {"place": self.place}


def main() -> None:
    """Print the contact force's standard deviation without control, and with the unit."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "controller.fmu"
        write_fmu(exported("agent-any-line", **TRAIN), path)
        policies = {"passive": "passive", "agent-any-line in a unit": InUnit(path, folder)}
        for name, policy in policies.items():
            figures = simulate(**PASS, policy=policy).summary()
            print(f"{name}: sigma {figures.std:.1f} N, mean {figures.mean:.1f} N")


if __name__ == "__main__":
    main()
