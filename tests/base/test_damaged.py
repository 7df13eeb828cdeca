"""What another program wrote anew, or mixed, or damaged, is refused; damage at random is in tests/fuzz."""

import gzip
import json
import re

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from panto_agents.model_file import read_model
from panto_agents.settings import parse_training
from panto_agents.stored import FOLDER
from panto_agents.trainings import RunFolder
from panto_baselines.benchmark.run import read_result
from panto_baselines.dataset.make import LIST, verify
from panto_baselines.oracle import stored
from panto_env import InputError, Trajectory, simulate
from panto_env.base.checksums import CHECKSUM, read_checked, write_checked
from panto_env.cluster import IDENTITY, open_parts
from panto_env.metrics import stored_run

from ..documents import ROOT

TRAINING = {"algorithm": "ppo", "total_steps": 512, "lanes": 2, "checkpoint_steps": 128}
TRAINING |= {"environment": {"id": "PantographStiffness-v0", "distance": 80.0}}
TRAINING |= {"evaluation": {"interval_steps": 128}, "hyperparameters": {"n_steps": 64, "batch_size": 64}}
EVALUATIONS = "steps,speed_kmh,seed\n128,300,1\n256,300,1\n"


def test_what_has_no_checksum_is_refused(tmp_path):
    """Nor what Parquet's own checksums of pages miss, because another program wrote them anew."""
    path = tmp_path / "run.parquet"
    simulate("periodic-stiffness", "three-mass", 250.0, distance=150.0).save(path)
    table = pq.read_table(path)
    force = table["contact_force"].to_numpy().copy()
    force[10] = np.nextafter(force[10], np.inf)
    place = table.column_names.index("contact_force")
    facts = json.loads(table.schema.metadata[stored_run.KEY])
    del facts[CHECKSUM]
    changed = table.set_column(place, "contact_force", pa.array(force))
    for each in (changed, table.replace_schema_metadata({stored_run.KEY: json.dumps(facts)})):
        pq.write_table(each, path)
        with pytest.raises(InputError, match=r"not a whole trajectory file \(it is damaged or was"):
            Trajectory.load(path)
    path = tmp_path / "result.json"
    path.write_text(json.dumps({"cells": [{"asked": {"fingerprint": "ab"}}]}))
    with pytest.raises(InputError, match="its checksum does not fit"):
        stored.read(path)


def test_a_stored_table_is_read_again_and_has_a_line_for_each_of_its_keys(tmp_path):
    """So that two results can be compared line by line, with the checksum first."""
    path, table = tmp_path / "it.json", {"b": [1, 2.5], "a": {"c": "\u03c3"}}
    write_checked(path, table)
    assert read_checked(path) == table
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line[:6] for line in lines if line[:2] == ' "'] == [' "sha2', ' "b": ', ' "a": ']


def test_a_compressed_table_is_the_same_and_the_same_bytes_each_time(tmp_path):
    table = {"b": [1, 2.5], "a": {"c": "\u03c3"}}
    for name in ("it.json", "it.json.gz", "again.json.gz"):
        write_checked(tmp_path / name, table)
    content = (tmp_path / "it.json.gz").read_bytes()
    assert content == (tmp_path / "again.json.gz").read_bytes()
    assert gzip.decompress(content) == (tmp_path / "it.json").read_bytes()
    assert read_checked(tmp_path / "it.json.gz") == table


@pytest.mark.parametrize("damage", [lambda content: content[:-9], lambda content: b"{}", lambda content: b""])
def test_a_damaged_compressed_table_is_refused(damage, tmp_path):
    path = tmp_path / "it.json.gz"
    write_checked(path, {"a": list(range(1000))})
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(InputError, match=re.escape(str(path))):
        read_checked(path)


@pytest.mark.slow
def test_what_comes_with_the_project_is_whole():
    for path in FOLDER.glob("*.safetensors"):
        read_model(path)
    for path in (ROOT / "docs" / "benchmark").glob("*.json.gz"):
        read_result(path)
    for path in stored.RESULTS.glob("*.json"):
        stored.read(path)


def test_a_model_with_the_network_of_another_is_refused(tmp_path):
    """Each model is whole; together they are not what was written."""
    one, other = ((FOLDER / f"{name}.safetensors").read_bytes() for name in ("head", "known-line"))
    begin = 8 + int.from_bytes(one[:8], "little")
    path = tmp_path / "mixed.safetensors"
    path.write_bytes(one[:begin] + other[-(len(one) - begin) :])
    with pytest.raises(InputError, match="it is damaged or was changed"):
        read_model(path)


@pytest.fixture
def folder(tmp_path):
    run = RunFolder(tmp_path / "run")
    run.path.mkdir()
    run.write_settings(parse_training(TRAINING, "test"))
    return run


@pytest.mark.parametrize(
    "damaged",
    [
        EVALUATIONS.replace("256", "2x6"),
        EVALUATIONS.replace("256", ""),
        EVALUATIONS.replace("steps", "step"),
        EVALUATIONS[:-4],
        EVALUATIONS.replace("256,", "256,1,"),
        EVALUATIONS.replace("300", '"300', 1),
        "\0" * 500,
    ],
)
def test_a_damaged_table_of_evaluations_is_refused_on_resume(damaged, folder):
    folder.evaluations.write_text(damaged)
    for resume in (
        lambda: folder.check_resumable(parse_training(TRAINING, "test")),  # before any work begins
        lambda: folder.drop_evaluations_after(128),
    ):
        with pytest.raises(InputError, match=r"evaluations\.csv is damaged after \d whole rows; correct"):
            resume()
    assert folder.evaluations.read_text() == damaged


def test_a_whole_table_of_evaluations_is_taken(folder):
    folder.evaluations.write_text(EVALUATIONS)
    folder.check_resumable(parse_training(TRAINING, "test"))
    folder.drop_evaluations_after(128)
    assert folder.evaluations.read_text().split() == ["steps,speed_kmh,seed", "128,300,1"]


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b"3", b'{"settings": 3}', b"[" * 100_000])
def test_damaged_json_and_checksums_are_refused_in_one_sentence(content, folder, tmp_path):
    folder.settings.write_bytes(content)
    (tmp_path / IDENTITY).write_bytes(content)
    (tmp_path / LIST).write_bytes(content or b"abc")
    for attempt, words in (
        (lambda: folder.check_resumable(parse_training(TRAINING, "test")), r"settings\.json"),
        (lambda: open_parts(tmp_path, {"kind": "designs"}), r"identity\.json (is not|could not be)"),
        (lambda: verify(tmp_path), r"\.$"),
    ):
        with pytest.raises(InputError, match=words):
            attempt()
