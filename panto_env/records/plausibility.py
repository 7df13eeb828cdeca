"""Whether columns can be those of a measuring train: sizes and signs, with the likely mistake where not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Array, to_kmh
from ..base.errors import InputError
from .record import Piece

FORCE = (5.0, 1000.0)
"""Mean contact force (N) of any pantograph, far beyond usual ones: a factor of a thousand is outside."""
SPEED_KMH = (5.0, 600.0)
"""Mean speed of a run (km/h)."""
SAME_SPEED = 0.2
"""Relative difference up to which the column of speeds agrees with positions over time."""
OVER_PLACE = 0.03
"""The same where time was had from position and speed: what differs then are samples that do not fit them."""
IN_TURN = 0.1
"""Share of the steps at which a position begins to rise, or to fall, above which it is unsorted."""
HEIGHT = 5.0
"""Maximum range of heights of the contact point (m): no pantograph reaches further."""
UPLIFT = 1.0
"""Maximum uplift at a mast (m)."""


def check_force(force: Array) -> None:
    """Raise InputError unless this can be a contact force, (n,), N, without gaps; n > 1."""
    if np.ptp(force) == 0:
        raise InputError("Column force never changes; check the sensors and their wiring.")
    if (np.diff(force) >= 0).all():
        raise InputError(
            f"Column force rises from {force[0]:.6g} to {force[-1]:.6g} and never falls, as a position does; "
            "check whether it is swapped with another column."
        )
    mean, middle = float(force.mean()), float(np.median(force))
    if middle < 0:
        raise InputError(
            f"Half of the contact forces lie below {middle:.4g} N; a force that presses on the wire is "
            "positive, so turn the sign of the column."
        )
    if abs(mean) < FORCE[0]:
        raise InputError(
            f"The mean contact force is {mean:.3g} N, less than any pantograph's; if the column is in "
            "kilonewtons, name the unit: --unit force=kN."
        )
    if abs(mean) > FORCE[1]:
        raise InputError(
            f"The mean contact force is {mean:,.4g} N, more than any pantograph's; if the column is in "
            "newtons, name the unit: --unit force=N."
        )


def check_motion(values: Mapping[str, Array]) -> None:
    """Raise InputError for heights or an uplift, (n,), m, that no line has; nan is left out."""
    height, uplift = values.get("height"), values.get("uplift")
    if height is not None and (span := float(np.nanmax(height) - np.nanmin(height))) > HEIGHT:
        raise InputError(
            f"Column height covers {span:,.4g} m, more than any pantograph; if it is in millimetres, "
            "name the unit: --unit height=mm."
        )
    if uplift is not None and (most := float(np.nanmax(np.abs(uplift)))) > UPLIFT:
        raise InputError(
            f"Column uplift reaches {most:,.4g} m, more than any mast allows; if it is in millimetres, "
            "name the unit: --unit uplift=mm."
        )


def check_axes(run: str, time: Array | None, position: Array | None) -> None:
    """Raise InputError where a run's columns of time (s) and position (m), (n,), are swapped or fall.

    They are refused, too, where rows are not in order. run: words for messages, such as " of run 'a'" or
    nothing.
    """
    rises, ahead = (None if each is None else _direction(each) for each in (time, position))
    if rises is not None and rises <= 0 and (ahead is None or ahead > 0):
        other, advice = (", but the position does", "swapped") if ahead else ("", "the right column")
        them = "the two are" if ahead else "it is"
        raise InputError(
            f"The time{run} does not rise{other}; check whether {them} {advice}, and sort by time."
        )
    if time is not None and rises is not None and rises < 0:
        raise InputError(
            f"The rows{run} run backwards in time, from {time[0]:.6g} to {time[-1]:.6g} s; sort them by time."
        )
    if time is not None and position is not None and rises and ahead:
        speed, (low, high) = abs(float(np.ptp(position) / np.ptp(time))), SPEED_KMH
        if to_kmh(speed) < low <= to_kmh(1 / max(speed, 1e-9)) <= high:
            raise InputError(
                f"By time and position the train{run} runs at {to_kmh(speed):.3g} km/h; with the two "
                f"columns swapped it would be {to_kmh(1 / speed):.4g} km/h, so check whether they are, and "
                "their units."
            )
    if position is not None:
        _check_way(run, position, timed=time is not None)


def check_speed(run: str, longest: Piece, given: Array | None, *, over_place: bool = False) -> None:
    """Raise InputError for a mean speed that no train has, or that the column of speeds contradicts.

    longest: piece of the run; given: speeds during it (m/s), (m,), at equal steps of time, where the record
    has them beside positions; over_place: whether the time was had from both.
    """
    speed = longest.speed
    low, high = SPEED_KMH
    if not low <= to_kmh(speed) <= high:
        raise InputError(
            f"The mean speed{run} is {to_kmh(speed):,.4g} km/h, outside {low:g} to {high:g}; check the units "
            "of time and position, or of the speed, km/h or m/s."
        )
    if given is None:
        return
    mean = float(np.mean(given))
    if over_place and abs(mean / speed - 1) > OVER_PLACE:
        raise InputError(
            f"Column speed has a mean of {to_kmh(mean):.4g} km/h{run}, but the way over the time that "
            f"follows from it is {to_kmh(speed):.4g} km/h; remove samples whose positions repeat or jump, "
            "or add a column time (s)."
        )
    if abs(mean / speed - 1) > SAME_SPEED:
        raise InputError(
            f"Column speed has a mean of {to_kmh(mean):.4g} km/h{run}, and positions over "
            f"time one of {to_kmh(speed):.4g} km/h; check the units, m/s or km/h."
        )


def _check_way(run: str, position: Array, *, timed: bool) -> None:
    """Raise InputError for positions (m), (n,), that never change, fall, or are not in order.

    timed: whether the record has times; then noise of an odometer does no harm.
    """
    if np.ptp(position) == 0:
        raise InputError(
            f"The position{run} never changes; check the odometer, or give time and speed instead."
        )
    ahead, steps = _direction(position), np.sign(np.diff(position))
    moved = steps[steps != 0]
    if (moved[1:] != moved[:-1]).sum() > IN_TURN * len(moved) and (not timed or ahead <= 0):
        advice = "check whether it is the right column" if timed else "sort them by position or time"
        raise InputError(
            f"The position{run} falls at {(moved < 0).sum():,} samples and rises at {(moved > 0).sum():,}, "
            f"in turn, so the rows are not in the order in which a train runs; {advice}."
        )
    if ahead < 0:
        low = position[-1] < position[0]
        how = f"from {position[0]:.6g} to {position[-1]:.6g} m" if low else "at most samples"
        raise InputError(
            f"The position{run} falls {how}, as the train runs against the chainage; write the position as "
            "that of a support minus each, best of the last support before the record begins, so that it "
            "rises and supports stay in place."
        )


def _direction(values: Array) -> float:
    """1 where most steps rise, -1 where most of those that are not 0 fall, 0 where none is either."""
    return float(np.sign(np.sign(np.diff(values)).sum()))
