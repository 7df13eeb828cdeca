"""The passes of a film: policies under settings, and saved runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..analysis.simulation import check_made_anew, is_saved_run, load_with_settings, simulate
from ..base.errors import InputError
from ..control.settings import run_settings
from ..metrics.trajectory import Trajectory
from ..policies import check_named

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
        pairs = {
            "speed (km/h)": (first.run.speed_kmh, other.run.speed_kmh),
            "control_interval (s)": (first.control_interval, other.control_interval),
        }
        for name, (one, two) in pairs.items():
            if abs(one - two) > 1e-9 * abs(one):
                raise InputError(
                    f"Passes above each other must have the same {name}, but {first.title} has {one:g} and "
                    f"{other.title} {two:g}; make a film of each."
                )


def alike(one: Trajectory, other: Trajectory) -> bool:
    """Whether two runs differ only in their control."""
    return _but_for_control(one) == _but_for_control(other)


def _but_for_control(run: Trajectory) -> str:
    """A run's settings without its control, as text, in which nan equals nan."""
    settings = {name: value for name, value in run.settings.items() if name not in OF_CONTROL}
    return json.dumps([settings, run.design, run.seed, run.speed_kmh, run.nominal_force], sort_keys=True)
