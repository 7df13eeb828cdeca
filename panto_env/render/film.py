"""Films of policies on one line, above each other, each in a pass of its own under the same seed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.simulation import ready_pass, simulate, steps_of_policy
from ..base.errors import InputError
from ..control.settings import RunSettings
from ..metrics.labels import LABELS
from ..metrics.spans import in_words
from ..metrics.trajectory import SUFFIXES, Trajectory
from ..plant.catenary import CATENARIES
from ..plant.pantograph.schema import PantographData
from ..plant.state import Row
from .moment import moment_of
from .picture import Picture

SAME = 0.5
"""By which forces of a pass that is made again may differ (N): another processor rounds otherwise."""
FASTEST = 25.0
"""Frames per second that a film has at most."""


@dataclass(frozen=True)
class Shown:
    """What of a pass a film shows, and how."""

    begin: float  # s
    end: float  # s
    every: int  # control steps from frame to frame
    rate: float  # frames per second

    @property
    def frames(self) -> int:
        """How many frames the film has, unless a pass ends before."""
        return int((self.end - self.begin) * self.rate)


def shown(run: Trajectory, interval: float, first_span: int, seconds: float, slow_motion: float) -> Shown:
    """What a film of a pass shows: so many seconds from the start of a span on.

    interval: of control (s). Frames are control steps, all of them or every so many-th. Raises InputError
    where the pass has no such span.
    """
    begin = (first_span - 1) * run.span_length / (run.speed_kmh / 3.6)
    if begin >= run.time[-1]:
        raise InputError(
            f"The run ends at {run.distance:.0f} m, before span {first_span}; begin in an earlier one."
        )
    every = max(1, ceil(1 / (FASTEST * slow_motion * interval) - 1e-9))
    end = min(begin + seconds, float(run.time[-1]))
    return Shown(begin, end, every, 1 / (every * interval * slow_motion))


@dataclass(frozen=True)
class Source:
    """A pass that is filmed: who drives, on what, and the record of it."""

    policy: Any
    settings: dict[str, Any]
    seed: int
    run: Trajectory


def source(policy: str, settings: dict[str, Any], seed: int) -> Source:
    """Of a policy; or of a saved run, "run.parquet", by its own settings and seed, made again.

    Raises InputError where a saved run cannot be made again: its line is not in the file, or it comes out
    differently here.
    """
    if not policy.endswith(SUFFIXES):
        return Source(policy, settings, seed, simulate(policy=policy, seed=seed, **settings))
    saved = Trajectory.load(policy)
    if not saved.design:
        raise InputError(
            f"{policy} was written by an older version, without its line and pantograph; simulate it anew "
            "with `panto simulate --output`."
        )
    own = {name: value for name, value in saved.settings.items() if name in RunSettings.model_fields}
    line = CATENARIES[saved.design["catenary"]["kind"]].schema
    own["catenary"] = line.model_validate(saved.design["catenary"])
    own["pantograph"] = PantographData.model_validate(saved.design["pantograph"])
    again = simulate(policy=saved.policy, seed=saved.seed, **own | {"speed_kmh": saved.speed_kmh})
    same = len(again.time) == len(saved.time)
    if not (same and np.allclose(again.contact_force, saved.contact_force, rtol=1e-3, atol=SAME)):
        raise InputError(
            f"{policy} does not come out again here: its policy or the program is another one; simulate "
            "it anew with `panto simulate --output`."
        )
    return Source(saved.policy, own | {"speed_kmh": saved.speed_kmh}, saved.seed, saved)


def frames(
    sources: Sequence[Source],
    what: Shown,
    size: tuple[int, int],
    progress: Callable[[float], None] | None = None,
) -> Iterator[NDArray[np.uint8]]:
    """Frames, (height, width, 3), of passes above each other.

    size: width and height of the film (px); progress: called with the share done.
    """
    width, height = size[0], size[1] // len(sources)
    first = sources[0].run
    passes = [_Pass(each, figures_in_words(each.run, first), (width, height)) for each in sources]
    number = 0
    while passes[0].time < what.end and all(each.step() for each in passes):
        if passes[0].time < what.begin:
            if progress is not None:
                progress(0.2 * passes[0].time / what.begin)
            continue
        if number % what.every == 0:
            yield np.concatenate([each.frame() for each in passes])
            if progress is not None:
                progress(0.2 + 0.8 * (passes[0].time - what.begin) / (what.end - what.begin))
        number += 1


class _Pass:
    """One policy's pass, drawn as it goes."""

    def __init__(self, made: Source, figures: dict[str, str], size: tuple[int, int]) -> None:
        self.task, driver = ready_pass(made.policy, made.settings, made.seed)
        run = made.run
        self._steps = steps_of_policy(self.task, driver, run.policy)
        self._picture = Picture(*size)
        self._title = f"{run.policy}: pantograph {run.pantograph}, line {run.catenary}"
        self._figures = figures

    @property
    def time(self) -> float:
        """Since the start (s)."""
        return self.task.plant.of(0, Row.STEP) * self.task.plant.time_step

    def step(self) -> bool:
        """One control step; whether there was one left."""
        return next(self._steps, None) is not None

    def frame(self) -> NDArray[np.uint8]:
        """The picture now."""
        return self._picture.draw(moment_of(self.task, 0, self._title, self._figures))


def figures_in_words(run: Trajectory, first: Trajectory) -> dict[str, str]:
    """Mean and σ of a whole pass, and by how much its σ differs from that of the first one."""
    if run.terminated:
        return {"figures": "none: it ends early"}
    figures, spans = run.summary(), in_words(run.spans())
    values = {"mean": figures.mean, "std": figures.std}
    told = {f"{LABELS[name].short}, spans {spans}": f"{value:.1f} N" for name, value in values.items()}
    if run is not first and not first.terminated:
        change = 100 * (figures.std / first.summary().std - 1)
        told[f"σ beside {first.policy}"] = f"{change:+.1f} %"
    return told
