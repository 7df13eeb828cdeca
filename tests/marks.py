"""Which of many long cases are proofs, and which are studies."""

import pytest


def some_in_proofs(names, proofs):
    """Parameters: cases by name, of which some are run by `make proofs`, and the others by `make studies`."""
    assert set(proofs) <= set(names)
    return [
        pytest.param(name, marks=pytest.mark.slow if name in proofs else pytest.mark.study) for name in names
    ]
