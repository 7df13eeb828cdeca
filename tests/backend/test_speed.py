"""``panto speed``: every row is measured, and the documents hold what it prints."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import panto_env
from panto_env.base import machine
from panto_env.base.checksums import with_checksum
from panto_env.base.errors import InputError
from panto_env.cli import studies as speed
from panto_env.envs import IDS
from panto_env.studies.throughput import study, tables
from panto_env.studies.throughput import study as environments
from panto_env.studies.throughput.tables import plot_speed

ROOT = Path(panto_env.__file__).parents[1]
chooses_cores = pytest.mark.skipif(
    not machine.CAN_CHOOSE_CORES, reason="a process can't choose its cores on this platform"
)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """What ``panto speed --json`` prints, and the picture that it draws."""
    picture = tmp_path_factory.mktemp("speed") / "speed.png"
    panto = Path(sys.executable).with_name("panto")
    told = subprocess.run(
        [panto, "speed", "--repeats", "1", "--json", "--plot", picture], capture_output=True, text=True
    )
    assert told.returncode == 0, told.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    stored = picture.with_name("speed.json")
    stored.write_text(told.stdout)
    return study.read(stored)


@pytest.mark.slow
def test_every_plant_and_environment_is_measured_and_cost_over_spans_modes_grid_and_cores(result):
    plants = {"en50318-2002", "periodic-stiffness", "ohl-three-span"}
    assert {row["catenary"] for row in result["plants"]} == plants
    assert all(row["times_real_time"] > 1 for row in result["plants"])
    assert {row["id"] for row in result["environments"]} == set(IDS)
    scaling = result["scaling"]
    assert [row["spans"] for row in scaling["spans"]] == [3, 5, 8, 10, 12]
    assert [row["modes"] for row in scaling["modes"]] == [10, 20, 40, 80]
    assert {row["catenary"] for row in scaling["modes"]} == {"ohl-three-span"}
    assert len({(r["speed_kmh"], r["accuracy"], r["precision"]) for r in scaling["discretisation"]}) == 8
    equal, *others = [row["line"] for row in scaling["lines"]]
    assert equal == "equal spans"
    assert ["overlap" in each or "these" in each for each in others] == [False, True, False, True]
    assert ["stitch" in each or "these" in each for each in others] == [False, False, True, True]
    if machine.CAN_CHOOSE_CORES:
        counts = {row["cores"] for row in scaling["cores"]}
        assert {1, machine.cores()} <= counts
        assert len(scaling["cores"]) == len(environments.SHARED) * len(counts)
    for row in result["environments"] + scaling["cores"]:
        assert row["yardstick"] == ("Pendulum-v1" if row["lanes"] is None else "CartPole-v1")
        assert row["ratio"] == pytest.approx(row["steps_per_second"] / row["yardstick_steps_per_second"])
    assert [row["ideal"] for row in result["environments"][:2]] == [True, False]
    own = result["machine"]
    assert own["vector_bits"] in (64, 128, 256, 512)
    assert own["family"] in tables.machine(result)
    assert f"vectors of {own['vector_bits']} bits" in tables.machine(result)


@chooses_cores
def test_cores_are_narrowed_and_given_back():
    allowed = os.sched_getaffinity(0)

    def interrupted():
        with machine.on_cores(1):
            assert machine.cores() == 1
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert os.sched_getaffinity(0) == allowed


STORED = sorted((ROOT / "docs" / "speed").glob("*.json"))
"""Results of ``panto speed --json``, each of a machine."""


def test_the_page_holds_what_the_command_prints_of_stored_results():
    text = (ROOT / "docs" / "speed.md").read_text(encoding="utf-8")
    begin, end = tables.BEGIN, tables.END
    blocks = [begin + part.partition(end)[0] + end + "\n" for part in text.split(begin)[1:]]
    assert STORED
    first, details = tables.markdown([study.read(path) for path in STORED])
    assert blocks[0] == first
    some = blocks[1].removeprefix(begin).removesuffix(f"{end}\n")  # of its tables, side by side
    assert some in details
    assert "**Lines, their window travelling**" in some


def keys(value):
    """Names in a result, and in its first rows."""
    if isinstance(value, dict):
        return {name: keys(each) for name, each in value.items()}
    return keys(value[0]) if isinstance(value, list) and value else None


@chooses_cores
@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
@pytest.mark.slow
def test_stored_results_have_the_form_of_today(result, path):
    assert keys(study.read(path)) == keys(result)


@pytest.mark.slow
def test_results_of_several_machines_stand_side_by_side(result, tmp_path, capsys):
    other = json.loads(json.dumps(result))
    other["machine"]["processor"] = "Another One"
    for row in other["environments"]:
        row["ratio"] = 7.7
    paths = [tmp_path / "one.json", tmp_path / "other.json"]
    for path, each in zip(paths, (result, other), strict=True):
        path.write_text(json.dumps(with_checksum(each)))
    speed.speed(paths, markdown=True)
    told = capsys.readouterr().out
    assert "(2) Another One" in told
    assert "| ratio (1) | speed (2) | ratio (2) |" in told
    assert "| 7.7 |" in told
    speed.speed(paths)
    assert "Another One" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["", "[]", json.dumps(with_checksum({"machine": 1})), "\xff"])
def test_what_is_no_result_is_refused(tmp_path, text):
    path = tmp_path / "bad.json"
    path.write_text(text, encoding="latin-1")
    words = "is no result of 'panto speed --json'|is not JSON|could not be read|.* its checksum does not fit"
    with pytest.raises(InputError, match=rf"bad\.json ({words})"):
        speed.speed([path])


@pytest.mark.slow
def test_markdown_is_printed_unbroken_and_says_where_cores_cannot_be_chosen(result, monkeypatch, capsys):
    monkeypatch.setattr(study, "run", lambda repeats, report: result)
    speed.speed(markdown=True)
    assert capsys.readouterr().out == "\n".join(tables.markdown([result]))
    speed.speed()
    assert "yardsticks" in capsys.readouterr().out
    monkeypatch.setattr(environments, "CAN_CHOOSE_CORES", False)
    assert environments.by_cores(1, lambda _: None) == []
    without = result | {"scaling": result["scaling"] | {"cores": []}}
    assert "does not let a process choose its cores" in tables.markdown([without])[1]
    assert not plot_speed(without).axes[3].lines


def test_two_forms_at_once_are_refused():
    with pytest.raises(InputError, match="one of --json and --markdown"):
        speed.speed(json=True, markdown=True)
