"""The passes behind paper 3's figures: one parameter at a time, over the 11th and 12th span."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np

from ...analysis.parameters import change
from ...analysis.simulation import simulate
from ...base.arrays import Array, from_kmh
from ...catalog import load_catenary, load_pantograph
from ...metrics import compliance as en50367
from ...metrics.figures import Figures, arcing, contact_loss
from ...plant.catenary.schema import PowerSystem

CATENARY, PANTOGRAPH = "periodic-stiffness", "three-mass"
SYSTEM: PowerSystem = "AC"  # power supply for the limits of EN 50367; the paper names none
SPEED_KMH = 300.0  # train speed of every figure but those over speed (section 3)
SPANS = (11, 12)  # what the figures show: 500 to 600 m (section 3)
SPEEDS_KMH = (200.0, 250.0, 300.0, 350.0)  # own choice: the text gives no speed but 300 km/h
TIME_STEP = 2e-3
"""s. Means over 500 to 600 m and places of maxima are taken from whole steps: the default, 5 ms, is 0.5 m
of way at 350 km/h, which is too coarse for them."""
FACTORS = (0.75, 1.0, 1.25)
"""Own choice: the text does not give the other values of a parameter; all get the same factors."""


@dataclass(frozen=True)
class Influence:
    """What one pair of the paper's figures varies: head displacement first, contact force after it."""

    key: str
    parameter: str  # as ``panto sweep`` names it
    symbol: str
    unit: str
    values: tuple[float, ...]
    first_figure: int

    @property
    def base(self) -> float:
        """The paper's basic value."""
        return SPEED_KMH if self.parameter == "speed_kmh" else self.values[FACTORS.index(1.0)]


@dataclass(frozen=True)
class Pass:
    """One pass over 500 to 600 m. Force and displacement are raw, as the paper shows them."""

    speed_kmh: float
    span: float  # m
    position: Array  # (n,): m
    force: Array  # (n,): F_C, Eq. 8 (N)
    displacement: Array  # (n,): of the head, z_1 (m)
    nominal_force: float  # F(v), Eq. 6 (N)
    figures: Figures  # as EN 50317 sees the same way: force low-passed at 20 Hz
    within_en50367: dict[str, bool]  # whether each limit of EN 50367 is kept, by its key

    @property
    def swing(self) -> float:
        """Maximum less minimum of the contact force (N)."""
        return float(np.ptp(self.force))

    @property
    def travel(self) -> float:
        """Maximum less minimum of the head's displacement (m)."""
        return float(np.ptp(self.displacement))

    def numbers(self) -> dict[str, Any]:
        """Maximum, minimum, mean, σ of force (N) and displacement (mm), and EN 50367's limits."""
        return {
            "contact_force_n": statistics(self.force),
            "displacement_mm": statistics(1e3 * self.displacement),
            "nominal_force_n": self.nominal_force,
            "contact_lost_percent": contact_loss(self.force),
            "low_passed": self.figures.as_dict(),
            "en50367_largest_mean_n": en50367.largest_mean(from_kmh(self.speed_kmh), SYSTEM),
            "en50367": self.within_en50367,
        }


Passes = Mapping[str, Sequence[Pass]]  # passes of every influence, by its key, in the order of its values


def influences() -> tuple[Influence, ...]:
    """The paper's five, in its order; basic values are the catalogue's."""
    line, pantograph = load_catenary(CATENARY), load_pantograph(PANTOGRAPH)
    basic = (
        ("variation", "catenary.stiffness_variation", "ε", "", line.stiffness_variation),  # type: ignore[attr-defined]
        ("mean-stiffness", "catenary.mean_stiffness", "k_m", "N/m", line.mean_stiffness),  # type: ignore[attr-defined]
        ("mass", "pantograph.masses.1", "m_1", "kg", pantograph.masses[0]),
        ("suspension", "pantograph.stiffnesses.1", "k_1", "N/m", pantograph.stiffnesses[0]),
    )
    varied = [
        Influence(key, name, symbol, unit, tuple(factor * value for factor in FACTORS), 6 + 2 * k)
        for k, (key, name, symbol, unit, value) in enumerate(basic)
    ]
    return (Influence("speed", "speed_kmh", "v", "km/h", SPEEDS_KMH, 4), *varied)


@cache
def run_pass(parameter: str, value: float, *, bilateral: bool) -> Pass:
    """One pass with one parameter off its basic value, at 300 km/h unless that is the parameter.

    bilateral: the contact may pull, as Eqs 7 and 8 have it.
    """
    line, pantograph = load_catenary(CATENARY), load_pantograph(PANTOGRAPH)
    speed_kmh = value if parameter == "speed_kmh" else SPEED_KMH
    if parameter.startswith("catenary."):
        line = change(line, parameter, value)
    elif parameter != "speed_kmh":
        pantograph = change(pantograph, parameter, value)
    run = simulate(line, pantograph, speed_kmh, bilateral=bilateral, time_step=TIME_STEP)
    shown, figures = run.inside(SPANS), run.summary(SPANS)
    nq, speed = arcing(run.contact_force[shown], run.time_step), from_kmh(speed_kmh)
    judged = en50367.criteria(figures, nq, speed, SYSTEM, "own choice")
    return Pass(
        speed_kmh=speed_kmh,
        span=run.alignment.mean_length,
        position=run.position[shown],
        force=run.contact_force[shown],
        displacement=run.head[shown],
        nominal_force=run.nominal_force,
        figures=figures,
        within_en50367={each.key: bool(each.kept) for each in judged},
    )


def largest_static_force(one_pass: Pass) -> float:
    """F_S (N) at which a pass' maximum would be at its limit.

    Every force scales with F(v) = F_S + alpha v^2, in either reading of the contact.
    """
    aerodynamic = one_pass.nominal_force - load_pantograph(PANTOGRAPH).static_force
    limit = en50367.maximum_limit(from_kmh(one_pass.speed_kmh), SYSTEM)
    return limit / float(one_pass.force.max() / one_pass.nominal_force) - aerodynamic


def statistics(values: Array) -> dict[str, float]:
    """Extremes, mean and standard deviation."""
    found = {"max": values.max(), "min": values.min(), "mean": values.mean(), "sigma": values.std()}
    return {name: float(value) for name, value in found.items()}


RUN_TIME = 12.0  # how long the paper's simulation runs (s), section 3
POINTS = 601


class Equations:
    """Paper 3's plant at one speed: y' = A(t) y + b, y = (z_1, z_2, z_3, their velocities)."""

    def __init__(self, speed_kmh: float) -> None:
        """Take the catalogue's parameters."""
        line, data = load_catenary(CATENARY), load_pantograph(PANTOGRAPH)
        self._mean: float = line.mean_stiffness  # type: ignore[attr-defined]
        self._variation: float = line.stiffness_variation  # type: ignore[attr-defined]
        speed = from_kmh(speed_kmh)
        self.span = line.alignment().mean_length
        self.span_time = self.span / speed
        self.shown = np.linspace(SPANS[0] - 1, SPANS[1], POINTS) * self.span_time
        self._inertia = np.array(data.masses)[:, None]
        springs, dampers = _chain(data.stiffnesses), _chain(data.dampings)
        self._matrix = np.block(
            [[np.zeros((3, 3)), np.eye(3)], [-springs / self._inertia, -dampers / self._inertia]]
        )
        self._push = np.zeros(6)
        self._push[5] = data.nominal_force(speed) / data.masses[-1]

    def stiffness(self, time: Array | float) -> Array:
        """Eq. 5 (N/m)."""
        turns = 2 * np.pi * np.asarray(time) / self.span_time
        return np.asarray(self._mean * (1 + self._variation * np.cos(turns)))

    def matrix(self, time: float) -> Array:
        """A at a time (s), (6, 6)."""
        return self._on(self.stiffness(time))

    def _on(self, stiffness: Array | float) -> Array:
        matrix = self._matrix.copy()
        matrix[3, 0] -= stiffness / self._inertia[0, 0]
        return matrix

    def natural_frequency(self) -> float:
        """Lowest natural frequency (Hz) of the pantograph on the mean stiffness."""
        swings = np.linalg.eigvals(self._on(self._mean))
        return float(np.abs(swings[swings.imag > 0]).min() / (2 * np.pi))

    def contact_force(self, start: Literal["rest", "flat"]) -> Array:
        """Contact force over the 11th and 12th span (N), (POINTS,), Eq. 8: the contact may pull.

        start: "rest" under F(v) on the spring at the mast, or "flat", all displacements and velocities 0.
        """
        begin = np.zeros(6) if start == "flat" else np.linalg.solve(self.matrix(0.0), -self._push)
        moving = _solved(
            lambda t, y: self.matrix(t) @ y + self._push, begin, self.shown[-1], t_eval=self.shown
        )
        return np.asarray(self.stiffness(self.shown) * moving[0])

    def growth(self) -> float:
        """What is left of a disturbance after one span, at most (-): the largest Floquet multiplier.

        Below 1 the motion forgets how it began.
        """
        moving = _solved(
            lambda t, y: (self.matrix(t) @ y.reshape(6, 6)).ravel(), np.eye(6).ravel(), self.span_time
        )
        return float(np.abs(np.linalg.eigvals(moving[:, -1].reshape(6, 6))).max())


def _solved(equations: Callable[[float, Array], Array], begin: Array, end: float, **others: Any) -> Array:
    """The solution of ordinary differential equations from 0 s to an end, (equations, times)."""
    from scipy.integrate import solve_ivp  # slow to import

    solution = solve_ivp(equations, (0.0, end), begin, rtol=1e-8, atol=1e-11, **others)
    return np.asarray(solution.y)


def _chain(values: tuple[float, ...]) -> Array:
    """Matrix of springs or dampers between three masses, the last to the ground."""
    first, second, third = values
    return np.array([[first, -first, 0], [-first, first + second, -second], [0, -second, second + third]])


SHARES = (0.10, 0.25, 0.50)  # each parameter is varied by plus and minus so much of its basic value
SHARE = 0.25  # the share that the ranking is made with


@dataclass(frozen=True)
class Sensitivity:
    """Change from 1 - share to 1 + share times the basic value, over the basic figure (-)."""

    influence: str  # its key
    symbol: str
    share: float
    std: float  # of the contact force's σ
    swing: float  # of the contact force's maximum less minimum
    travel: float  # of the head displacement's maximum less minimum


def measure(influence: Influence, share: float, *, bilateral: bool) -> Sensitivity:
    """Central difference of one parameter's effect at 300 km/h."""
    low, base, high = (
        run_pass(influence.parameter, factor * influence.base, bilateral=bilateral)
        for factor in (1 - share, 1.0, 1 + share)
    )
    return Sensitivity(
        influence=influence.key,
        symbol=influence.symbol,
        share=share,
        std=float((np.std(high.force) - np.std(low.force)) / np.std(base.force)),
        swing=(high.swing - low.swing) / base.swing,
        travel=(high.travel - low.travel) / base.travel,
    )
