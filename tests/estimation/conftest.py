import pytest

from panto_env import simulate
from panto_env.estimation.motion import measure


@pytest.fixture(scope="session")
def run():
    return simulate("en50318-2002", "own-two-mass", 250, time_step=5e-4, record_droppers=False)


@pytest.fixture(scope="session")
def motion(run):
    return measure(run)
