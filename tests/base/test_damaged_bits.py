"""Single bits flipped in files: each is refused when it is read, or says what it said before."""

import json
import random
import shutil
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from panto_agents.add_checksums import add_checksum
from panto_agents.model_file import read_model
from panto_agents.model_parts import CHECKSUMS
from panto_agents.run_folder import RunFolder
from panto_agents.settings import load_training
from panto_agents.stored import FOLDER
from panto_baselines.oracle import stored
from panto_baselines.report.result import read_result
from panto_env import InputError, Trajectory, simulate
from panto_env.base.checked_json import CHECKSUM, read_checked, with_checksum
from panto_env.base.errors import UncheckedWarning
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
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UncheckedWarning)  # the checksum's own name was hit
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


@pytest.mark.parametrize("part", ["anywhere", "the directory"])
def test_a_model_file(part, tmp_path):
    file = FOLDER / "head.zip"
    size = file.stat().st_size
    places = range(8 * (size - 400), 8 * size) if part == "the directory" else None
    refused, same = flipped(file, tmp_path / "flipped.zip", read_model, places)
    assert refused > FLIPS / 4
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


class TestWithoutChecksum:
    """Files of before there were checksums are read, with a warning; a command of the module adds them."""

    def test_a_saved_run(self, run, saved, tmp_path):
        import pyarrow.parquet as pq

        path = tmp_path / "old.parquet"
        table = pq.read_table(saved)
        facts = table.schema.metadata[trajectory.KEY]
        pq.write_table(table.replace_schema_metadata({trajectory.KEY: facts}), path)
        with pytest.warns(UncheckedWarning, match="old.parquet has no checksum") as caught:
            assert said(Trajectory.load(path)) == said(run)
        assert len(caught) == 1
        self.mended(path, Trajectory.load, run)

    def test_a_result(self, tmp_path):
        table = {"cells": [{"asked": {"fingerprint": "ab"}}]}
        for name, text in (("a", json.dumps(table)), ("b", json.dumps(table, indent=1) + "\n")):
            path = tmp_path / f"{name}.json"
            path.write_text(text)
            with pytest.warns(UncheckedWarning, match=".json has no checksum"):
                assert stored.read(path) == table
            self.mended(path, stored.read, table)
            rest = path.read_text().replace(with_checksum(table)[CHECKSUM], "")
            assert rest.replace(f'"{CHECKSUM}":', "").replace('"",', "").replace(" ", "").split() == (
                text.replace(" ", "").split()
            )

    def test_a_model_file(self, tmp_path):
        path = tmp_path / "old.zip"
        with zipfile.ZipFile(FOLDER / "head.zip") as source, zipfile.ZipFile(path, "w") as archive:
            for name in set(source.namelist()) - {CHECKSUMS}:
                archive.writestr(name, source.read(name))
        with pytest.warns(UncheckedWarning, match="old.zip has no checksum"):
            facts, actor = read_model(path)
        self.mended(path, read_model, (facts, actor))

    def mended(self, path, read, whole):
        add_checksum(path)
        before = path.read_bytes()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert said(read(path)) == said(whole)
        add_checksum(path)
        if path.suffix == ".json":
            assert path.read_bytes() == before


def test_what_comes_with_the_project_is_checked():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for path in FOLDER.glob("*.zip"):
            read_model(path)
        for path in (ROOT / "docs" / "benchmark").glob("*.json"):
            read_result(path)
        stored.read(stored.RESULTS)
    assert read_toml(ROOT / "pyproject.toml")


def test_a_model_whose_parts_were_exchanged_is_refused(tmp_path):
    """Each zip is whole; together they are not what was written."""
    path = tmp_path / "mixed.zip"
    shutil.copy(FOLDER / "head.zip", path)
    with zipfile.ZipFile(FOLDER / "head.zip") as one, zipfile.ZipFile(FOLDER / "high-speed.zip") as other:
        parts = {name: one.read(name) for name in one.namelist()}
        parts["actor.npz"] = other.read("actor.npz")
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    with pytest.raises(InputError, match=r"its part actor\.npz is damaged or was changed"):
        read_model(path)
