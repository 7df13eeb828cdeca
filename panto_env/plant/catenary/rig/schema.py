"""Data of a hardware-in-the-loop rig."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ....base.settings import Between, Settings
from ...alignment import Alignment
from ..flexible import FlexibleCatenaryData
from ..schema import CatenaryData
from ..three_span import ThreeSpanData


class Cylinder(Settings):
    """Hydraulic cylinder under displacement control: a second-order transfer function, and limits."""

    natural_frequency: Annotated[float, Between(2, 1000, "Hz")] = Field(
        60.0, description="natural frequency of the closed loop of displacement (Hz)"
    )
    damping_ratio: Annotated[float, Between(0.05, 5)] = Field(
        0.7, description="damping ratio of the closed loop (-)"
    )
    speed_limit: Annotated[float, Between(0.01, 20, "m/s")] = Field(
        1.0, description="speed at which the servo valve is fully open (m/s)"
    )
    stroke: Annotated[float, Between(0.01, 2, "m")] = Field(
        0.4, description="distance from end to end, its middle at the wire's height at rest (m)"
    )
    stiffness: Annotated[float, Between(1e4, 5e8, "N/m")] = Field(
        2e7, description="stiffness of oil and rod (N/m)"
    )
    displacement_noise: Annotated[float, Between(0, 0.01, "m")] = Field(
        5e-6, description="rms noise of the measured displacement (m)"
    )


class LoadCell(Settings):
    """The load cell between cylinder and collectors."""

    force_range: Annotated[float, Between(10, 1e5, "N")] = Field(
        1000.0, description="maximum force in either direction, beyond which the rig stops (N)"
    )
    noise: Annotated[float, Between(0, 100, "N")] = Field(0.5, description="rms noise of a sample (N)")
    filter_frequency: Annotated[float, Between(5, 1e5, "Hz")] = Field(
        300.0, description="corner of the second-order Butterworth filter before the converter (Hz)"
    )
    mass: Annotated[float, Between(0, 50, "kg")] = Field(
        1.5, description="moving mass between load cell and strip, whose inertia falsifies the force (kg)"
    )
    compensated_mass: Annotated[float, Between(0, 50, "kg")] = Field(
        1.5, description="mass whose inertia is compensated with an accelerometer (kg)"
    )


class Computer(Settings):
    """What computes the line in real time, and its converters."""

    interval: Annotated[float, Between(1e-4, 0.02, "s")] = Field(
        1e-3, description="time between two samples of the force (s)"
    )
    delay: Annotated[float, Between(0, 0.1, "s")] = Field(
        1e-3, description="time from a sample of the force to the resulting command (s)"
    )
    input_bits: Annotated[int, Between(4, 32)] = Field(
        16, description="bits of the force's converter, over the load cell's range"
    )
    output_bits: Annotated[int, Between(4, 32)] = Field(
        16, description="bits of the command's converter, over the cylinder's stroke"
    )
    compensation: Literal["none", "prediction", "inverse", "adaptive"] = Field(
        "inverse",
        description='compensation of delay and lag: "none"; "prediction": a polynomial through past '
        'displacements, extrapolated (Horiuchi et al. 1999); "inverse": the inverse of the cylinder\'s '
        'transfer function; "adaptive": the inverse, fitted during the run (Chae et al. 2013)',
    )
    assumed_frequency: Annotated[float, Between(2, 1000, "Hz")] | None = Field(
        None, description="natural frequency that is compensated for (Hz), by default the cylinder's own"
    )
    assumed_damping: Annotated[float, Between(0.05, 5)] | None = Field(
        None, description="damping ratio that is compensated for (-), by default the cylinder's own"
    )
    assumed_delay: Annotated[float, Between(0, 0.1, "s")] | None = Field(
        None, description="computer's delay that is compensated for (s), by default its own"
    )
    seed: Annotated[int, Between(0, 1_000_000)] = Field(
        0, description="seed of the noise of load cell and displacement, which is the same in each run"
    )


class RigData(CatenaryData):
    """A pantograph on a hydraulic cylinder that follows a line's computed contact point (paper 2, section 2).

    The data that lines of every kind have are those of ``line``.
    """

    kind: Literal["rig"] = "rig"
    line: Annotated[FlexibleCatenaryData | ThreeSpanData, Field(discriminator="kind")]
    cylinder: Cylinder = Cylinder()
    load_cell: LoadCell = LoadCell()
    computer: Computer = Computer()

    @model_validator(mode="before")
    @classmethod
    def _as_its_line(cls, values: Any) -> Any:
        """Take the data that lines of every kind have from ``line``."""
        if not isinstance(values, dict):
            return values
        line = values.get("line")
        known = line.model_dump() if isinstance(line, CatenaryData) else line
        if not isinstance(known, dict):
            return values
        names = [name for name in CatenaryData.model_fields if name not in ("kind", "name", "description")]
        return {name: known[name] for name in names if name in known} | values

    def source_of(self, name: str) -> str:
        """Source of a value that lines of every kind have, by default that of ``line``."""
        return self.sources.get(name) or self.line.source_of(name)

    @property
    def contact_heights(self) -> tuple[float, ...]:
        """Heights of the computed line at its supports."""
        return self.line.contact_heights

    def alignment(self, spans: int | None = None) -> Alignment:
        """Where supports and spans of the computed line lie."""
        return self.line.alignment(spans)
