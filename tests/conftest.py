import pytest

from panto_env import simulate


@pytest.fixture(scope="session")
def reference_run():
    """The reference model of EN 50318:2002 at 300 km/h."""
    return simulate("en50318-2002", "en50318-2002", 300.0)
