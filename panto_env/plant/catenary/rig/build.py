"""A hardware-in-the-loop rig: its data, and the constants of the computed line, cylinder and load cell."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from ....base.arrays import Array
from ....base.errors import InputError
from ....base.settings import Between, Settings
from ...alignment import Alignment
from ...line_condition import DrawnLine
from ...numerics import Numerics, Runs
from ...pantograph.schema import exponential
from ..flexible import KIND as FLEXIBLE
from ..flexible import FlexibleCatenaryData
from ..protocol import CatenaryModel, LineView, StartPoint
from ..schema import CatenaryData
from ..three_span import KIND as THREE_SPAN
from ..three_span import ThreeSpanData
from .step import TERMS, FitRow, RigLine, RigRow, RigWire


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


LINES = {"flexible": FLEXIBLE, "three_span": THREE_SPAN}
STEPS = 4  # minimum number of time steps between two samples, for the load cell's filter and the cylinder
NOISE_SAMPLES = 1 << 16
ORDER = 3  # order of the polynomial of "prediction", as in Horiuchi et al
FIT_FREQUENCY, FIT_MEMORY = 25.0, 1.0
"""For "adaptive": corner (Hz) of the low-pass of both signals, and time (s) after which a sample has the
weight exp(-1)."""
FIT_AMPLITUDE, FIT_OMEGA = 5e-3, 2 * np.pi * 10
"""Usual amplitude and angular frequency of the contact point, which scale its terms (m, rad/s)."""
FIT_DOUBT, FIT_ERROR = 0.1, 2e-5
"""Initial relative uncertainty of a coefficient, and rms error of a fitted command (m)."""
FIT_BOUNDS = ((0.9, 0.4, 0.2), (1.1, 2.5, 5.0))
"""Minimum and maximum coefficients, relative to the assumed ones."""


class Rig(CatenaryModel):
    """A pantograph on a cylinder that follows a line's computed contact point.

    The cylinder does not respond to the force within a step, so an explicit contact law is stable.
    """

    def __init__(
        self, data: RigData, *, lanes: int, collectors: int, spans: int, numerics: Numerics, runs: Runs
    ) -> None:
        """Build the computed line, and the rig around it.

        Raises InputError where the line cannot be computed with these numerics, and for conditions with
        irregularity, which the cylinder does not follow, or with wind.
        """
        if any(condition.waves for condition in runs.conditions):
            raise InputError(
                f"The cylinder of rig '{data.name}' follows the motion that is computed for an even contact "
                "wire; use a line_condition without irregularity and wear, such as 'new'."
            )
        if data.tunnels or any(condition.wind or condition.side_wind for condition in runs.conditions):
            raise InputError(
                "No wind blows on a rig, nor is it in a tunnel; leave out both, or use another line than "
                f"'{data.name}'."
            )
        one_wire = f"The cylinder of rig '{data.name}' follows one contact wire, and its line has"
        if data.line.wires_touched > 1:
            raise InputError(f"{one_wire} two side by side; take one equivalent wire of both.")
        if getattr(data.line, "overlaps", ()):
            raise InputError(f"{one_wire} overlaps of two; take a line without them.")
        computer = data.computer
        if abs(runs.whole_part(computer.interval) - computer.interval) > 1e-9:
            raise InputError(
                f"The control interval of {1e3 * runs.control_interval:g} ms must be a whole number of the "
                f"rig's sampling intervals of {1e3 * computer.interval:g} ms."
            )
        own_runs = runs._replace(control_interval=computer.interval)
        if numerics.time_step is None and data.line.kind == "three_span":
            numerics = numerics.model_copy(update={"time_step": computer.interval / STEPS})
        model: CatenaryModel = LINES[data.line.kind].model(
            data.line, lanes=lanes, collectors=collectors, spans=spans, numerics=numerics, runs=own_runs
        )
        self.model = model
        self.time_step, self.grid, self.wave_speed = model.time_step, model.grid, model.wave_speed
        self.supports, self.droppers = model.supports, model.droppers
        ahead = runs.speeds[1] * (computer.interval + self.time_step)  # the computer's lead
        self.length = model.length - ahead
        self.usual_end = min(model.usual_end, self.length)
        self.line = constants(data, model.line, self.time_step)
        self.wire = at_rest(data, model.wire, lanes, self.time_step)
        start = model.start_point
        yielding = start.spring_compliance + self.line.yield_per_newton
        self.start_point = StartPoint(start.height, start.wire_compliance, yielding)
        self._assumed = assumed(data)

    def settle(self, lane: int, drawn: DrawnLine, force: float) -> None:
        """Put the computed line at rest under a force (N), and the cylinder where its contact point is."""
        self.model.settle(lane, drawn, force)
        start, wire = self.model.start_point, self.wire
        for each in (wire.table, wire.late, wire.past, wire.fit, wire.fit_past, wire.covariance):
            each[lane] = 0.0
        wire.table[lane, RigRow.DATUM] = (
            start.height + (start.wire_compliance + start.spring_compliance) * force
        )
        wire.table[lane, [RigRow.FORCE, RigRow.FILTERED, RigRow.READING]] = force
        wire.coefficients[lane] = self._assumed
        wire.covariance[lane] = np.diag((FIT_DOUBT * FIT_AMPLITUDE / FIT_ERROR * np.ones(TERMS)) ** 2)

    def rest_tension(self, lane: int) -> Array:
        """Tension (N), (droppers,), of the computed line's droppers at rest."""
        return self.model.rest_tension(lane)

    def view(self, lane: int, begin: float, end: float) -> LineView:
        """Present shape of the computed line."""
        return self.model.view(lane, begin, end)


def constants(data: RigData, line: Any, time_step: float) -> RigLine:
    """Constants of a rig with a computed line; time_step: of both (s)."""
    cylinder, cell, computer = data.cylinder, data.load_cell, data.computer
    omega = 2 * np.pi * cylinder.natural_frequency
    corner, ratio = 2 * np.pi * cell.filter_frequency, math.sqrt(0.5)
    random = np.random.default_rng(computer.seed)
    noise = random.standard_normal((NOISE_SAMPLES, 2)) * [cell.noise, cylinder.displacement_noise]
    whole = math.floor(computer.delay / time_step + 1e-9)
    known = assumed(data)
    memory = math.exp(-computer.interval / FIT_MEMORY)
    return RigLine(
        line=line,
        cylinder=second_order(omega, cylinder.damping_ratio, time_step),
        cylinder_half=second_order(omega, cylinder.damping_ratio, time_step / 2),
        largest_move=cylinder.speed_limit * time_step,
        largest_height=cylinder.stroke / 2,
        yield_per_newton=1 / cylinder.stiffness,
        time_step=time_step,
        cell_filter=second_order(corner, ratio, time_step),
        cell_mass=cell.mass,
        cell_mass_known=cell.compensated_mass,
        force_range=cell.force_range,
        force_unit=2 * cell.force_range / 2**computer.input_bits,
        height_unit=cylinder.stroke / 2**computer.output_bits,
        noise=noise,
        interval_steps=round(computer.interval / time_step),
        force_age=force_age(data) / time_step,
        late_share=max(computer.delay / time_step - whole, 0.0),
        bank=bank(data),
        lead=lead(data),
        fit_filter=second_order(2 * np.pi * FIT_FREQUENCY, ratio, computer.interval),
        fit_scale=FIT_AMPLITUDE * FIT_OMEGA ** np.arange(TERMS),
        fit_bounds=np.array(FIT_BOUNDS) * known,
        fit_doubt=TERMS * (FIT_DOUBT * FIT_AMPLITUDE / FIT_ERROR) ** 2,
        fit_memory=memory if computer.compensation == "adaptive" else 0.0,
    )


def second_order(omega: float, ratio: float, time_step: float) -> Array:
    """Exact step, (2, 3), of y'' + 2 ratio omega y' + omega^2 y = omega^2 u for a constant input u."""
    system = np.zeros((3, 3))
    system[0, 1], system[1] = 1.0, (-(omega**2), -2 * ratio * omega, omega**2)
    return exponential(system * time_step)[:2].copy()


def force_age(data: RigData) -> float:
    """Delay of a sample of the force (s): by its filter, and by half an interval, since it is held."""
    return math.sqrt(2) / (2 * np.pi * data.load_cell.filter_frequency) + data.computer.interval / 2


def outer_lead(data: RigData) -> float:
    """Required lead (s) without the cylinder's: the line is computed an interval ahead, but under a force
    that is late.
    """
    return force_age(data) - data.computer.interval


def assumed(data: RigData) -> Array:
    """Coefficients, (terms,), by which a command is formed from height, velocity (s), acceleration (s^2).

    The inverse of the assumed transfer function and of its delay, to second order in frequency.
    """
    computer, cylinder = data.computer, data.cylinder
    omega = 2 * np.pi * (computer.assumed_frequency or cylinder.natural_frequency)
    ratio = cylinder.damping_ratio if computer.assumed_damping is None else computer.assumed_damping
    delay = computer.delay if computer.assumed_delay is None else computer.assumed_delay
    delay += computer.interval / 2  # of the output, which is held
    return np.array([1.0, 2 * ratio / omega + delay, 1 / omega**2 + 2 * ratio / omega * delay + delay**2 / 2])


def lead(data: RigData) -> Array:
    """Coefficients of a command from those of the cylinder, (terms used, terms)."""
    if data.computer.compensation in ("none", "prediction"):
        return np.array([[1.0, 0.0, 0.0]])
    more = outer_lead(data)
    return np.array([[1.0, 0.0, 0.0], [more, 1.0, 0.0], [more**2 / 2, more, 1.0]])


def bank(data: RigData) -> Array:
    """Each term of a command from the past heights of the contact point, an interval apart, (terms, past)."""
    computer, h = data.computer, data.computer.interval
    if computer.compensation in ("inverse", "adaptive"):
        return np.array([[1, 0, 0, 0], np.array([3, -4, 1, 0]) / (2 * h), np.array([2, -5, 4, -1]) / h**2])
    if computer.compensation == "none":
        return np.eye(TERMS, 1)
    total_lead = assumed(data)[1] + outer_lead(data)
    apart = max(1, round(total_lead / h))
    weights = np.zeros((TERMS, ORDER * apart + 1))
    nodes, at = -np.arange(ORDER + 1.0), total_lead / (apart * h)
    for k in range(ORDER + 1):
        others = np.delete(nodes, k)
        weights[0, k * apart] = np.prod((at - others) / (nodes[k] - others))
    return weights


def at_rest(data: RigData, wire: Any, lanes: int, time_step: float) -> RigWire:
    """State of the rig in all lanes, at rest."""
    whole, past = math.floor(data.computer.delay / time_step + 1e-9), bank(data).shape[1]
    of_a_lane = {
        "table": (len(RigRow),),
        "late": (whole + 2,),
        "past": (past,),
        "coefficients": (TERMS,),
        "fit": (len(FitRow),),
        "fit_past": (past,),
        "covariance": (TERMS, TERMS),
        "scratch": (2, TERMS),
    }
    return RigWire(wire, **{name: np.zeros((lanes, *shape)) for name, shape in of_a_lane.items()})
