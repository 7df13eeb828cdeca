import json

import pytest

from panto_env import simulate
from panto_env.cli import studies as validate
from panto_env.plant.numerics import Numerics
from panto_env.studies.en50318 import conditions as wear
from panto_env.studies.en50318 import reference
from panto_env.studies.en50318 import study as tables
from panto_env.studies.en50318.lines import LineCheck

from ..finite_element import __main__ as comparison


def test_numerics_in_use_are_those_that_a_run_takes():
    used = reference.in_use(Numerics(), 300.0)
    assert (used.spacing, used.time_step) == pytest.approx((60 / 192, 1e-2 / 6))
    default, told = simulate(distance=120.0), simulate(distance=120.0, **used.model_dump())
    assert default.time_step == used.time_step
    assert (default.contact_force == told.contact_force).all()
    asked = Numerics(spacing=0.25, time_step=1e-3, window=9, precision="double")
    assert reference.in_use(asked, 300.0) == asked


@pytest.fixture
def short(monkeypatch):
    """Tables of one row."""
    monkeypatch.setattr(reference, "DISCRETISATIONS", (Numerics(),))
    monkeypatch.setattr(reference, "CONVERGENCE_KMH", (300.0,))
    monkeypatch.setattr(wear, "CONDITIONS", wear.CONDITIONS[:1])
    monkeypatch.setattr(wear, "DISCRETISATIONS", (Numerics(),))
    monkeypatch.setattr(wear, "SEEDS", 2)


def row_of(output, first):
    """Cells of the row of a table whose first cell is given."""
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in output.splitlines()]
    return next(row for row in rows if row[0] == first)


@pytest.mark.longer
def test_tables_name_the_grid_and_step_of_the_default(short, capsys, monkeypatch):
    monkeypatch.setattr(validate.console, "_width", 150)
    validate.validate(convergence=True, wear=True)
    printed = capsys.readouterr().out
    assert row_of(printed, "300")[1:5] == ["0.312", "1.67", "8", "single"]
    assert row_of(printed, "0.8")[1:5] == ["0.5", "0.312", "1.67", "5.8"]


@pytest.mark.longer
def test_json_holds_the_same_tables(short, capsys):
    validate.validate(convergence=True, wear=True, json=True)
    told = json.loads(capsys.readouterr().out)
    (converged,), (worn,) = told["convergence"], told["wear"]
    assert (converged["spacing"], converged["time_step"]) == pytest.approx((60 / 192, 1e-2 / 6))
    assert worn["time_step"] == pytest.approx(0.01 / 6)
    assert converged["std"] == simulate(spans=reference.LINE_SPANS).summary(reference.SPANS).std
    assert worn["std"][1] > 0


def test_finite_elements_are_compared_with_the_default_s_grid_and_step(monkeypatch, capsys):
    monkeypatch.setattr(comparison, "FINITE_ELEMENTS", ())
    monkeypatch.setattr(comparison, "OURS", (Numerics(),))
    monkeypatch.setenv("COLUMNS", "120")
    comparison.main()
    assert row_of(capsys.readouterr().out, "300")[1:4] == ["finite differences", "0.312", "1.67"]


@pytest.mark.slow
def test_a_worn_line_has_its_contact_loss_by_default_and_its_low_passed_figures_on_any_grid():
    """What docs/conditions.md says of waves of 0.8 m, of the preset's depth and of 2 mm, and of 0.4 m."""
    fine, full, fast = wear.DISCRETISATIONS
    for condition in wear.CONDITIONS:
        true, ours, coarse = (wear.check_wear(condition, each) for each in (fine, full, fast))
        for other in (ours, coarse):
            assert other.std[0] == pytest.approx(true.std[0], rel=0.01)
            assert other.max[0] == pytest.approx(true.max[0], abs=1.5)
            assert other.min[0] == pytest.approx(true.min[0], abs=1.5)
        assert ours.contact_loss[0] == pytest.approx(true.contact_loss[0], abs=0.1)
        assert ours.steps >= (8 if ours.depth > 0.5e-3 else 4)


def test_errors_of_lines_are_shown_with_the_largest_by_warning():
    def check(name, drawn, warned, std):
        errors = {} if std is None else dict.fromkeys(("max", "min", "contact_loss"), 0.1)
        figures = {} if std is None else {"mean": 100.0, "converged": 30.0, "std": std} | errors
        return LineCheck(name, "dsa380", 200.0, 0.5, drawn, "full", 0.3, 1e-3, warned, **figures)

    checks = [
        check("re250", False, False, -0.7),
        check("re250", False, False, 0.2),
        check("seed 4", True, True, 3.0),
        check("seed 5", True, False, None),
    ]
    rows = tables.lines_table(checks).rows
    assert [row[2] for row in rows] == ["full", "full", "full, warned", "full"]
    assert [row[5] for row in rows] == ["30.00", "30.00", "30.00", "ended early"]
    assert tables.largest_table(checks).rows == [
        ("catalogue", "full", "no", "2", "0", "0.70", "0.10", "0.10", "0.10"),
        ("drawn", "full", "yes", "1", "1", "3.00", "0.10", "0.10", "0.10"),
    ]
