"""docs/benchmark.md and the stored results: tables are those of the results, results those of the tracks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from panto_baselines.benchmark.settings import BenchmarkSettings, load_benchmark
from panto_baselines.oracle.stored import stored_changes
from panto_baselines.report.result import read_result
from panto_baselines.report.tables import summary
from panto_configs import names

from ..pages import DOCS, tables_of

TRACKS = [name for name in names("benchmark") if name.startswith("benchmark/") and name != "benchmark/ideal"]
"""All but that for the curious, which `make benchmark` leaves out."""


@pytest.mark.parametrize("track", TRACKS)
def test_its_tables_are_those_of_the_results(track):
    table = summary(read_result(DOCS / f"{track}.json"))
    headings, rows = tables_of("benchmark.md")[table.title]
    assert tuple(headings) == table.headings
    assert [tuple(row) for row in rows] == table.cells


@pytest.mark.parametrize("track", TRACKS)
def test_stored_results_are_of_the_tracks_as_they_are(track):
    stored = json.loads((DOCS / f"{track}.json").read_text(encoding="utf-8"))
    # Values that came later have in older results the default with which these were made.
    settings = BenchmarkSettings.model_validate(stored["settings"])
    assert settings.model_dump(mode="json") == load_benchmark(track).model_dump(mode="json")


def test_the_page_of_all_has_every_track():
    page = (DOCS / "benchmark" / "index.html").read_text(encoding="utf-8")
    for track in TRACKS:
        assert load_benchmark(track).title in page


def test_the_makefile_runs_the_same_tracks():
    lines = (Path(__file__).parents[2] / "Makefile").read_text(encoding="utf-8").splitlines()
    told = next(line for line in lines if line.startswith("TRACKS := ")).split()[2:]
    assert {f"benchmark/{name}" for name in told} == set(TRACKS)


def test_an_oracle_is_stored_for_every_cell_of_the_known_line():
    for cell in read_result(DOCS / "benchmark" / "known-line.json").cells:
        if cell.policy == "fitted-fb+ff":
            assert cell.oracle_share is not None
            given = {"catenary": cell.catenary, "pantograph": cell.pantograph, "speed_kmh": cell.speed_kmh}
            realistic = given | {"actuator": "realistic", "line_condition": "smooth"}
            assert cell.oracle == pytest.approx(stored_changes(realistic, (10, 19))[0])
