from zlib import crc32

import pytest

from panto_env import simulate


def pytest_addoption(parser):
    parser.addoption(
        "--part", help="K/N: of the tests every N-th from K (0 first), by name; N such runs have all"
    )


def pytest_collection_modifyitems(config, items):
    if part := config.getoption("--part"):
        which, parts = map(int, part.split("/"))
        groups = {True: [], False: []}
        for item in items:  # all cases of a function together: they share what takes long
            groups[crc32(item.nodeid.partition("[")[0].encode()) % parts == which % parts].append(item)
        config.hook.pytest_deselected(items=groups[False])
        items[:] = groups[True]


@pytest.fixture(scope="session")
def reference_run():
    """The reference model of EN 50318:2002 at 300 km/h."""
    return simulate("en50318-2002", "en50318-2002", 300.0)
