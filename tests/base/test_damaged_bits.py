"""What another program wrote anew, or mixed, is refused; damage at random is in tests/fuzz."""

import json

import numpy as np
import pytest

from panto_agents.model_file import read_model
from panto_agents.stored import FOLDER
from panto_baselines.oracle import stored
from panto_baselines.report.result import read_result
from panto_env import InputError, Trajectory, simulate
from panto_env.base.checksums import CHECKSUM
from panto_env.base.files import read_toml
from panto_env.metrics import trajectory

from ..documents import ROOT


@pytest.fixture(scope="module")
def run():
    return simulate("periodic-stiffness", "three-mass", 250.0, distance=150.0)


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "run.parquet"
    run.save(path)
    return path


def test_a_bit_of_a_column_is_told_as_damage(run, tmp_path):
    """What Parquet's own checksums of pages miss, because another program wrote them anew, ours does not."""
    import pyarrow.parquet as pq

    path = tmp_path / "run.parquet"
    run.save(path)
    table = pq.read_table(path)
    force = table["contact_force"].to_numpy().copy()
    force[10] = np.nextafter(force[10], np.inf)
    place = table.column_names.index("contact_force")
    import pyarrow as pa

    pq.write_table(table.set_column(place, "contact_force", pa.array(force)), path)
    with pytest.raises(InputError, match=r"not a whole trajectory file \(it is damaged or was"):
        Trajectory.load(path)


def test_what_has_no_checksum_is_refused(saved, tmp_path):
    import pyarrow.parquet as pq

    table = pq.read_table(saved)
    facts = json.loads(table.schema.metadata[trajectory.KEY])
    del facts[CHECKSUM]
    path = tmp_path / "run.parquet"
    pq.write_table(table.replace_schema_metadata({trajectory.KEY: json.dumps(facts)}), path)
    with pytest.raises(InputError, match="its checksum does not fit"):
        Trajectory.load(path)
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"cells": [{"asked": {"fingerprint": "ab"}}]}))
    with pytest.raises(InputError, match="its checksum does not fit"):
        stored.read(path)


def test_what_comes_with_the_project_is_whole():
    for path in FOLDER.glob("*.safetensors"):
        read_model(path)
    for path in (ROOT / "docs" / "benchmark").glob("*.json"):
        read_result(path)
    for path in stored.RESULTS.glob("*.json"):
        stored.read(path)
    assert read_toml(ROOT / "pyproject.toml")


def test_a_model_with_the_network_of_another_is_refused(tmp_path):
    """Each model is whole; together they are not what was written."""
    one, other = ((FOLDER / f"{name}.safetensors").read_bytes() for name in ("head", "known-line"))
    begin = 8 + int.from_bytes(one[:8], "little")
    path = tmp_path / "mixed.safetensors"
    path.write_bytes(one[:begin] + other[-(len(one) - begin) :])
    with pytest.raises(InputError, match="it is damaged or was changed"):
        read_model(path)
