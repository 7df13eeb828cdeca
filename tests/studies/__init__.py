"""Studies as a whole, made once for the tests of a module."""

from panto_env.studies import Outcome, Table, find_study


def made(name: str) -> Outcome:
    """What a study finds, whose progress goes forward."""
    told: list[float] = []
    outcome = find_study(name)(lambda what, share: told.append(share))
    assert told == sorted(told)
    assert 0 <= told[0] < told[-1] < 1
    return outcome


def table(outcome: Outcome, words: str) -> Table:
    """The one table with these words in its title."""
    (found,) = (each for each in outcome.tables if words in each.title)
    return found
