"""What policies reached on the tracks of the benchmark, from its stored results."""

from functools import cache

import numpy as np

from panto_env.base.checksums import read_checked

from ..documents import ROOT

PASS = ("catenary", "pantograph", "speed_kmh", "seed")
ON_FAMILY = "adaptive:gains=adaptive-any-line"
FIVE = "agent-any-line, five trainings"
TRAILING = "front-preview:base='adaptive:gains=adaptive-trailing'"


@cache
def stored(track):
    return read_checked(ROOT / "docs" / "benchmark" / f"{track}.json")


def standing(track, policy):
    """What a policy reached over all of a track."""
    return next(each for each in stored(track)["standings"] if each["policy"] == policy)


def less(track, policy):
    """By how much a policy reduces σ on a track (%), with the interval's ends, the smaller one first."""
    found = standing(track, policy)
    return -found["change"], -found["interval"][1], -found["interval"][0]


def ahead(track, policy, other):
    """In how many passes a policy is ahead of another (%), with the interval's ends."""
    found = standing(track, policy)["better_than"][other]
    return tuple(100 * share for share in (found["share"], *found["interval"]))


@cache
def cells(track, policy):
    """By how much a policy reduces σ in each cell of a track (%)."""
    return {
        tuple(c[key] for key in PASS[:3]): -c["change"]
        for c in stored(track)["cells"]
        if c["policy"] == policy
    }


def at(track, policy, speed):
    """Cell of a track on one line."""
    (found,) = [less for (_, _, own), less in cells(track, policy).items() if own == speed]
    return found


def loss(track, policy, speed):
    """Contact loss CL in a cell of a track on one line (%)."""
    return next(
        cell["figures"]["contact_loss"]
        for cell in stored(track)["cells"]
        if cell["policy"] == policy and cell["speed_kmh"] == speed
    )


def passes(track, policy):
    """Change of σ in each pass of a policy (%)."""
    rows = [row for row in stored(track)["rows"] if row["policy"] == policy]
    return {tuple(row[key] for key in PASS): 100 * (row["std"] / row["pressed_std"] - 1) for row in rows}


def behind(track, policy, other):
    """By how many points a policy is behind another, pass by pass."""
    own, its = passes(track, policy), passes(track, other)
    return np.array([own[key] - its[key] for key in its])


def behind_by_cell(track, policy, other):
    """By how many points a policy is behind another, cell by cell."""
    own, its = cells(track, policy), cells(track, other)
    return np.array([its[key] - own[key] for key in its])


def ends(numbers):
    """The least and the largest of numbers."""
    return min(numbers), max(numbers)


def ranked():
    """Standings of all tracks that have a place in the rankings, without passive, tapes and the blind."""
    apart = ("passive", "tape of", "blind of")
    return [
        each
        for path in sorted((ROOT / "docs" / "benchmark").glob("*.json"))
        for each in stored(path.stem)["standings"]
        if each["rank"] is not None and not each["policy"].startswith(apart)
    ]


def of_trainings(function, track, other):
    """A function of a track and two policies, over the five trainings of agent-any-line."""
    names = stored(track)["settings"]["trainings"][FIVE]
    return np.concatenate([function(track, name, other) for name in names])
