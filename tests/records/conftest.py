import numpy as np
import pytest

from panto_env import simulate
from panto_env.records.measured import measured


@pytest.fixture(scope="session")
def run():
    """A pass along the reference line at 250 km/h."""
    return simulate("en50318-2002", "dsa380", 250.0, record_droppers=False)


@pytest.fixture(scope="session")
def other_run():
    """A pass along another line, at the same speed."""
    return simulate("re250", "dsa250", 250.0, record_droppers=False)


@pytest.fixture(scope="session")
def record(run):
    return measured(run)


@pytest.fixture
def columns():
    """Columns of ten seconds at 500 Hz and 180 km/h, and a force of 120 N that varies."""
    time = 0.002 * np.arange(5000)
    random = np.random.default_rng(0)
    force = 120 + 20 * np.sin(2 * np.pi * 1.0 * time) + 10 * random.standard_normal(5000)
    return {"time (s)": time, "position (m)": 1000 + 50 * time, "force (N)": force}


@pytest.fixture
def written(tmp_path):
    """A function that writes columns as CSV; nan and None are empty cells."""

    def write(columns, name="record.csv"):
        cells = zip(*(list(each) for each in columns.values()), strict=True)
        rows = [",".join("" if each is None or each != each else str(each) for each in row) for row in cells]
        path = tmp_path / name
        path.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
        return path

    return write
