"""What paper 1 prints of its identification (Tables 1 to 5), and what its Table 1 says of its Table 2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...catalog import load_pantograph
from ...identification import parameters_of
from ...identification.model import matrices

TRUTH = parameters_of(load_pantograph("identified-2dof"))  # Table 2's parameters


@dataclass(frozen=True)
class Published:
    """One experiment; displacements of y_p1, y_p2, y_p3 in mm as printed."""

    name: str
    frequency: float  # Hz
    force: tuple[float, float]  # amplitude, offset (N)
    amplitudes: tuple[float, float, float]  # mm
    offsets: tuple[float, float, float]  # mm
    values: tuple[float, ...]  # c1T, c2, m3, c3, k3 (SI), Tables 2 to 4
    rsd: tuple[float, ...]  # %
    condition: float
    performance: tuple[float, float, float]  # %, Table 5
    mean_error: tuple[float, float, float]  # mm, Table 5


PUBLISHED = (
    Published(
        "I", 1.4219, (1.83, 30.7862), (0.99, 0.99, 0.97), (54.3, 53.4, 51.2),
        (12.31, 0.11, 10.38, 50.92, 611.85), (2.8, 4.2, 15.6, 16.3, 102.4), 112.46,
        (75.5, 74.9, 75.6), (0.27, 0.26, 0.25),
    ),
    Published(
        "II", 0.91017, (2.03, 30.7913), (1.89, 1.88, 1.80), (54.3, 53.4, 51.1),
        (12.68, 0.31, 10.72, 51.92, 624.17), (5.5, 7.4, 20.3, 41.6, 155.4), 448.00,
        (66.1, 64.4, 65.9), (0.33, 0.32, 0.33),
    ),
    Published(
        "III", 0.90335, (2.23, 30.7682), (2.98, 2.96, 2.95), (53.9, 52.9, 50.9),
        (13.01, 0.74, 10.88, 52.30, 630.53), (8.4, 12.6, 29.2, 68.1, 188.7), 504.22,
        (63.6, 63.2, 64.3), (0.77, 0.76, 0.75),
    ),
)  # fmt: skip


def per_plate(frequency: float) -> tuple[complex, complex, complex]:
    """Force (N/m), y_p2 and y_p3 per metre of plate motion at a frequency (Hz), complex: Eqs 1 and 2."""
    a, b = matrices(TRUTH)
    s = 2j * np.pi * frequency
    head, support, *_ = np.linalg.solve(s * np.eye(4) - a, b[:, 0] + s * b[:, 1])
    return complex((TRUTH["k1T"] + s * TRUTH["c1T"]) * (1 - head)), complex(head), complex(support)


def expected(printed: Published) -> list[tuple[str, str, float, float, float, float]]:
    """The contact force f_1, then y_p2 and y_p3, under the printed motion of the plate.

    Name and unit, then the model's amplitude and the printed one, the model's offset and the printed one.
    """
    moving, still = per_plate(printed.frequency), per_plate(0.0)
    theirs = printed.force, *zip(printed.amplitudes[1:], printed.offsets[1:], strict=True)
    found = []
    for k, (name, unit, scale) in enumerate((("f_1", "N", 1e-3), ("y_p2", "mm", 1.0), ("y_p3", "mm", 1.0))):
        amplitude = scale * abs(moving[k]) * printed.amplitudes[0]
        offset = scale * still[k].real * printed.offsets[0]
        found.append((name, unit, amplitude, theirs[k][0], offset, theirs[k][1]))
    return found


def best_performance(printed: Published) -> float:
    """Largest P_f (%) of y_p1 that a model can reach if driven by Table 1's force, whatever its phase.

    Offset left out. With one phase free, two sinusoids differ at least by the difference of their amplitudes.
    """
    modelled = 1e3 * printed.force[0] / abs(per_plate(printed.frequency)[0])  # mm
    return float(100 * (1 - abs(modelled - printed.amplitudes[0]) / printed.amplitudes[0]))


def dry_friction(printed: Published) -> float:
    """Dry friction (N) that would raise the model's force to Table 1's amplitude, by harmonic balance.

    A friction F_c against the velocity adds 4 F_c / pi to the part of the force in phase with it.
    """
    force = 1e-3 * printed.amplitudes[0] * per_plate(printed.frequency)[0]
    missing = np.sqrt(printed.force[0] ** 2 - force.real**2) - force.imag
    return float(np.pi / 4 * missing)


def largest_mean_error(printed: Published, channel: int) -> float:
    """Largest mean error (mm) that the printed P_f and amplitude allow: no mean exceeds its rms (Eq. 9)."""
    return (1 - printed.performance[channel] / 100) * printed.amplitudes[channel] / float(np.sqrt(2))
