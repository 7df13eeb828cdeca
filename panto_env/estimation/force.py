"""What an estimator believes of the contact force: linear processes driven by white noise.

A random walk knows nothing of the force but that it does not jump (paper 2, Eq. 7). A shaped process knows
about where in frequency it swings; a periodic one, that it nearly repeats from span to span.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..base.arrays import Array
from ..base.errors import InputError
from ..base.settings import Between, Settings, parse_kind

START_DEVIATION = 100.0
"""How far the contact force may be from the lift when a record begins, rms (N)."""
Intensity = Annotated[float, Between(0.01, 1e5, "N/s^0.5")]
Deviation = Annotated[float, Between(0.01, 1e3, "N")]


class ForceProcess(NamedTuple):
    """k states s with s' = drift s + white noise; the contact force is output s."""

    drift: Array  # (k, k): 1/s
    noise: Array  # (k, k): intensity of the white noise, covariance per second (N^2/s)
    output: Array  # (k,): of states in newtons
    start_covariance: Array  # (k, k): about the lift, which is the mean of the first state (N^2)


class RandomWalk(Settings):
    """A force that wanders: its change over a second is ``intensity`` rms (paper 2, Eq. 7)."""

    kind: Literal["random-walk"] = "random-walk"
    intensity: Intensity = Field(250.0, description="change over a second, rms (N/s^0.5)")

    def process(self, speed: float | None, span: float | None) -> ForceProcess:
        """One state, the force."""
        return _walk(self.intensity)


class Shaped(Settings):
    """A slow random walk and noise coloured by an oscillator at the frequency of passing droppers."""

    kind: Literal["shaped"] = "shaped"
    intensity: Intensity = Field(1.0, description="change of the slow part over a second, rms (N/s^0.5)")
    deviation: Deviation = Field(32.0, description="coloured part, rms (N)")
    wavelength: Annotated[float, Between(0.1, 200, "m")] = Field(
        4.0, description="distance along the line at which the coloured part swings (m)"
    )
    damping: Annotated[float, Between(0.01, 5)] = Field(
        0.95, description="damping ratio of the coloured part, the wider its band"
    )

    def process(self, speed: float | None, span: float | None) -> ForceProcess:
        """Three states: slow part, coloured part, and its rate over its angular frequency."""
        moving = _known(speed, "The shaped force model needs the speed of the train")
        frequency = 2 * np.pi * moving / self.wavelength
        drift = frequency * np.array([[0.0, 1.0], [-1.0, -2 * self.damping]])
        noise = np.diag([0.0, 4 * self.damping * frequency * self.deviation**2])
        covariance = self.deviation**2 * np.eye(2)
        return _sum(_walk(self.intensity), ForceProcess(drift, noise, np.array([1.0, 0.0]), covariance))


class Periodic(Settings):
    """A random walk and one oscillator for each harmonic of span passing, which forgets slowly."""

    kind: Literal["periodic"] = "periodic"
    intensity: Intensity = Field(210.0, description="change of the random part over a second, rms (N/s^0.5)")
    deviation: Deviation = Field(5.0, description="each harmonic, rms (N)")
    memory: Annotated[float, Between(1, 1e4, "m")] = Field(
        500.0, description="distance over which a harmonic stays alike (m)"
    )
    highest: Annotated[float, Between(0.1, 40, "Hz")] = Field(
        20.0, description="frequency of the highest harmonic at most (Hz)"
    )

    def process(self, speed: float | None, span: float | None) -> ForceProcess:
        """One state, then two for each harmonic."""
        moving = _known(speed, "The periodic force model needs the speed of the train")
        passing = moving / _known(span, "The periodic force model needs the length of a span")
        count = int(self.highest / passing)
        if count < 1:
            raise InputError(
                f"Spans pass at {passing:.3g} Hz, above the highest harmonic of {self.highest:g} Hz; "
                "raise 'highest', or take the random-walk force model."
            )
        decay = moving / self.memory
        covariance, turn = self.deviation**2 * np.eye(2), np.array([[0.0, -1.0], [1.0, 0.0]])
        drifts = (
            2 * np.pi * passing * harmonic * turn - decay * np.eye(2) for harmonic in range(1, count + 1)
        )
        facts = 2 * decay * covariance, np.array([1.0, 0.0]), covariance
        return _sum(_walk(self.intensity), *(ForceProcess(drift, *facts) for drift in drifts))


ForceModel = RandomWalk | Shaped | Periodic
FORCE_MODELS: dict[str, type[ForceModel]] = {
    kind.model_fields["kind"].default: kind for kind in (RandomWalk, Shaped, Periodic)
}


def as_force_model(value: Any) -> ForceModel:
    """From a name ("shaped", "shaped:deviation=30"), a table of keys, or itself. InputError if not valid."""
    presets: dict[str, Any] = {name: kind() for name, kind in FORCE_MODELS.items()}
    found: ForceModel = parse_kind(FORCE_MODELS, value, "force_model", presets)
    return found


def _known(value: float | None, need: str) -> float:
    if value is None:
        raise InputError(f"{need}, which is not given; give it, or take the random-walk force model.")
    return value


def _walk(intensity: float) -> ForceProcess:
    one = np.ones((1, 1))
    return ForceProcess(0.0 * one, intensity**2 * one, np.ones(1), START_DEVIATION**2 * one)


def _sum(*parts: ForceProcess) -> ForceProcess:
    """Independent processes, whose outputs add up to the force."""
    from scipy.linalg import block_diag  # slow to import, and settings are read before

    drift, noise, covariance = (
        block_diag(*(getattr(part, name) for part in parts))
        for name in ("drift", "noise", "start_covariance")
    )
    return ForceProcess(drift, noise, np.concatenate([part.output for part in parts]), covariance)
