"""State of the episodes of all lanes, and the results of a control step, as arrays for kernels."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..backend import aligned_zeros
from ..base.arrays import Array, Index
from ..base.errors import InputError
from ..plant.alignment import AlignmentArrays
from ..plant.plant import Plant
from ..plant.sensors import OdometerArrays
from ..plant.state import HEAD_RANGE, LOSS_TIME, Ending, PerCollector, Place, per_collector
from .entries import AVERAGED, DEVIATIONS, line_values
from .faults import FAULT_ROWS, FaultArrays
from .memory import FrontArrays, MemoryArrays, front_arrays, memory_arrays
from .observation import READINGS, Layout
from .reward import MEAN_TIME
from .settings import RunSettings
from .state import NOW_ROWS, Flag, TaskRow

Flags = NDArray[np.bool_]


class Episode(NamedTuple):
    """State and constants of the episodes.

    Each lane has a row for each of its controlled collectors; these follow each other.
    """

    controlled: PerCollector  # collectors with a row, the same in all lanes
    action: Array  # (rows, actions): requested in this control step
    places: Index  # (actions,): where each entry of an action acts, a ``Place``
    force_limit: float  # force of an action of 1 (N)
    table: Array  # (rows, ACTION + actions + history): rows of ``TaskRow``
    now: Array  # (rows, rows of ``Now``, then places of ``FrontArrays``): of the present control step
    weights: Array  # (terms,): of the reward
    cost_weights: Array  # (terms,): of the cost
    idle: Flags  # (lanes,): lanes that the next call skips
    steps: Index  # (lanes,): control steps per call
    writers: Index  # (entries, 2): writer and number of each entry of the observation
    history: int  # earlier control steps in the observation
    averages: Array  # (rows, readings): slow averages that readings deviate from; no columns where none do
    average_share: float  # weight of a control step in them
    centre: Array  # (entries,): value at which an entry of the observation is 0, in its unit
    slope: Array  # (entries,): change of the centre for each metre per plant step
    per_unit: Array  # (entries,): 1 / scale of the entries
    odometer: OdometerArrays  # for the trains' position and speed readings
    alignment: AlignmentArrays  # of the line
    line_values: Array  # (values,): those in the observation, in the order of ``LINE_ENTRIES``
    time_step: float  # s
    control_steps: int  # plant steps in a control step
    front: FrontArrays
    memory: MemoryArrays
    faults: FaultArrays  # of readings and commands
    mean_share: float  # weight of a control step in the running mean of the force
    washout_share: float  # weight of a control step in the washout's average; 0: there is no washout
    loss_limit: int  # plant steps without contact that end an episode
    head_range: float  # height of the head (m) over or under the line's own that ends an episode


def new_episode(
    settings: RunSettings, plant: Plant, layout: Layout, control_steps: int, odometer: OdometerArrays
) -> Episode:
    """Arrays for the episodes of all lanes of a plant; control_steps: plant steps in a control step."""
    lanes, actuator, controlled = plant.lanes, settings.actuator, plant.train.driven
    actions, rows, speeds = len(actuator.places), lanes * len(controlled), settings.runs.speeds
    if layout.memory and not odometer.sight:
        raise InputError(
            "memory is looked up by the place within the span, which these sensors do not measure; leave it "
            "out, or take other sensors."
        )
    remembered = len(layout.memory) * layout.memory_spans * (1 + actions)
    return Episode(
        controlled=per_collector(controlled, int, len(plant.train.collectors)),
        action=np.zeros((rows, actions)),
        places=np.array(actuator.places, dtype=np.int64),
        force_limit=actuator.force_limit,
        table=aligned_zeros((rows, TaskRow.ACTION + actions + layout.history * (READINGS + actions))),
        now=aligned_zeros((rows, NOW_ROWS + len(layout.front) + remembered)),
        weights=settings.reward.weights,
        cost_weights=settings.cost.weights,
        idle=np.zeros(lanes, dtype=np.bool_),
        steps=np.ones(lanes, dtype=np.int64),
        writers=np.array([(entry.writer, entry.number) for entry in layout.entries]),
        history=layout.history,
        averages=np.zeros((rows, READINGS if layout.kind == DEVIATIONS else 0)),
        average_share=_share(settings.control_interval, AVERAGED),
        centre=layout.centre,
        slope=layout.slope / plant.time_step,
        per_unit=1 / layout.scale,
        odometer=odometer,
        alignment=plant.alignment.arrays,
        line_values=line_values(plant.catenary) if layout.line_values else np.zeros(0),
        time_step=plant.time_step,
        control_steps=control_steps,
        front=front_arrays(layout.front, plant.train, lanes, speeds[0] * plant.time_step * control_steps),
        memory=memory_arrays(layout, plant.alignment, (rows, actions), speeds, settings.control_interval),
        faults=FaultArrays(
            np.zeros((lanes, len(settings.faults), FAULT_ROWS)),
            np.zeros((rows, READINGS + len(Place) if settings.faults else 0)),
        ),
        mean_share=_share(settings.control_interval, MEAN_TIME),
        washout_share=_share(settings.control_interval, settings.washout),
        loss_limit=round(LOSS_TIME / plant.time_step),
        head_range=HEAD_RANGE,
    )


def _share(interval: float, time_constant: float) -> float:
    """Weight of an interval (s) in an average with this time constant (s); 0: there is none."""
    return 1 - math.exp(-interval / time_constant) if time_constant else 0.0


class Results(NamedTuple):
    """Results of a control step, or of the start of an episode, for the rows of all lanes.

    Where one collector is controlled, a row is a lane.
    """

    observation: NDArray[np.float32]  # (rows, entries)
    values: Array  # (rows, RESULT_ROWS): rows of ``Result``
    flags: Flags  # (rows, flags): rows of ``Flag``

    @property
    def terminated(self) -> Flags:
        """(rows,): whether the plant has left its valid range, a view."""
        return self.flags[:, Flag.TERMINATED]

    @property
    def truncated(self) -> Flags:
        """(rows,): whether the end of the run is reached within the valid range, a view."""
        return self.flags[:, Flag.TRUNCATED]

    def copy(self) -> Results:
        """A copy of the arrays."""
        return Results(self.observation.copy(), self.values.copy(), self.flags.copy())


def counts(steps: Any, table: Any) -> Any:
    """Whether the reward of each row's last step counts, (rows,): not at a start, nor in the spans of settle.

    An early end counts in them, too, since it is charged. steps: plant steps done, (rows,); table: as in
    ``Episode``; both arrays, or tensors.
    """
    return (steps > table[:, TaskRow.COUNTED_FROM]) | (table[:, TaskRow.ENDING] > Ending.NONE)
