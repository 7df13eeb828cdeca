"""Single bits flipped in files: each is refused when it is read, or says what it said before."""

import json
import random
import shutil
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from panto_agents.model_file import read_model
from panto_agents.run_folder import RunFolder
from panto_agents.settings import load_training
from panto_agents.stored import FOLDER
from panto_baselines.dataset.episodes import Episode, read_episodes
from panto_baselines.dataset.settings import load_episodes
from panto_baselines.oracle import stored
from panto_baselines.report.result import read_result
from panto_env import InputError, Trajectory, simulate
from panto_env.base.array_file import write_arrays
from panto_env.base.checksums import CHECKSUM, read_checked
from panto_env.base.files import read_toml
from panto_env.metrics import trajectory
from panto_env.studies import Comparison, Outcome
from panto_env.studies import write as write_study
from panto_env.studies.throughput import study as speed

from ..documents import ROOT
from ..said import said

FLIPS = 220


@pytest.fixture(scope="module")
def run():
    return simulate("periodic-stiffness", "three-mass", 250.0, distance=150.0)


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "run.parquet"
    run.save(path)
    return path


def flipped(source, target, read, places=None):
    """Counts of the flips that were refused, and of those that changed nothing; any other fails."""
    data, draw = source.read_bytes(), random.Random(1)
    bits = list(places or range(8 * len(data)))
    whole, refused, same = said(read(source)), 0, 0
    for bit in draw.sample(bits, min(FLIPS, len(bits))):
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        target.write_bytes(changed)
        try:
            now = said(read(target))
        except InputError:
            refused += 1
        else:
            assert now == whole, f"bit {bit}"
            same += 1
    return refused, same


@pytest.mark.parametrize("part", ["anywhere", "the footer"])
def test_a_saved_run(part, saved, tmp_path):
    size = saved.stat().st_size
    footer = int.from_bytes(saved.read_bytes()[-8:-4], "little") + 8
    places = range(8 * (size - footer), 8 * size) if part == "the footer" else None
    refused, same = flipped(saved, tmp_path / "flipped.parquet", Trajectory.load, places)
    assert refused > FLIPS / 4
    assert refused + same == FLIPS


@pytest.mark.parametrize(
    ("file", "read"),
    [
        ("docs/benchmark/head.json", lambda path: read_result(path).model_dump()),
        ("baselines/oracle/results.json", stored.read),
        ("docs/speed/amd-epyc-znver4.json", speed.read),
    ],
)
def test_a_result(file, read, tmp_path):
    refused, same = flipped(ROOT / file, tmp_path / "flipped.json", read)
    assert refused > FLIPS / 2
    assert refused + same == FLIPS


def test_the_numbers_of_a_study(tmp_path):
    outcome = Outcome(
        "a study", (Comparison("mass", "kg", 1.25, 1.2, 1.0, 1.5),), numbers={"σ": [1 / 3, None]}
    )
    (path,) = write_study(outcome, tmp_path)
    assert read_checked(path) == outcome.as_dict()
    assert json.loads(path.read_text())[CHECKSUM]
    refused, same = flipped(path, tmp_path / "flipped.json", read_checked)
    assert refused > FLIPS / 2
    assert refused + same == FLIPS


def test_the_settings_of_a_training(tmp_path):
    run = RunFolder(tmp_path / "run")
    run.path.mkdir()
    run.write_settings(load_training(ROOT / "configs" / "agent-high-speed.toml"))
    source = Path(shutil.copy(run.settings, tmp_path / "whole.json"))
    refused, same = flipped(source, run.settings, lambda _: run.read_settings())
    assert refused > FLIPS / 2
    assert refused + same == FLIPS


@pytest.mark.parametrize("part", ["anywhere", "the header"])
def test_a_model_file(part, tmp_path):
    file = FOLDER / "head.safetensors"
    header = 8 + int.from_bytes(file.read_bytes()[:8], "little")
    places = range(8 * header) if part == "the header" else None
    refused, same = flipped(file, tmp_path / "flipped.safetensors", read_model, places)
    assert refused > FLIPS / 4
    assert refused + same == FLIPS


def test_a_part_of_a_data_set(tmp_path):
    plans = load_episodes(ROOT / "configs" / "dataset-known-line.toml")
    plans = list(islice(plans.plans(plans.sets[0]), 2))
    arrays = {
        f"{plan.number}|{name}|{'std' if name in ('infos', 'figures') else ''}": np.array(float(plan.number))
        for plan in plans
        for name in Episode._fields
    }
    source = tmp_path / "part.safetensors"
    write_arrays(source, {}, arrays)
    refused, same = flipped(source, tmp_path / "flipped", lambda path: read_episodes(path, plans))
    assert refused > FLIPS / 2
    assert refused + same == FLIPS


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
    stored.read(stored.RESULTS)
    assert read_toml(ROOT / "pyproject.toml")


def test_a_model_with_the_network_of_another_is_refused(tmp_path):
    """Each model is whole; together they are not what was written."""
    one, other = ((FOLDER / f"{name}.safetensors").read_bytes() for name in ("head", "known-line"))
    begin = 8 + int.from_bytes(one[:8], "little")
    path = tmp_path / "mixed.safetensors"
    path.write_bytes(one[:begin] + other[-(len(one) - begin) :])
    with pytest.raises(InputError, match="it is damaged or was changed"):
        read_model(path)
