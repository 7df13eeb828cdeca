"""What of a line has changed between two fits, with the uncertainty of both.

With x the values at the earlier fit and d their changes since, fits to the earlier and later records are
Gaussian likelihoods of x and of x + d; x has the fits' tolerances as prior, d has tolerances of its own. What
records hardly determine, such as a smooth shift of all droppers, is in both fits and falls out: changes are
known better than the line is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Array
from ..base.errors import InputError
from .fit import Found, slack_droppers, within
from .stored import Stored

SMALLER = 0.5
"""Standard deviations of changes, before any record is seen, as a share of the tolerances of a line as built.
Own choice."""
FALSE = 0.05
"""Share of changes that are named although there are none (Benjamini and Hochberg, 1995)."""


@dataclass(frozen=True)
class Drift:
    """Changes of values from an earlier fit to a later one; each counts from the earlier one."""

    earlier: Stored
    later: Stored
    found: tuple[Found, ...]  # changes, along what both fits compared
    changed: tuple[Found, ...]  # those that are named, most surely first

    def of_kind(self, kind: str) -> list[Found]:
        """Changes of one kind of values."""
        return [each for each in self.found if each.value.kind == kind]

    @property
    def notes(self) -> tuple[str, ...]:
        """Droppers that became slack, and why it is less sure than it says."""
        return *slack_droppers(self.changed), *self.earlier.notes, *self.later.notes


def drift(earlier: Stored, later: Stored, tolerances: Mapping[str, float] | None = None) -> Drift:
    """What has changed between two fits that count from one design.

    tolerances: standard deviations of changes by kind, instead of half of the fits' own. Raises InputError
    where the fits count from different designs or tolerances, free different kinds, or share no stretch.
    """
    _check_alike(earlier, later)
    values = {value.name: value for known in (earlier, later) for value in known.values}
    names, given = list(values), dict(tolerances or {})
    prior = np.array([value.tolerance for value in values.values()])
    usual = np.array([given.get(each.kind, SMALLER * each.tolerance) for each in values.values()])
    (first, first_side), (second, second_side) = (_likelihood(known, names) for known in (earlier, later))
    count = len(names)
    line, changes = np.diag(prior**-2) + first + second, np.diag(usual**-2) + second
    precision = np.block([[line, second], [second, changes]])
    covariance = np.linalg.inv(precision)
    change = (covariance @ np.concatenate([first_side + second_side, second_side]))[count:]
    deviation = np.sqrt(np.diag(covariance)[count:])
    both = {value.name for value in earlier.values} & {value.name for value in later.values}
    found = within(
        (
            Found(replace(value, tolerance=float(tolerance)), float(by), float(error))
            for value, tolerance, by, error in zip(values.values(), usual, change, deviation, strict=True)
            if value.name in both
        ),
        _common(earlier, later),
    )
    return Drift(earlier, later, found, _named(found))


def _likelihood(known: Stored, names: Sequence[str]) -> tuple[Array, Array]:
    """Information matrix, (n, n), and right side, (n,), of a fit's records alone, of values by name."""
    where = [names.index(value.name) for value in known.values]
    inverse = np.linalg.inv(known.covariance)
    information, side = np.zeros((len(names), len(names))), np.zeros(len(names))
    prior = np.diag([value.tolerance**-2 for value in known.values])
    information[np.ix_(where, where)] = 0.5 * (inverse + inverse.T) - prior
    side[where] = inverse @ known.difference
    return information, side


def _named(found: Sequence[Found]) -> tuple[Found, ...]:
    """Changes that are named, most surely first: of identifiable ones, so that few are false."""
    from scipy.stats import false_discovery_control, norm  # slow to import

    known = sorted((each for each in found if each.identifiable), key=_sureness, reverse=True)
    if not known:
        return ()
    shares = false_discovery_control(2 * norm.sf([_sureness(each) for each in known]))
    return tuple(each for each, share in zip(known, shares, strict=True) if share < FALSE)


def _sureness(each: Found) -> float:
    return abs(each.difference) / each.deviation


def _check_alike(earlier: Stored, later: Stored) -> None:
    if (earlier.line, earlier.pantograph) != (later.line, later.pantograph):
        raise InputError(
            f"The fits to {earlier.name} and {later.name} count from different lines or pantographs; fit "
            "both with the same --line and --pantograph."
        )
    kinds = [{(value.kind, value.tolerance) for value in known.values} for known in (earlier, later)]
    if kinds[0] != kinds[1]:
        raise InputError(
            f"The fits to {earlier.name} and {later.name} free different values, or with different "
            "tolerances; fit both with the same --free and --tolerance."
        )
    begin, end = _common(earlier, later)
    if not begin < end:
        first, second = ("{:,.0f} to {:,.0f} m".format(*known.compared) for known in (earlier, later))
        raise InputError(
            f"The fit to {earlier.name} is of {first}, that to {later.name} of {second}; give fits of one "
            "stretch."
        )


def _common(earlier: Stored, later: Stored) -> tuple[float, float]:
    pairs = earlier.compared, later.compared
    return max(begin for begin, _ in pairs), min(end for _, end in pairs)
