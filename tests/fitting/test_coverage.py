"""Coverage of fits: what its table counts, and that the documents have the table of the stored results."""

import json

import numpy as np
import pytest

from ..documents import ROOT
from .coverage import HEADINGS, SPANS, SPEEDS, design_of, diagnosed, records_of, table
from .later import LATER

STORED = ROOT / "docs" / "records-coverage"


def test_medians_and_shares_inside_are_counted_by_line_model_and_passes(tmp_path):
    row = {
        "line": "uniform",
        "seed": 0,
        "passes": 3,
        "wrong": "nothing",
        "settled": True,
        "as_noise": [0.5, 0.3],
        "tensions": [[1e-4, 1e-4], [-3e-4, 1e-4]],
        "droppers": [[1e-3, 1e-3], [2e-3, 1e-3], [-3e-3, 1e-3], [1e-3, 1e-3]],
        "supports": [[4e-3, 3e-3]],
        "damping": [[0.1, 0.2], [-0.3, 0.2]],
        "unevenness": [[1e-5, 1e-5]],
    }
    other = row | {"seed": 1, "as_noise": [0.5, 0.001], "supports": [[-6.1e-3, 3e-3]]}
    wrong = row | {"wrong": "drift"}
    (tmp_path / "uniform-drift-3.json").write_text(json.dumps([wrong]))
    (tmp_path / "uniform-nothing-3.json").write_text(json.dumps([row, other]))
    headings, _, right, drift = table(tmp_path)
    assert [cell.strip() for cell in headings.strip("|").split("|")] == list(HEADINGS)
    cells = "0.02, 50 % | 1.5, 50 % | 5.1, 50 % | 20, 100 % | 0.01, 100 % | 50 % |"
    assert right == f"| uniform | right | 3 | 2 | {cells}"
    cells = "0.02, 50 % | 1.5, 50 % | 4, 100 % | 20, 100 % | 0.01, 100 % | 0 % |"
    assert drift == f"| uniform | wrong: drift | 3 | 1 | {cells}"


def test_lines_of_all_kinds_are_counted_together_and_fits_that_call_themselves_good(tmp_path):
    names = ("tensions", "droppers", "supports", "damping", "unevenness")
    row = {"seed": 0, "passes": 3, "wrong": "nothing", "settled": True, "as_noise": [0.5]}
    good = row | {"line": "uniform"} | {name: [[1e-3, 1e-3]] for name in names}
    bad = row | {"line": "section"} | {name: [[3e-3, 1e-3]] for name in names}
    (tmp_path / "uniform-nothing-3.json").write_text(json.dumps([good]))
    (tmp_path / "section-nothing-3.json").write_text(json.dumps([bad | {"settled": False}]))
    cells = [[cell.strip() for cell in each.strip("|").split("|")] for each in list(table(tmp_path))[4:]]
    assert [each[:5] for each in cells] == [
        ["both", "right", "3", "2", "0.2, 50 %"],
        ["uniform, settled and like noise", "right", "3", "1", "0.1, 100 %"],
        ["both, settled and like noise", "right", "3", "1", "0.1, 100 %"],
    ]


def test_what_later_passes_show_is_counted(tmp_path):
    row = {"line": "section", "seed": 0, "passes": 3, "wrong": "grid"}
    seen = dict(zip(LATER, (True, False, True), strict=True))
    rows = [row | {"later": seen}, row | {"seed": 1, "later": seen}, row | {"seed": 2}]
    (tmp_path / "section-grid-3.json").write_text(json.dumps(rows))
    assert list(diagnosed(tmp_path))[2:] == ["| section | wrong: grid | 2 | 2 | 0 | 2 |"]


@pytest.mark.parametrize("line", ["uniform", "section"])
def test_records_are_those_of_sensors_on_lines_as_built(line):
    (record,) = records_of(0, 1, "nothing", line)
    faster = design_of(0, line).contact_wire.wave_speed / design_of(0, "uniform").contact_wire.wave_speed
    assert record.pieces[0].speed_kmh == pytest.approx(faster * SPEEDS[-1], rel=1e-3)
    (drifting,) = records_of(0, 1, "drift", line)
    change = drifting.pieces[0].force - 1.03 * record.pieces[0].force
    assert np.abs(change).max() == pytest.approx(8.0, rel=1e-3)


def test_records_from_the_midst_of_a_line_have_no_start_in_them():
    (record,) = records_of(0, 1, "nothing", "midst")
    (piece,) = record.pieces
    assert piece.position[0] == pytest.approx(64 * 60.0, abs=1.0)
    assert piece.length == pytest.approx(SPANS * 60.0, abs=2.0)


def test_later_passes_have_other_sensors_and_defects():
    healthy = {"speeds": (235.0,), "visit": 1}
    passes = [
        records_of(0, 3, "nothing", "uniform", **others)[0]
        for others in (healthy, healthy, healthy | {"visit": 2}, healthy | {"condition": {}})
    ]
    forces = [record.pieces[0].force for record in passes]
    assert [round(record.pieces[0].speed_kmh, 3) for record in passes] == 4 * [235.0]
    np.testing.assert_array_equal(forces[0], forces[1])
    assert all(np.abs(forces[0][:1000] - other[:1000]).max() > 1.0 for other in forces[2:])


def test_the_documents_have_the_table_of_the_stored_lines():
    text = (ROOT / "docs" / "records.md").read_text(encoding="utf-8")
    for rows in (list(table(STORED)), list(diagnosed(STORED))):
        assert len(rows) > 2
        assert [row for row in rows if row not in text] == []
