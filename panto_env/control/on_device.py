"""Lanes as tensors on a device of PyTorch: the task's arrays there, stepped by the same source.

Episodes begin from starts that the processor draws and runs in: a lane that begins copies one of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import torch

from ..backend import LaneThreads, bind, inlined, open_packed, pack
from ..backend.cuda import TILE, Columns, map_arrays
from ..base.arrays import Array
from ..plant.state import Row
from .episode import Flags, Results, counts
from .observation import Context
from .settings import RunSettings
from .step import control_lane, control_steps
from .task import Task


class Begun(NamedTuple):
    """What is told of each lane's episode: the speed of its train (m/s), (lanes,)."""

    speed: Array


RUN, SENSORS, EPISODE, RUNNING, RESULTS, BEGUN = 4, 5, 7, 8, 9, 10
"""Numbers of named tuples among those of ``arrays_of``."""


@inlined
def control_unless_idle(packed, results, lane):
    """Make a control step in one lane, and write its results; nothing where it is idle."""
    _, _, _, _, _, _, _, episode, _ = open_packed(packed)
    if not episode.idle[lane]:
        control_lane(packed, results.observation, results.values, results.flags, lane)


class TensorLanes:
    """Lanes of one line as tensors on one device, each in an episode from one of a number of starts."""

    def __init__(self, settings: RunSettings, lanes: int, starts: int, device: torch.device) -> None:
        """Make room for lanes and starts; ``draw_starts`` draws them.

        Raises InputError where the settings are not valid.
        """
        self.lanes, self.device = lanes, device
        one = Task(settings, keep_samples=False)
        self.task = Task(settings, lanes=starts, keep_samples=False, trim=one.trim)
        """The same task on the processor, which draws the starts, and works out the figures of ended
        episodes.
        """
        self.agents, self.starts = one.agents, starts
        arrays = arrays_of(one), arrays_of(self.task)
        self._bank = Columns(*arrays, starts, starts, starts, device)
        self._columns = Columns(*arrays, starts, lanes, _tile(lanes, device), device)
        tuples = self._columns.tuples
        self._episode, self._results, self._begun = tuples[EPISODE], tuples[RESULTS], tuples[BEGUN]
        self._step = _bound(self._columns)
        noises = [(self.task.noise, tuples[SENSORS])] if self.task.noise is not None else []
        if self.task.odometers.drawn:
            noises.append((self.task.odometers.noise, self._episode.odometer))
        self._noises = [(torch.tensor(noise.rms, device=device), arrays) for noise, arrays in noises]
        self._arguments = settings, lanes, starts, device

    def __reduce__(self) -> Any:
        """A copy has tensors of its own, and a kernel that is bound to these."""
        return TensorLanes, self._arguments, (self.task, self._bank.blocks, self._columns.blocks)

    def __setstate__(self, state: Any) -> None:
        self.task, *contents = state
        for columns, blocks in zip((self._bank, self._columns), contents, strict=True):
            for block, numbers in blocks.items():
                columns.blocks[block].copy_(numbers)

    def draw_starts(self, random: Callable[[int], np.random.Generator]) -> None:
        """Draw all starts, each from its own generator, and run them in."""
        self.task.reset(np.arange(self.starts), random)
        self._bank.fill(arrays_of(self.task))

    def begin(self, lanes: torch.Tensor, starts: torch.Tensor) -> None:
        """Begin episodes in lanes, (n,), from starts, (n,), and write their results."""
        self._columns.take(lanes, self._bank, starts)

    def step(self, action: torch.Tensor, waiting: torch.Tensor, random: torch.Generator) -> None:
        """Make one control step under actions, (rows, actions), except in lanes that wait, (lanes,).

        random: of the sensors' noise, on the device.
        """
        self._columns.write(self._episode.action, action)
        self._columns.write(self._episode.idle, waiting)
        for rms, arrays in self._noises:
            now = arrays.noise[..., 0, :]  # drawn for one control step at a time
            now.copy_(rms * torch.randn(now.shape, generator=random, dtype=rms.dtype, device=self.device))
            arrays.noise_used.zero_()
        self._step()

    def results(self) -> Results:
        """Results of the last step or start, for all rows, in tensors of their own."""
        return Results(*(self._columns.of_lanes(each).contiguous() for each in self._results))

    def counts(self) -> torch.Tensor:
        """Whether the reward of each row's last step counts, (rows,); see ``episode.counts``."""
        run, own = self._columns.tuples[RUN].table, self._columns.of_lanes(self._episode.table)
        steps = run[:, list(self.task.episode.controlled), :, Row.STEP].movedim(1, 2)  # tiles, lanes, agents
        found: torch.Tensor = counts(self._columns.of_lanes(steps).reshape(-1), own)
        return found

    def speeds(self) -> torch.Tensor:
        """Mean speed of each lane's train (m/s), (lanes,)."""
        return self._columns.of_lanes(self._begun.speed)

    def context(self, row: int) -> Context:
        """Information about an episode that a policy may use; row: of results, that of a collector."""
        lane, agent = divmod(row, self.agents)
        self._read(torch.tensor([lane], device=self.device), RUN, BEGUN)
        return self.task.context(agent)

    def figures(self, lanes: torch.Tensor) -> tuple[dict[str, Array], Flags]:
        """Figures of lanes, (n,), of which there are at most as many as starts, as ``Task.figures_of``."""
        self._read(lanes, RUN, EPISODE, RUNNING)
        return self.task.figures_of(slice(0, len(lanes) * self.agents))

    def _read(self, lanes: torch.Tensor, *numbers: int) -> None:
        """Copy some tuples of lanes, (n,), to the first ones of the task on the processor."""
        for number in numbers:
            self._columns.read(number, lanes, arrays_of(self.task)[number])


def _tile(lanes: int, device: torch.device) -> int:
    """Lanes in a tile: on the processor all lie in one."""
    return TILE if device.type == "cuda" else lanes


def _bound(columns: Columns) -> Callable[[], Any]:
    if columns.device.type == "cuda":
        from ..backend.cuda import bind_on_gpu  # needs numba-cuda, an extra

        return bind_on_gpu(control_unless_idle, columns, RESULTS, RESULTS + 1)
    tuples = [columns.tile_of(number)[0] for number in range(RESULTS + 1)]
    *arrays, results = (map_arrays(torch.Tensor.numpy, each) for each in tuples)
    threads = LaneThreads(bind(control_steps, pack(*arrays), *results, 0, columns.lanes), columns.lanes)
    return partial(threads.step, *results)


def arrays_of(task: Task) -> tuple[Any, ...]:
    """Named tuples of the arrays of a task, in the order of the kernels' arguments; then those of its
    results.
    """
    return (*task.arrays, task.results, Begun(task.speed))
