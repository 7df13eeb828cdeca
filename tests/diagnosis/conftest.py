import pytest

from panto_env.diagnosis.training import Track, drive

TRACK = Track("en50318-2002", "dsa250", 220.0, seed=31)
"""Under a pantograph, at a speed, and on a line that the classifier has not seen."""


@pytest.fixture(scope="session")
def healthy_runs():
    """Twelve passes over a healthy line."""
    return [drive(TRACK, k) for k in range(12)]
