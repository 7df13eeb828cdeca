"""Which of many cases are tested each time, which are proofs, and which are studies."""

import pytest


def some_at_once(names, quick, others=pytest.mark.slow):
    """Parameters: cases by name, of which some are run by `make test`; others: mark of all others."""
    assert set(quick) <= set(names)
    return [name if name in quick else pytest.param(name, marks=others) for name in names]


def some_in_proofs(names, proofs):
    """Parameters: cases by name, of which some are run by `make proofs`, and the others by `make studies`."""
    assert set(proofs) <= set(names)
    return [
        pytest.param(name, marks=pytest.mark.slow if name in proofs else pytest.mark.study) for name in names
    ]
