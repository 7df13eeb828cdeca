"""A train in a report, in tables for other programs and in the plot of a run: each pantograph is there."""

import csv
import html
import re
from dataclasses import replace

import numpy as np
import pytest
from openpyxl import load_workbook

from panto_env import InputError, Trajectory, report, simulate
from panto_env.analysis.plots import plot_run
from panto_env.metrics.low_pass import low_pass
from panto_env.metrics.run_tables import save_figures
from panto_env.report.findings import Findings
from panto_env.report.page import page

DISTANCE = 70.0


@pytest.fixture(scope="module")
def run():
    pair = ["en50318-2002", "dsa250"]
    return simulate("en50318-2002", pantographs=pair, distances=[DISTANCE], speed_kmh=250.0, policy="p",
                    controlled=[2])  # fmt: skip


@pytest.fixture(scope="module")
def file(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("trains") / "train.parquet"
    run.save(path)
    return path


def cells(text, table, key):
    rows = re.search(rf'<table id="{table}">(.*?)</table>', text, re.DOTALL)[1]
    row = re.search(rf'<tr data-key="{key}">(.*?)</tr>', rows, re.DOTALL)[1]
    return [float(each) for each in re.findall(r'(?:<td>|class="value">)([\d.]+)<', row)]


@pytest.mark.longer
def test_a_report_has_a_column_and_a_picture_for_each_pantograph(run, file, tmp_path):
    report.save([file], tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    covered = run.train[-1].spans()
    figures = [own.summary(covered) for own in run.train]
    assert cells(text, "figures", "mean") == pytest.approx([each.mean for each in figures], abs=0.005)
    assert cells(text, "requirements", "std") == pytest.approx([each.std for each in figures], abs=0.05)
    assert "<th>1 en50318-2002, passive</th><th>2 dsa250, p</th>" in text
    captions = [html.unescape(each) for each in re.findall("<figcaption>(.*?)</figcaption>", text)]
    assert captions[0].startswith("All pantographs of train.parquet")
    assert captions[0].endswith("distances behind the first: 70 m")
    assert [each.partition(":")[0] for each in captions[1:3]] == ["1 en50318-2002, passive", "2 dsa250, p"]
    assert text.count("<svg") == 7  # together, each, folded, spectrum, uplift, elasticity
    assert text.count("<details") == 1
    headings = re.findall(r"<h3>(.*?)</h3>", text)
    assert headings == ["en50318-2002", "en50318-2002 (train.parquet)", "dsa250 (train.parquet)"]


def test_pantographs_of_trains_count_as_runs(run):
    found = Findings.of(run, "train.parquet")
    assert [one.leads for one in found] == [True, False]
    with pytest.raises(InputError, match="1 to 8 runs, not 10, each pantograph of a train counted"):
        page(found * 5)


@pytest.mark.longer
def test_samples_of_each_have_its_number_in_the_heading(run, tmp_path):
    run.save(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    follower = run.followers[0]
    before = len(run.time) - len(follower.time)
    assert before > 100
    force = [row["contact_force of pantograph 2 (N)"] for row in rows]
    assert set(force[:before]) == {""}
    np.testing.assert_allclose(np.array(force[before:], dtype=float), follower.contact_force)
    filtered = [row["contact_force_filtered of pantograph 2 to 20 Hz (N)"] for row in rows][before:]
    expected = low_pass(follower.contact_force, run.time_step)
    np.testing.assert_allclose(np.array(filtered, dtype=float), expected)
    np.testing.assert_allclose([float(row["contact_force (N)"]) for row in rows], run.contact_force)


@pytest.mark.slow
def test_a_workbook_has_figures_and_droppers_of_each(run, tmp_path):
    run.save(tmp_path / "t.xlsx")
    book = load_workbook(tmp_path / "t.xlsx", read_only=True)
    covered = run.train[-1].spans()
    for sheet in ("figures", "droppers"):
        heading, *rows = list(book[sheet].iter_rows(values_only=True))
        number, name = heading.index("pantograph_number"), heading.index("pantograph")
        assert {(row[number], row[name]) for row in rows} == {(1, "en50318-2002"), (2, "dsa250")}
    heading, *rows = list(book["figures"].iter_rows(values_only=True))
    of_std = {
        row[heading.index("pantograph_number")]: row[heading.index("value")] for row in rows if "std" in row
    }
    assert of_std == pytest.approx({k + 1: own.summary(covered).std for k, own in enumerate(run.train)})
    about = dict(book["about"].iter_rows(values_only=True))
    assert (about["pantograph 2"], about["policy 2"]) == ("dsa250", "p")


def test_runs_of_one_pantograph_and_trains_share_a_table(run, tmp_path):
    alone = replace(run, followers=())
    save_figures([alone, run], tmp_path / "f.csv")
    with (tmp_path / "f.csv").open(encoding="utf-8-sig") as file:
        rows = [row for row in csv.DictReader(file) if row["key"] == "mean"]
    names = [(row["pantograph"], row["pantograph_number"]) for row in rows]
    assert names == [("en50318-2002", "1"), ("en50318-2002", "1"), ("dsa250", "2")]


@pytest.mark.longer
def test_a_saved_train_is_whole_when_it_is_read(run, file):
    read = Trajectory.load(file)
    for own, other in zip(run.train, read.train, strict=True):
        np.testing.assert_array_equal(own.contact_force, other.contact_force)
        assert (own.pantograph, own.policy, own.distance) == (other.pantograph, other.policy, other.distance)


def test_the_plot_has_the_force_of_each_by_place(run):
    figure = plot_run(run)
    contacts = figure.axes[:2]
    assert [axis.get_ylabel() for axis in contacts] == [
        "pantograph 1, en50318-2002\ncontact force (N)",
        "pantograph 2, dsa250\ncontact force (N)",
    ]
    covered = run.train[-1].spans()
    for axis, own in zip(contacts, run.train, strict=True):
        raw = next(line for line in axis.lines if line.get_label() == "raw")
        inside = own.inside(covered)
        np.testing.assert_array_equal(raw.get_xdata(), own.position[inside])
        np.testing.assert_array_equal(raw.get_ydata(), own.contact_force[inside])
    assert {line.get_label() for line in figure.axes[2].lines} >= {"head, pantograph 1", "head, pantograph 2"}
    assert "on the frame, pantograph 2" in {line.get_label() for line in figure.axes[3].lines}
    assert "on the frame, pantograph 1" not in {line.get_label() for line in figure.axes[3].lines}
