import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from panto_env import InputError, Trajectory, simulate
from panto_env.base.checksums import with_checksum, without_checksum
from panto_env.metrics import run_tables, stored_run
from panto_env.report.findings import Findings

from ..crafted import ODD, changed, entries


@pytest.fixture(scope="module")
def run():
    return simulate(distance=180.0)


def test_where_there_is_contact_the_head_presses_into_the_wire(run):
    """The strip's spring of 50 kN/m joins force and heights."""
    touching = run.contact_force > 1.0
    pressed = 50e3 * (run.head - run.wire)
    np.testing.assert_allclose(pressed[touching], run.contact_force[touching], atol=1e-6)


def test_parquet_round_trip_is_exact(run, tmp_path):
    path = tmp_path / "run.parquet"
    run.save(path)
    again = Trajectory.load(path)
    for name, value in vars(run).items():
        np.testing.assert_array_equal(getattr(again, name), value, err_msg=name)
    assert again.summary("all") == run.summary("all")


def test_line_without_supports_or_droppers_survives_parquet(tmp_path):
    run = simulate("periodic-stiffness", "three-mass", 200, distance=100)
    run.save(tmp_path / "run.parquet")
    again = Trajectory.load(tmp_path / "run.parquet")
    assert again.dropper_force.shape == run.dropper_force.shape
    assert np.isnan(again.summary("all").max_uplift)


def test_half_written_other_and_missing_files_are_refused(run, tmp_path):
    path = tmp_path / "run.parquet"
    run.save(path)
    path.write_bytes(path.read_bytes()[:5000])
    pq.write_table(pa.table({"a": [1]}), tmp_path / "other.parquet")
    for each in (path, tmp_path / "other.parquet"):
        with pytest.raises(InputError, match="is not a whole trajectory file"):
            Trajectory.load(each)
    with pytest.raises(InputError, match="does not exist"):
        Trajectory.load(tmp_path / "missing.parquet")


def test_files_of_another_format_are_refused(run, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(stored_run, "FORMAT", stored_run.FORMAT + 1)
        run.save(tmp_path / "run.parquet")
    with pytest.raises(InputError, match="it has another format"):
        Trajectory.load(tmp_path / "run.parquet")


def crafted(path):
    """Facts and columns of a run, each with one entry that is wrong."""
    table = pq.read_table(path)
    columns = {name: table[name].to_numpy() for name in table.column_names}
    facts = without_checksum(json.loads(table.schema.metadata[stored_run.KEY]), columns)
    for place in entries(facts):
        deep = place[0] in ("settings", "design") and place[1:] not in (("controlled",), ("pantograph",))
        if not (deep and len(place) > 1) and not (isinstance(place[-1], int) and place[-1] > 1):
            yield from ((changed(facts, place, value), columns) for value in (*ODD, KeyError))
    for name in ("time", "position", "contact_force", "uplift_1"):
        column = columns[name]
        for wrong in (-column, 0 * column, column * np.nan, 1e300 * column, column.astype(str)):
            yield facts, columns | {name: wrong}
    for rows in (0, 1, 2):
        yield facts, {name: column[:rows] for name, column in columns.items()}


@pytest.mark.slow
def test_a_crafted_run_is_refused_in_a_sentence_or_shown(tmp_path):
    """With a checksum that fits: no entry leads to anything but figures or one sentence."""
    path, ends = tmp_path / "run.parquet", []
    simulate("en50318-2002", "dsa250", 250, accuracy="fast", distance=190.0).save(path)
    for facts, columns in list(crafted(path))[::6]:
        stored = json.dumps(with_checksum(facts, columns))
        try:
            table = pa.table(columns, metadata={stored_run.KEY: stored})
            pq.write_table(table, tmp_path / "crafted.parquet")
            again = Trajectory.load(tmp_path / "crafted.parquet")
            again.compliance((1, 2))
            assert len(run_tables.figures([again], (1, 2)).columns) > 5
            run_tables.droppers([again], (1, 2))
            (found,) = Findings.of(again, "run.parquet")
            _ = found.criteria, found.remarks, found.by_span
            ends.append("shown")
        except InputError as error:
            ends.append("refused" if str(error).endswith(".") and "\n" not in str(error) else "rude")
    assert "rude" not in ends
    assert ends.count("refused") > 50
    assert ends.count("shown") > 10


def test_failed_save_leaves_the_old_file(run, tmp_path, monkeypatch):
    path = tmp_path / "run.parquet"
    run.save(path)
    before = path.read_bytes()
    monkeypatch.setattr(pq, "write_table", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("spans", [(0, 1), (3, 2), (1.0, 2), (4, 9), (1, 2, 3), "5-6", 4])
def test_spans_outside_the_run_are_refused(run, spans):
    with pytest.raises(InputError, match="spans"):
        run.summary(spans)


def test_a_steady_train_is_at_a_place_after_its_way_over_its_speed(run):
    for place in (0.0, 0.3 * run.stride, 40.0, run.distance):
        assert run.time_at(place) == pytest.approx(place / run.speed, abs=1e-12)
