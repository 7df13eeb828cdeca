"""Each study's figures beside those that its page tells."""

import pytest

from panto_env.studies import Outcome, Table, find_study


def made(name: str) -> Outcome:
    """What a study finds, whose progress goes forward."""
    told: list[float] = []
    outcome = find_study(name)(lambda what, share: told.append(share))
    assert told == sorted(told)
    assert 0 <= told[0] < told[-1] < 1
    return outcome


def check(outcome: Outcome, expected: dict[str, tuple[float, float]], differ: set[str]) -> None:
    """Ours within how far it may move before somebody must look, and what does not agree with the paper."""
    ours = {each.quantity: each.ours for each in outcome.comparisons}
    assert set(ours) == set(expected)
    for quantity, (value, tolerance) in expected.items():
        assert ours[quantity] == pytest.approx(value, abs=tolerance), quantity
    assert {each.quantity for each in outcome.comparisons if not each.agrees} == differ


def table(outcome: Outcome, words: str) -> Table:
    """The one table with these words in its title."""
    (found,) = (each for each in outcome.tables if words in each.title)
    return found
