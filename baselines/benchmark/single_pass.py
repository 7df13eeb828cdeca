"""One pass of a benchmark: a policy on a line at a speed under a seed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env import InputError, Trajectory, simulate
from panto_env.control.context import Context
from panto_env.metrics.figures import Figures
from panto_env.metrics.spans import within
from panto_env.policies import Policy, find_policy

from .settings import BenchmarkSettings, Line

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """Figures of one pass; all nan where it ended early (``terminated``)."""

    policy: str
    catenary: str
    pantograph: str
    speed_kmh: float
    seed: int
    nominal_force: float  # N
    terminated: bool
    figures: Figures
    action_rate: float  # rms change of the commanded force from step to step, over the interval (N/s)

    def as_dict(self) -> dict[str, Any]:
        """Names and values in this order, those of the figures among them."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "figures"}
        rate = own.pop("action_rate")
        return own | self.figures.as_dict() | {"action_rate": rate}


def run_pass(
    settings: BenchmarkSettings,
    line: Line,
    spans: tuple[int, int],
    policy: str,
    speed_kmh: float,
    seed: int,
) -> Row:
    """Run one pass; its figures cover ``spans``, first and last, counted from 1.

    Raises InputError, naming the policy, where the policy fails.
    """
    run, force = drive(settings, line, policy, speed_kmh, seed)
    if run.terminated:
        figures = Figures.none()
        rate = float("nan")
    else:
        figures = run.summary(spans)
        position = np.arange(len(force)) * settings.control_interval * speed_kmh / 3.6
        changes = np.diff(force[within(position, spans, run.span_length)], axis=0) / settings.control_interval
        rate = float(np.sqrt(np.mean((changes**2).sum(axis=1))))
    return Row(
        policy=policy,
        catenary=line.catenary,
        pantograph=line.pantograph,
        speed_kmh=speed_kmh,
        seed=seed,
        nominal_force=run.nominal_force,
        terminated=run.terminated,
        figures=figures,
        action_rate=rate,
    )


def drive(
    settings: BenchmarkSettings, line: Line, policy: str, speed_kmh: float, seed: int
) -> tuple[Trajectory, Array]:
    """The record of a pass, and the commanded forces, (control steps, actions) (N)."""
    driver = _Recorder(find_policy(policy), policy)
    with _torch_on_one_thread():
        run = simulate(
            line.catenary,
            line.pantograph,
            speed_kmh,
            driver,
            seed=seed,
            actuator=settings.actuator,
            sensors=settings.sensors,
            line_condition=settings.line_condition,
            control_interval=settings.control_interval,
            distance=line.distance,
            record_droppers=False,
        )
    return run, np.array(driver.forces)


class _Recorder:
    """A policy that keeps its commands, and says its name when it fails."""

    def __init__(self, policy: Policy, name: str) -> None:
        self._policy, self._name = policy, name
        self.forces: list[Array] = []

    def reset(self, context: Context) -> None:
        self._context = context
        with self._named():
            self._policy.reset(context)

    def act(self, observation: NDArray[np.float32]) -> Array:
        shape = (self._context.actions,)
        with self._named():
            action = np.asarray(self._policy.act(observation), dtype=float)
            if action.shape != shape or not np.isfinite(action).all():
                raise ValueError(f"its action must be finite numbers of shape {shape}, not {action}")
        self.forces.append(self._context.force_limit * np.clip(action, -1, 1))
        return action

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # somebody else's code: anything can happen
            kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
            raise InputError(f"The policy '{self._name}' failed: {kind}{str(error).rstrip('.')}.") from error


@contextmanager
def _torch_on_one_thread() -> Iterator[None]:
    """The cores are for passes, and the last bit must not depend on how many of them are free."""
    torch = sys.modules.get("torch")  # loaded by a policy that needs it, if any
    threads = torch.get_num_threads() if torch else 0
    try:
        if torch:
            torch.set_num_threads(1)
        yield
    finally:
        if torch:
            torch.set_num_threads(threads)
