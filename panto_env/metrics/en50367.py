"""Limits of EN 50367 on the contact force, as recalled; speeds in m/s."""

from __future__ import annotations

from .figures import Figures


def mean_limit(speed: float) -> float:
    """Largest mean force (N) for AC lines above 200 km/h."""
    return 0.00097 * (3.6 * speed) ** 2 + 70


def maximum_limit(speed: float) -> float:
    """Largest contact force (N)."""
    return 350.0 if 3.6 * speed > 200 else 300.0


def checks(figures: Figures, speed: float) -> dict[str, bool]:
    """Whether each limit is kept, by the name of its figure."""
    loss = 0.2 if 3.6 * speed > 250 else 0.1
    return {
        "mean": figures.mean <= mean_limit(speed),
        "std": figures.std <= 0.3 * figures.mean,
        "max": figures.max <= maximum_limit(speed),
        "contact_loss": figures.contact_loss <= loss,
    }
