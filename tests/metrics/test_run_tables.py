"""A run, its figures and droppers as CSV and Excel, as pandas reads them."""

import pandas
import pytest

from panto_env import InputError, Trajectory, simulate
from panto_env.catalog import load_catenary
from panto_env.catalog.loader import FOLDERS
from panto_env.metrics.by_span import moving_droppers
from panto_env.metrics.figures import LABELS
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import save_droppers, save_figures
from panto_env.plant.catenary.flexible.static import droppers_at_rest

from ..command import panto
from .test_summary import RUN, replace


@pytest.fixture(scope="module")
def run():
    return simulate("re250", "dsa250", 160.0, accuracy="fast", distance=790.0)


@pytest.fixture(scope="module")
def book(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("book") / "run.xlsx"
    run.save(path)
    return pandas.read_excel(path, sheet_name=None)


def check_samples(frame, run):
    assert frame["time (s)"].to_numpy() == pytest.approx(run.time)
    assert frame["contact_force (N)"].to_numpy() == pytest.approx(run.contact_force)
    assert frame["head (m)"].to_numpy() == pytest.approx(run.head)
    assert frame["frame_velocity (m/s)"].to_numpy() == pytest.approx(run.frame_velocity)
    filtered = low_pass(run.contact_force, run.time_step)
    assert frame["contact_force_filtered to 20 Hz (N)"].to_numpy() == pytest.approx(filtered)
    assert frame["uplift at 650 m (m)"].to_numpy() == pytest.approx(run.uplift[:, 9], abs=1e-15)
    assert all(heading.endswith(")") for heading in frame), "a heading without unit"


@pytest.mark.longer
def test_csv_has_all_samples_with_units(run, tmp_path):
    run.save(tmp_path / "run.csv")
    frame = pandas.read_csv(tmp_path / "run.csv")
    check_samples(frame, run)
    assert run.dropper_position[7] == 70.0
    assert frame["dropper_force at 70 m (N)"].to_numpy() == pytest.approx(run.dropper_force[:, 7])


@pytest.mark.slow
def test_a_workbook_has_samples_figures_droppers_and_settings(run, book):
    assert list(book) == ["figures", "droppers", "run", "about"]
    check_samples(book["run"], run)
    figures = book["figures"].set_index("key")
    summary, criteria = run.summary(), {each.key: each for each in run.compliance()}
    assert list(figures.index[: len(LABELS)]) == list(LABELS)
    for key, label in LABELS.items():
        assert figures.loc[key, "value"] == pytest.approx(label.scale * getattr(summary, key))
        assert figures.loc[key, "unit"] == label.unit
    for key, criterion in criteria.items():
        row = figures.loc[key]
        assert row["verdict"] == criterion.verdict if criterion.verdict else pandas.isna(row["verdict"])
        for name in ("lowest", "highest"):
            if (limit := getattr(criterion, name)) is not None:
                assert row[name] == pytest.approx(limit)
                assert row["margin"] == pytest.approx(criterion.margin)
    assert figures["speed (km/h)"].eq(160).all()
    about = book["about"].set_index("name")["value"]
    assert about["catenary"] == "re250"
    assert about["power supply"] == "AC 15 kV"


@pytest.mark.longer
def test_droppers_at_rest_and_in_the_run_stand_side_by_side(run, book):
    frame = book["droppers"]
    moving, resting = moving_droppers(run), droppers_at_rest(load_catenary(run.catenary))
    assert frame["number"].tolist() == list(range(1, 8))
    assert frame["maximum force (N)"].tolist() == pytest.approx([each.largest for each in moving])
    assert frame["static force (N)"].tolist() == pytest.approx([each.static_force for each in resting])
    assert frame["length, unloaded (m)"].tolist() == pytest.approx([each.length for each in resting])
    assert (frame["maximum force (N)"] > frame["static force (N)"]).all()


def test_tables_of_several_runs_have_a_column_for_each_fact(run, tmp_path):
    slower = replace(run, speed=run.speed / 2, seed=3)
    save_figures([run, slower], tmp_path / "figures.csv", (10, 12))
    frame = pandas.read_csv(tmp_path / "figures.csv")
    assert sorted(set(frame["speed (km/h)"])) == pytest.approx([80, 160])
    assert set(frame["spans"]) == {"10-12"}
    ended = replace(run, terminated=True, ending="It ended.", seed=5)
    save_droppers([run, ended, slower], tmp_path / "droppers.csv")
    assert len(pandas.read_csv(tmp_path / "droppers.csv")) == 14
    for choice, seeds in ((None, {0}), ("all", {0, 5})):
        save_figures([run, ended], tmp_path / "figures.csv", choice)
        assert set(pandas.read_csv(tmp_path / "figures.csv")["seed"]) == seeds


def test_a_run_without_figures_is_saved_with_the_reason(tmp_path):
    ended = replace(RUN, terminated=True, ending="It ended early.")
    ended.save(tmp_path / "run.xlsx")
    book = pandas.read_excel(tmp_path / "run.xlsx", sheet_name=None)
    assert list(book) == ["run", "about"]
    reason = book["about"].set_index("name").loc["no figures because", "value"]
    assert reason.startswith("It ended early.")
    with pytest.raises(InputError, match="ended early"):
        save_figures([ended], tmp_path / "figures.csv")


@pytest.mark.longer
def test_only_parquet_is_read_again(run, tmp_path):
    run.save(tmp_path / "run.csv")
    with pytest.raises(InputError, match=r"read from its \.parquet file only"):
        Trajectory.load(tmp_path / "run.csv")
    with pytest.raises(InputError, match=r"must end in one of \.parquet, \.csv, \.xlsx"):
        run.save(tmp_path / "run.txt")


@pytest.mark.slow
def test_commands_write_them(tmp_path):
    light = ("--catenary", "re250", "--pantograph", "dsa250", "--speed", 160, "--output")
    files = ("--figures", "figures.xlsx", "--droppers", "droppers.csv")
    result = panto("simulate", *light, "run.parquet", *files, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    figures, droppers = tmp_path / "figures.xlsx", tmp_path / "droppers.csv"
    first = pandas.read_excel(figures), pandas.read_csv(droppers)
    figures.unlink()
    droppers.unlink()
    result = panto("report", "run.parquet", *files, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    for before, after in zip(first, (pandas.read_excel(figures), pandas.read_csv(droppers)), strict=True):
        pandas.testing.assert_frame_equal(before, after)
    run = Trajectory.load(tmp_path / "run.parquet")
    assert first[0].set_index("key").loc["std", "value"] == pytest.approx(run.summary().std)


def test_a_run_that_ends_early_still_ends_with_1_and_writes_no_figures(tmp_path):
    """Of a line with next to no room at its supports."""
    text = (FOLDERS["catenary"] / "en50318-2002.toml").read_text()
    assert "free_uplift = { value = 0.24" in text
    (tmp_path / "low.toml").write_text(
        text.replace("free_uplift = { value = 0.24", "free_uplift = { value = 0.02")
    )
    files = ("--figures", "figures.csv", "--droppers", "droppers.csv", "--output", "run.xlsx")
    result = panto("simulate", "--catenary", "low.toml", *files, cwd=tmp_path)
    assert result.returncode == 1, result.stderr
    assert "figures.csv is not written, since the run has no figures" in result.stderr
    assert sorted(each.name for each in tmp_path.iterdir()) == ["low.toml", "run.xlsx"]
