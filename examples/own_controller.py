"""A controller of your own, judged by the benchmark beside passive and pd.

It feeds back the frame's velocity and the contact force's deviation from its slow mean, so that it damps
without raising the mean force. The benchmark compares sigma with a passive pantograph at the same mean
force; a policy that moves the mean by more than 1.5 %, as pd does, is shown but not ranked.

    python examples/own_controller.py

printed

    passive: sigma +0.0 %, mean force +0.00 %, rank 2
    pd: sigma -11.1 %, mean force +5.09 %, not ranked: it moves the mean force by +5.1 %, more than 1.5 %
    (a policy's attribute washout = 1.0 keeps the mean)
    Damper: sigma -8.4 %, mean force +0.08 %, rank 1

`panto benchmark examples/own_controller.py:Damper pd --speed 300 --seeds 2` takes it as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from panto_baselines.benchmark.run import Benchmark, run
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_env.control import Context


class Damper:
    """Damping of the frame, and feedback on how the contact force deviates from its own slow mean."""

    def __init__(self, gain: float = 0.5, damping: float = 100.0, seconds: float = 2.0) -> None:
        """gain: N/N. damping: N s/m. seconds: time constant of the slow mean."""
        self.gain, self.damping, self.seconds = gain, damping, seconds

    def reset(self, context: Context) -> None:
        """Prepare for an episode. The context holds the observation's entries and the actuator's limit."""
        self.context, self.mean = context, context.nominal_force

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Action, (1,), as a share of the actuator's limit, from an observation, (entries,)."""
        read = self.context.layout.read
        force, velocity = read(observation, "contact force"), read(observation, "frame velocity")
        self.mean += self.context.control_interval / self.seconds * (force - self.mean)
        command = self.gain * (self.mean - force) - self.damping * velocity  # N
        return np.array([command / self.context.force_limit])


def judge() -> Benchmark:
    """The benchmark's outcome on two lines that differ by seed, with a real actuator and real sensors."""
    line = Line(catenary="en50318-2002", pantograph="en50318-2002", speeds_kmh=(300.0,))
    settings = BenchmarkSettings(
        policies=("passive", "pd", f"{__file__}:Damper"),
        lines=(line,),
        seeds=(0, 1),
        actuator="realistic",
        sensors="realistic",
    )
    return run(settings, workers=1)


def main() -> None:
    """Print each policy's change of sigma."""
    for cell in judge().cells:
        name = cell.policy.rpartition(":")[2]
        why = cell.disqualified.replace(" (", "\n(")
        ranked = f"not ranked: {why}" if why else f"rank {cell.rank}"
        print(f"{name}: sigma {cell.change:+.1f} %, mean force {cell.mean_change:+.2f} %, {ranked}")


if __name__ == "__main__":
    main()
