"""The passes of a film: policies under settings, and saved runs."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.simulation import (
    check_made_anew,
    is_saved_run,
    load_with_settings,
    ready_pass,
    simulate,
    steps_of_policy,
)
from ..base.errors import InputError
from ..control.settings import run_settings
from ..metrics.figures import LABELS, in_words
from ..metrics.trajectory import Trajectory
from ..plant.state import Row
from ..policies import check_named
from .moment import BEHIND, moment_of
from .picture import Picture

OF_CONTROL = ("version", "actuator", "sensors", "estimator", "known_pantograph")
"""Settings that may differ between two runs that count as the same line under two controls."""


class Filmed(NamedTuple):
    """One pass of a film."""

    title: str  # name in the picture
    policy: Any
    settings: dict[str, Any]
    seed: int
    run: Trajectory  # the whole pass, for its figures
    file: str = ""  # of a saved run; empty for others

    @property
    def control_interval(self) -> float:
        """Time between two actions (s)."""
        return run_settings(self.settings).control_interval

    def check(self) -> None:
        """Raise InputError where it is a saved run that cannot be repeated."""
        if self.file:
            check_made_anew(self.run, self.settings, self.file)


def saved_passes(sources: Sequence[str]) -> dict[str, Filmed]:
    """Passes of the sources that are files of saved runs.

    Raises InputError where one cannot be read, or its policy would run code from a path.
    """
    found = {}
    for source in sources:
        if is_saved_run(source):
            run, settings = load_with_settings(source)
            check_named(run.controlled.policy, source)
            title = f"{run.controlled.policy} ({Path(source).name})"
            found[source] = Filmed(title, run.controlled.policy, settings, run.seed, run, source)
    return found


def policy_pass(policy: str, settings: dict[str, Any], seed: int) -> Filmed:
    """The pass of a policy, simulated. Raises InputError as ``simulate`` does."""
    run = simulate(policy=policy, seed=seed, **settings)
    return Filmed(run.controlled.policy, policy, settings, seed, run)


def check_together(filmed: Sequence[Filmed]) -> None:
    """Raise InputError unless passes can be shown together: same spans, speed and control interval."""
    first = filmed[0]
    for other in filmed[1:]:
        if other.run.alignment != first.run.alignment:
            raise InputError(
                f"Passes above each other must have the same spans, but those of {first.title} and "
                f"{other.title} differ in number or length; make a film of each."
            )
        for name, one, two in (
            ("speed (km/h)", first.run.speed_kmh, other.run.speed_kmh),
            ("control_interval (s)", first.control_interval, other.control_interval),
        ):
            if abs(one - two) > 1e-9 * abs(one):
                raise InputError(
                    f"Passes above each other must have the same {name}, but {first.title} has {one:g} and "
                    f"{other.title} {two:g}; make a film of each."
                )


def _but_for_control(run: Trajectory) -> str:
    """A run's settings without its control, as text, in which nan equals nan."""
    settings = {name: value for name, value in run.settings.items() if name not in OF_CONTROL}
    return json.dumps([settings, run.design, run.seed, run.speed_kmh, run.nominal_force], sort_keys=True)


FASTEST = 25.0  # maximum frames per second of a film


class Excerpt(NamedTuple):
    """The part of a pass that a film shows, and its frames."""

    begin: float  # s
    end: float  # s
    every: int  # control steps from frame to frame
    rate: float  # frames per second


def excerpt(first: Filmed, first_span: int, seconds: float, slow_motion: float) -> Excerpt:
    """The part of a pass for a film: a number of seconds from the start of a span on.

    Every n-th control step is a frame. Raises InputError where the pass does not have the span.
    """
    run, interval = first.run.controlled, first.control_interval
    begin = run.time_at(run.alignment.support(first_span - 1))
    if begin >= run.time[-1]:
        raise InputError(
            f"The run ends at {run.distance:.0f} m, before span {first_span}; begin in an earlier one."
        )
    every = max(1, ceil(1 / (FASTEST * slow_motion * interval) - 1e-9))
    end = min(begin + seconds, float(run.time[-1]))
    return Excerpt(begin, end, every, 1 / (every * interval * slow_motion))


def frames(
    filmed: Sequence[Filmed],
    what: Excerpt,
    size: tuple[int, int],
    progress: Callable[[float], None] | None = None,
) -> Iterator[NDArray[np.uint8]]:
    """Frames, (height, width, 3), of passes above each other.

    size: width and height of the film (px). progress: called with the finished share.
    """
    part = size[0], size[1] // len(filmed)
    highest = max(_highest(each.run, what) for each in filmed)  # one scale for all
    passes = [_Pass(each, figures_in_words(each, filmed[0]), part, highest) for each in filmed]
    tell, number = progress or (lambda share: None), 0
    while passes[0].time < what.end and all(each.step() for each in passes):
        if passes[0].time < what.begin:
            tell(0.2 * passes[0].time / what.begin)
            continue
        if number % what.every == 0:
            yield np.concatenate([each.frame() for each in passes])
            tell(0.2 + 0.8 * (passes[0].time - what.begin) / (what.end - what.begin))
        number += 1


def _highest(run: Trajectory, what: Excerpt) -> float:
    """Maximum contact force (N) of a run that a film shows: its first frame shows some before it begins."""
    begin = what.begin - BEHIND * run.alignment.mean_length / run.speed
    shown = [own.contact_force[(own.time >= begin) & (own.time <= what.end)] for own in run.train]
    return max(float(force.max(initial=0.0)) for force in shown)


class _Pass:
    """One pass that is drawn while it runs."""

    def __init__(
        self, filmed: Filmed, figures: dict[str, str], size: tuple[int, int], highest: float
    ) -> None:
        run = filmed.run
        self.task, driver = ready_pass(filmed.policy, filmed.settings, filmed.seed)
        self._steps = steps_of_policy(self.task, driver, run.controlled.policy)
        self._picture = Picture(*size, highest)
        words = "pantographs" if run.followers else "pantograph"
        self._title = f"{filmed.title}: {words} {run.pantographs}, line {run.catenary}"
        self._figures = figures

    @property
    def time(self) -> float:
        """Time since the start (s)."""
        return self.task.plant.of(0, Row.STEP) * self.task.plant.time_step

    def step(self) -> bool:
        """Make one control step; False if the pass has ended."""
        return next(self._steps, None) is not None

    def frame(self) -> NDArray[np.uint8]:
        """The present picture."""
        return self._picture.draw(moment_of(self.task, 0, self._title, self._figures))


def figures_in_words(filmed: Filmed, first: Filmed) -> dict[str, str]:
    """Mean and σ of a whole pass, and the change of σ relative to the first pass.

    The change is given only for passes that differ just in their control.
    """
    run = filmed.run
    if run.terminated:
        return {"figures": "none: it ends early"}
    figures, spans = run.controlled.summary(run.common_spans()), in_words(run.common_spans())
    texts = {
        f"{LABELS[name].short}, spans {spans}": f"{getattr(figures, name):.1f} N" for name in ("mean", "std")
    }
    other = first.run
    if filmed is not first and not other.terminated and _but_for_control(run) == _but_for_control(other):
        change = 100 * (figures.std / other.controlled.summary(other.common_spans()).std - 1)
        texts[f"σ relative to {first.title}"] = f"{change:+.1f} %"
    return texts
