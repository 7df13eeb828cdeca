"""The estimator among a train's sensors: its force stands where a measured one would, lane by lane.

A steady Kalman filter runs in the kernel every millisecond or so. Its samples have noise of their own, as
the sensors' settings have it; what it estimates is then read with the sensors' delay, like any other reading.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..backend import NOT_NEGATIVE, aligned_zeros, implements, inlined
from ..base.arrays import Array, Index, Lanes
from ..plant.pantograph.schema import PantographData, matrices
from ..plant.sensors import Reading, SensorSettings, take_first_readings, take_readings
from ..plant.sensors.base import AHEAD
from ..plant.state import ROW, Row
from .kalman import steady_gain
from .model import EstimatorSettings, build_model

LONGEST_INTERVAL = 1.25e-3
"""Between two samples of the filter (s)."""
SENSED = (int(Row.HEAD_HEIGHT), int(Row.FRAME_HEIGHT), int(Row.HEAD_VELOCITY), int(Row.FRAME_VELOCITY))
"""Rows of a sample that the filter takes, in the order of its model; the last two where it has velocities."""
READINGS = len(Reading)


class EstimatingArrays(NamedTuple):
    """Sensors of all lanes with a filter of N states and m samples at a time.

    Rows of the table: the state before the next sample, that sample, the last estimate (N), and room for the
    next state.
    """

    sensors: Any  # that read all but the contact force
    table: Array  # (collectors, lanes, 2 N + m + 1)
    # (lanes, collectors, times, readings + m samples): of readings, then of the samples of a control step
    noise: Array
    noise_used: Index  # (lanes,): how many of them have been used
    every: int  # plant steps between two samples
    kept: Array  # (N, N): next state from this one
    driven: Array  # (N, m): and from a sample
    pushed: Array  # (N, 2): and from known forces on the frame, and between head and frame (N)
    force_of_state: Array  # (N,): estimate from the state before a sample
    force_of_sample: Array  # (m,): and from the sample
    shape: Array  # (masses, 2): displacements at rest from those of head and frame

    def reset(self, lanes: Lanes, samples: Array) -> None:
        """Let lanes have been at rest as in these samples, (collectors, lanes, SAMPLE_ROWS)."""
        self.sensors.reset(lanes, samples)
        masses, (size, measured) = len(self.shape), self.driven.shape
        rows = np.zeros((*samples.shape[:2], self.table.shape[2]))
        rows[..., :masses] = samples[..., [Row.HEAD_HEIGHT, Row.FRAME_HEIGHT]] @ self.shape.T
        rows[..., [2 * masses, size + measured]] = samples[..., [Row.CONTACT_FORCE]]
        self.table[:, lanes] = rows


def estimating(
    sensors: SensorSettings,
    estimator: EstimatorSettings,
    pantograph: PantographData,
    speed: float,
    span: float,
    time_step: float,
    control_steps: int,
    lanes: int,
    collectors: int,
) -> tuple[Any, tuple[float, ...] | None]:
    """Sensors with an estimator of the contact force, and the rms of each number of their noise, if any.

    pantograph: that the estimator knows. speed (m/s), span (m): for force models that need them;
    time_step: of the plant (s). Raises InputError where the filter has no steady gain.
    """
    divisors = [n for n in range(1, control_steps + 1) if control_steps % n == 0]
    every = max(n for n in divisors if n == 1 or n * time_step <= LONGEST_INTERVAL)
    process = estimator.force_model.process(speed, span)
    model = build_model(pantograph, process, estimator, every * time_step)
    gain = steady_gain(*model.linear)
    size, measured = len(model.transition), len(model.observed)
    corrected = np.eye(size) - gain @ model.observed
    rms = sensors.noise_rms
    if rms is not None:
        displacement, velocity = rms[Reading.HEAD_HEIGHT], rms[Reading.HEAD_VELOCITY]
        samples = (displacement, displacement, velocity, velocity)[:measured] * (control_steps // every)
        rms = (*rms[: Reading.CONTACT_FORCE], 0.0, *samples)
    arrays = EstimatingArrays(
        sensors=sensors.arrays(time_step, control_steps, lanes, collectors),
        table=aligned_zeros((collectors, lanes, 2 * size + measured + 1)),
        noise=np.zeros((lanes, collectors, AHEAD if rms else 0, len(rms or ()))),
        noise_used=np.zeros(lanes, dtype=np.int64),
        every=every,
        kept=np.ascontiguousarray(model.transition @ corrected),
        driven=np.ascontiguousarray(model.transition @ gain),
        pushed=np.ascontiguousarray(model.inputs),
        force_of_state=np.ascontiguousarray(model.force @ corrected),
        force_of_sample=np.ascontiguousarray(model.force @ gain),
        shape=_rest_shape(pantograph),
    )
    return arrays, rms


def _rest_shape(pantograph: PantographData) -> Array:
    """Displacements of a chain at rest, (masses, 2), for one of the head and one of the frame."""
    masses = len(pantograph.masses)
    stiffness = -np.array(pantograph.masses)[:, None] * matrices(pantograph)[0][masses:, :masses]
    ends, inner = [0, masses - 1], list(range(1, masses - 1))
    shape = np.zeros((masses, 2))
    shape[0, 0] = shape[-1, 1] = 1.0
    if inner:
        shape[inner] = -np.linalg.solve(stiffness[np.ix_(inner, inner)], stiffness[np.ix_(inner, ends)])
    return shape


@inlined
def take_sample(sensors, collector, step, own, sample, lane):
    """Write a lane's sample, with noise, into its rows."""
    count = sensors.driven.shape[1]
    first = READINGS + count * (step // sensors.every - 1)
    for c in range(count):
        sample[c] = own[SENSED[c]]
        if sensors.noise.shape[2] > 0:
            time = min(sensors.noise_used[lane], sensors.noise.shape[2] - 1) & NOT_NEGATIVE
            sample[c] += sensors.noise[lane, collector, time, first + c]


@inlined
def filter_sample(sensors, own, rows):
    """Estimate a lane's contact force from a sample, and move the filter's state on to the next."""
    size, count = sensors.kept.shape[0], sensors.driven.shape[1]
    sample, after = rows[size:], rows[size + count + 1 :]
    on_frame, on_head = own[ROW.LIFT] + own[ROW.BY_HEIGHT] + own[ROW.FRAME_FORCE], own[ROW.HEAD_FORCE]
    force = 0.0
    for j in range(size):
        force += sensors.force_of_state[j] * rows[j]
    for c in range(count):
        force += sensors.force_of_sample[c] * sample[c]
    sample[count] = force
    for k in range(size):
        total = sensors.pushed[k, 0] * on_frame + sensors.pushed[k, 1] * on_head
        for j in range(size):
            total += sensors.kept[k, j] * rows[j]
        for c in range(count):
            total += sensors.driven[k, c] * sample[c]
        after[k] = total
    for k in range(size):
        rows[k] = after[k]


@implements(take_readings, EstimatingArrays)
def _take_readings(sensors, collector, step, own, readings, lane):
    size, count = sensors.kept.shape[0], sensors.driven.shape[1]
    rows = sensors.table[collector, lane]
    if step % sensors.every == 0:
        take_sample(sensors, collector, step, own, rows[size:], lane)
        filter_sample(sensors, own, rows)
    true = own[ROW.CONTACT_FORCE]
    own[ROW.CONTACT_FORCE] = rows[size + count]
    take_readings(sensors.sensors, collector, step, own, readings, lane)
    own[ROW.CONTACT_FORCE] = true


@implements(take_first_readings, EstimatingArrays)
def _take_first_readings(sensors, collector, own, readings, lane):
    take_first_readings(sensors.sensors, collector, own, readings, lane)
