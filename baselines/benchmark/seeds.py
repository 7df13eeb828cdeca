"""Seeds by what they are for: none of those that a policy learnt from is among those that judge it."""

TEST = range(0, 1000)
"""Of the benchmark: what is reported."""
SELECTION = range(1000, 2000)
"""Of choosing between what was trained or tuned."""
TRAINING = range(2000, 1_000_000)
"""Of training and tuning."""
