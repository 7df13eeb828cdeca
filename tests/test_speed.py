"""``panto speed``: every row is measured, and the documents hold what it prints."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import panto_env
from panto_env.base import machine
from panto_env.base.errors import InputError
from panto_env.cli import speed
from panto_env.studies.throughput import environments, study, tables
from panto_env.studies.throughput.plots import plot_speed

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
    return json.loads(told.stdout)


def test_every_plant_and_environment_is_measured(result):
    plants = {"en50318-2002", "periodic-stiffness", "ohl-three-span"}
    assert {row["catenary"] for row in result["plants"]} == plants
    assert all(row["times_real_time"] > 1 for row in result["plants"])
    assert {"Pendulum-v1", "CartPole-v1"} < {row["id"] for row in result["environments"]}


def test_cost_is_measured_over_spans_modes_grid_and_cores(result):
    scaling = result["scaling"]
    assert [row["spans"] for row in scaling["spans"]] == [3, 5, 8, 10, 12]
    assert [row["modes"] for row in scaling["modes"]] == [10, 20, 40, 80]
    assert {row["catenary"] for row in scaling["modes"]} == {"ohl-three-span"}
    assert len({(r["speed_kmh"], r["accuracy"], r["precision"]) for r in scaling["discretisation"]}) == 8
    if machine.CAN_CHOOSE_CORES:
        counts = {row["cores"] for row in scaling["cores"]}
        assert {1, machine.cores()} <= counts
        assert len(scaling["cores"]) == len(environments.SHARED) * len(counts)


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


def shape(text):
    """Lines with figures masked and the machine left out; cores may differ, so equal lines count once."""
    masked = [re.sub(r"\d[\d,.]*(e[+-]\d+)?", "#", line) for line in text.splitlines()]
    masked = [line.replace("cores", "core") for line in masked if "medians of" not in line]
    return [line for k, line in enumerate(masked) if line and line not in masked[:k]]


@chooses_cores
@pytest.mark.parametrize(("document", "section"), [("README.md", 0), ("docs/speed.md", 1)])
def test_documents_hold_what_the_command_prints(result, document, section):
    text = (ROOT / document).read_text(encoding="utf-8")
    begin, end = tables.BEGIN, tables.END
    assert text.count(begin) == 1
    block = begin + text.partition(begin)[2].partition(end)[0] + end
    assert shape(block) == shape(tables.markdown(result)[section])


def test_markdown_is_printed_unbroken(result, monkeypatch, capsys):
    monkeypatch.setattr(study, "run", lambda repeats, report: result)
    speed.speed(markdown=True)
    assert capsys.readouterr().out == "\n".join(tables.markdown(result))
    speed.speed()
    assert "yardstick" in capsys.readouterr().out


def test_where_cores_cannot_be_chosen_a_sentence_says_so(result, monkeypatch):
    monkeypatch.setattr(environments, "CAN_CHOOSE_CORES", False)
    assert environments.by_cores(1, lambda _: None) == []
    without = result | {"scaling": result["scaling"] | {"cores": []}}
    assert "does not let a process choose its cores" in tables.markdown(without)[1]
    assert not plot_speed(without).axes[3].lines


def test_two_forms_at_once_are_refused():
    with pytest.raises(InputError, match="one of --json and --markdown"):
        speed.speed(json=True, markdown=True)
