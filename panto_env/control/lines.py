"""The line of an episode, drawn where the settings give several."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ..base.arrays import to_kmh
from ..catalog.drawn_lines import DrawnLines
from ..plant.catenary import CatenaryData
from .settings import RunSettings, run_settings

R = TypeVar("R", bound=RunSettings)
EXAMPLE = 4_000_000_000
"""Seed of the example of a family or a section; none of those for training, selection or test."""


def draws_line(settings: RunSettings) -> bool:
    """Whether the line is drawn per episode, from a list, a family or a section."""
    return not isinstance(settings.catenary, CatenaryData)


def line_name(settings: RunSettings) -> str:
    """Name of the line, or of the family or section that its lines are drawn from.

    Raises InputError for a list of lines.
    """
    lines = settings.catenary
    return lines.full_name if isinstance(lines, DrawnLines) else settings.line.name


def fewest_spans(settings: RunSettings) -> int | None:
    """Number of spans after which a line ends at the earliest, whichever is drawn; None where none ends."""
    lines = settings.catenary
    if isinstance(lines, DrawnLines):
        return lines.fewest_spans
    given = lines if isinstance(lines, tuple) else (lines,)
    return min((line.spans for line in given if line.ends), default=None)


def line_generator(random: np.random.Generator) -> np.random.Generator:
    """The child of an episode's generator from which its line is drawn."""
    (own,) = random.spawn(1)
    return own


def on_drawn_line(settings: R, random: Callable[[], np.random.Generator]) -> R:
    """Settings of an episode: on a line drawn from a list, all alike, or from a family or a section.

    A family or a section also limits the speeds to those of the drawn line. Where the settings have one line
    they are returned as they are, and ``random`` is not called. The line comes from a child of the generator:
    all other values of an episode are those that it draws on a given line, and two seeds, or two episodes of
    one seed, have the same line of a family or a section with a probability of 2^-128.
    """
    lines = settings.catenary
    if isinstance(lines, CatenaryData):
        return settings
    own = line_generator(random())
    if isinstance(lines, DrawnLines):
        profile = settings.speed_profile
        if profile is not None:  # of a line that is for its highest speed
            line, _ = lines.draw(own, (to_kmh(profile.range[1]),) * 2)
            return settings.model_copy(update={"catenary": line})
        line, speed_kmh = lines.draw(own, settings.speed_kmh)
        return settings.model_copy(update={"catenary": line, "speed_kmh": speed_kmh})
    return settings.on_line(lines[own.integers(len(lines))])


def line_of_seed(lines: DrawnLines, seed: int) -> tuple[CatenaryData, tuple[float, float]]:
    """The line that the first episode with a seed has, and the speeds of trains on it (km/h)."""
    settings = run_settings({"catenary": lines, "speed_kmh": (0.0, lines.fastest_kmh)})
    drawn = on_drawn_line(settings, lambda: np.random.default_rng(seed))
    return drawn.line, drawn.speed_kmh


def on_example(settings: R) -> R:
    """Settings on one example line: their own, the first of a list, or one drawn by a fixed seed."""
    if isinstance(settings.catenary, tuple):
        return settings.on_line(settings.catenary[0])
    return on_drawn_line(settings, lambda: np.random.default_rng(EXAMPLE))
