"""The masts of a line, by name and chainage, in every table and on every page that names a span."""

import pytest

from panto_env import Trajectory, simulate
from panto_env.analysis.line_check import check, span_tables
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.values import values_of
from panto_env.fitting.values import Design, Values
from panto_env.metrics.run_tables import droppers, of_spans
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import dropper_table
from panto_env.plant.line_condition import LINE_CONDITIONS
from panto_env.records.compare import compare, spans_table
from panto_env.records.judge import judge
from panto_env.records.measured import measured
from panto_env.report.findings import Findings
from panto_env.report.page import page

LENGTHS = (50, 60, 55, 65, 45, 62, 50, 65, 60, 40, 60, 55, 64, 50, 60, 50, 50, 60, 50, 60)
MASTS = [{"name": f"M{k:03}", "chainage": 12300.0 - 10 * k} for k in range(len(LENGTHS) + 1)]
TWELFTH = "12 (M011, 12+190.0)"


@pytest.fixture(scope="module")
def line():
    table = load_catenary("en50318-2002").model_dump(exclude={"sources", "spans"}, exclude_none=True)
    spans = [{"span_length": length} for length in LENGTHS]
    return FlexibleCatenaryData.model_validate(table | {"sequence": spans, "masts": MASTS})


@pytest.fixture(scope="module")
def run(line, tmp_path_factory):
    """A run, from its file."""
    path = tmp_path_factory.mktemp("runs") / "run.parquet"
    simulate(line, "dsa380", 200, accuracy="fast").save(path)
    return Trajectory.load(path)


@pytest.mark.longer
def test_tables_of_the_line_at_rest(line):
    found, name = check(line, 100.0), line.alignment().span_name
    for table in (*span_tables(found.spans, name), dropper_table(found.droppers, name)):
        assert TWELFTH in [cells[0] for cells in table.cells]


def test_values_of_a_line_have_a_row_each(line):
    assert [each.value for each in values_of(line) if each.key == "masts.12"] == [
        "name M011, chainage 12190.0"
    ]


def test_files_of_a_run(run):
    for sheet in (of_spans(run, (10, 12)), droppers([run], (10, 12))):
        assert {"M009", "M010", "M011"} == set(sheet.columns["mast"])
        assert {12210.0, 12200.0, 12190.0} == set(sheet.columns["chainage"])


@pytest.mark.longer
def test_the_page_of_a_run(run):
    text = page([Findings(run, "run.parquet")])
    assert text.count(f'<th scope="row">{TWELFTH}</th>') > 2  # figures and droppers
    assert "<!-- M011 -->" in text  # below its bar of uplift


def test_a_record_judged_and_compared(line, run):
    record = measured(run)
    assert [part.where for part in judge(record, line).of("span")][11].startswith(f"{TWELFTH}: 612 to 667 m")
    assert TWELFTH in [cells[0] for cells in spans_table(compare(record, run)).cells]


def test_values_of_a_fit(line):
    plan = Design(line, load_pantograph("dsa380"), LINE_CONDITIONS["as-built"], len(LENGTHS))
    names = [each.name for each in Values(plan, ("droppers", "supports"), (0.0, 2000.0)).all]
    assert f"dropper 1 of span {TWELFTH}" in names
    assert "support 11 (M011, 12+190.0)" in names


def test_masts_change_no_force(line, run):
    bare = line.model_copy(update={"masts": ()})
    assert line.alignment() == bare.alignment()  # so that both share what is computed once
    assert (simulate(bare, "dsa380", 200, accuracy="fast").contact_force == run.contact_force).all()
