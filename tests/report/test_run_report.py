"""A report for engineers: it says what the run says, holds all it needs, and knows what it was made of."""

import html
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from panto_baselines.report.page import report as report_command
from panto_env import InputError, Trajectory, simulate
from panto_env.base.plotting import series_colour
from panto_env.catalog import load_catenary
from panto_env.cli import make_app
from panto_env.plant.catenary import CATENARIES
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity
from panto_env.plant.catenary.flexible.static import droppers_at_rest
from panto_env.report import charts
from panto_env.report.findings import Findings, Folded
from panto_env.report.page import LEFT_OUT, MOST, _title, page

from ..catalog.test_catalog import STEP, wire_stiffness
from ..metrics.test_summary import RUN
from ..pages import DOCS

HOSTILE = "<script>alert(1)</script>"
SHORT = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}


@pytest.fixture(scope="module")
def run():
    return simulate("en50318-2002", speed_kmh=300.0)


@pytest.fixture(scope="module")
def found(run):
    return Findings(run, "run.parquet")


@pytest.fixture(scope="module")
def file(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "run.parquet"
    run.save(path)
    return path


def linear_elasticity(line, spans):
    """Of the middle span, by finite elements of Hermite's, droppers never slack."""
    length = spans * line.span_length
    contact, messenger = (
        wire_stiffness(length, wire.tension, wire.bending_stiffness)
        for wire in (line.contact_wire, line.messenger_wire)
    )
    size = len(contact)
    whole = np.block([[contact, np.zeros_like(contact)], [np.zeros_like(contact), messenger]])
    for wire in range(2):
        for end in (0, size - 2):
            whole[wire * size + end, wire * size + end] += 1e12  # anchored
    for mast in range(1, spans):
        node = 2 * round(mast * line.span_length / STEP)
        whole[node, node] += line.steady_arm.stiffness
        whole[size + node, size + node] += line.support.stiffness
    for place in (k * line.span_length + x for k in range(spans) for x in line.droppers.positions):
        upper, lower = size + 2 * round(place / STEP), 2 * round(place / STEP)
        spring = line.droppers.stiffness * np.array([[1, -1], [-1, 1]])
        whole[np.ix_([upper, lower], [upper, lower])] += spring
    first = spans // 2 * line.span_length
    nodes = 2 * np.arange(round(first / STEP), round((first + line.span_length) / STEP) + 1)
    return STEP * np.arange(len(nodes)), np.linalg.inv(whole)[nodes, nodes]


def test_elasticity_is_that_of_finite_elements():
    line = load_catenary("en50318-2002")
    places, lifts = elasticity(line, 1.0)  # a force under which no dropper goes slack
    at, expected = linear_elasticity(line, 3)
    np.testing.assert_allclose(lifts, np.interp(places, at, expected), rtol=0.015)


def test_a_dropper_that_goes_slack_lets_the_wire_rise_further():
    line = load_catenary("en50318-2002")
    places, small = elasticity(line, 1.0)
    _, large = elasticity(line, 200.0)
    assert (large >= small - 1e-9).all()
    dropper = np.abs(places - line.droppers.positions[0]).argmin()
    assert large[dropper] > 1.1 * small[dropper]
    assert non_uniformity(np.array([0.2, 0.6])) == pytest.approx(50.0)


def test_what_is_found_is_what_the_run_says(run, found):
    figures = run.summary()
    assert found.figures == figures
    assert max(uplift for _, _, uplift in found.uplifts) == pytest.approx(figures.max_uplift)
    assert [number for number, _, _ in found.uplifts] == list(range(9, 20))
    lost = sum(loss.duration for loss in found.losses) / (run.inside().sum() * run.time_step)
    assert 100 * lost == pytest.approx(figures.contact_loss)
    folded, (first, last) = found.folded, found.covered
    for share in (0.0, 0.25, 0.75):
        places = [run.alignment.support(span - 1) + share * 60.0 for span in range(first, last + 1)]
        force, k = np.interp(places, run.position, found.filtered), np.abs(folded.share - share).argmin()
        assert folded.share[k] == share
        assert (folded.low[k], folded.high[k]) == pytest.approx((force.min(), force.max()))
        assert folded.median[k] == pytest.approx(np.median(force))
    assert folded.median.mean() == pytest.approx(figures.mean, rel=0.01)
    slack = next(each.value for each in run.compliance() if each.key == "slack")
    assert np.mean([dropper.slack for dropper in found.droppers]) == pytest.approx(slack, rel=0.02)
    assert [dropper.position for dropper in found.droppers] == pytest.approx(found.line.droppers.positions)


@pytest.mark.longer
def test_the_page_says_it_and_is_the_same_twice(found):
    text = page([found])
    assert page([Findings(found.run, "run.parquet")]) == text
    words = html.unescape(re.sub(r"<[^>]+>", " ", text))
    for value in ("span_length", "60.0", "own choice", "Reference line of EN 50318:2002", "20000.0"):
        assert value in words
    for criterion in found.run.compliance():
        assert criterion.name in words
    assert not re.findall(r"(?:src|href)=\"https?:", text)
    row, figures = re.search(r'<tr data-key="std">(.*?)</tr>', text, re.DOTALL)[1], found.figures
    value, margin = (float(re.search(rf'class="{name}">([-\d.]+)', row)[1]) for name in ("value", "margin"))
    assert (value, margin) == pytest.approx((figures.std, 0.3 * figures.mean - figures.std), abs=0.05)
    assert ("NOT KEPT" in row) == (figures.std > 0.3 * figures.mean)
    even = float(re.search(r'id="non-uniformity">([\d.]+)', text)[1])
    assert even == pytest.approx(found.elasticity[2], abs=0.05)
    assert text.count("<svg") == 5
    # What is left out is the same list in the documents and in every report.
    section = (DOCS / "validation.md").read_text(encoding="utf-8").split("## What the model leaves out\n\n")
    assert [" ".join(each.split()) for each in section[1].split("\n- ")[1:]] == list(LEFT_OUT)
    assert set(CATENARIES) == {
        "flexible",
        "three_span",
        "periodic_stiffness",
        "rig",
        "single",
    }  # no third rail
    shown = re.search(r'<ul id="left-out">(.*?)</ul>', text, re.DOTALL)[1]
    assert [html.unescape(each) for each in re.findall("<li>(.*?)</li>", shown)] == list(LEFT_OUT)
    # Lengths, forces and stretches of the line as designed, for each dropper of a span.
    table, resting = text[text.index('class="at-rest"') :], droppers_at_rest(found.line)
    rows = dict(re.findall(r'<tr><th scope="row">([^<]*)</th>(.*?)</tr>', table[: table.index("</table>")]))
    for row, values in (
        ("from the support (m)", [f"{each.position:.3f}" for each in resting]),
        ("length, unloaded (m)", [f"{each.length:.4f}" for each in resting]),
        ("static force (N)", [f"{each.static_force:.1f}" for each in resting]),
        ("stretch at rest (mm)", [f"{1e3 * each.stretch:.2f}" for each in resting]),
    ):
        assert re.findall(r"<td>(.*?)</td>", rows[row]) == values
    # In print headings stay with their tables.
    rules = text.partition("@media print")[2].partition("</style>")[0]
    for name in ("h2", "h3", "caption", "figcaption", "thead"):
        assert re.search(rf"\b{name}\b[^{{}}]*{{ break-after: avoid; }}", rules), name
    for name in ("#requirements", "#figures", "#losses", ".uplift", ".droppers", ".at-rest"):
        assert re.search(rf"{name}\b[^{{}}]*{{ break-inside: avoid; }}", rules), name


@pytest.mark.longer
def test_several_runs_stand_side_by_side(run, file, tmp_path):
    slow = replace(run, speed=250 / 3.6, contact_force=0.9 * run.contact_force)
    slow.save(tmp_path / "slow.parquet")
    result = CliRunner().invoke(make_app(), ["report", str(tmp_path / "slow.parquet"), str(file)])
    assert result.exit_code == 0, result.output
    text = (tmp_path / "slow.html").read_text(encoding="utf-8")
    assert "250 km/h</th><th>300 km/h" in text
    row = re.search(r'<tr data-key="mean"><th scope="row">mean force F_m</th>(.*?)</tr>', text, re.DOTALL)[1]
    shown = [float(each) for each in re.findall(r"<td>([\d.]+)</td>", row)]
    assert shown == pytest.approx([slow.summary().mean, run.summary().mean], abs=0.005)


def test_the_report_is_of_the_line_that_was_run_whatever_its_file_says_now(tmp_path):
    source = (DOCS.parent / "panto_env/catalog/catenaries/en50318-2002.toml").read_text(encoding="utf-8")
    without_wires = page(
        [Findings(simulate("periodic-stiffness", "three-mass", 200.0, distance=200.0), "run.parquet")]
    )
    assert "mean_stiffness" in without_wires
    assert "Elasticity" not in without_wires
    mine = tmp_path / "mine.toml"
    mine.write_text(source, encoding="utf-8")
    simulate(str(mine), speed_kmh=300.0, distance=300.0).save(tmp_path / "run.parquet")
    mine.unlink()
    found = Findings(Trajectory.load(tmp_path / "run.parquet"), "run.parquet")
    assert found.line.span_length == 60.0
    assert found.line.name == "mine"


@pytest.mark.longer
def test_names_and_descriptions_are_escaped(run):
    """Of a run that ended early, which is reported as such."""
    design = {part: {**values, "description": HOSTILE} for part, values in run.design.items()}
    ended = {"terminated": True, "ending": "The run ended early at 10 m: it was bad."}
    text = page([Findings(replace(run, design=design, policy=HOSTILE, **ended), HOSTILE)])
    assert HOSTILE not in text
    assert html.escape(HOSTILE) in text
    assert "The run ended early at 10 m: it was bad. It has no figures." in text
    assert "None: no run has figures." in text


def test_what_is_no_run_is_refused_in_a_sentence(run, file, tmp_path):
    old = replace(run, design={})
    with pytest.raises(InputError, match="was written by an older version, without its line"):
        page([Findings(old, "old.parquet")])
    odd = tmp_path / "odd.json"
    for files, words in (
        ([file, odd], "either runs (.parquet) or results of the benchmark (.json), not both"),
        ([tmp_path / "run.txt"], "run.txt: give either runs"),
        ([tmp_path / "gone.parquet"], "does not exist"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            report_command(files, None)


@pytest.mark.longer
def test_runs_that_share_a_name_stay_apart(run):
    """A line's file edited between two runs, and runs that differ in what their names do not tell."""
    softer = {**run.design["catenary"], "span_length": 61.0}
    edited = replace(run, design={**run.design, "catenary": softer})
    without = replace(run, dropper_position=run.dropper_position[:0], dropper_force=run.dropper_force[:, :0])
    text = html.unescape(page([Findings(run, "a"), Findings(without, "b"), Findings(edited, "c")]))
    headings = re.findall(r"<h3>(.*?)</h3>", text)
    assert headings == ["en50318-2002 (a, b)", "en50318-2002 (c)", "en50318-2002"]
    captions = re.findall(r"<caption>(.*?): droppers of", text)
    assert captions == ["300 km/h (a)", "300 km/h (c)"]
    values = re.findall(r"<code>span_length</code></th><td[^>]*>([\d.]+)<", text)
    assert values == ["60.0", "61.0"]


CHARTS = ("force_along", "force_folded", "spectrum", "uplifts", "stiffness")


def alone(**facts):
    """A run of four spans of 5 m: the whole of it, since its usual spans would begin with the tenth."""
    return Findings(replace(RUN, **facts), "it.parquet")


def test_what_is_found_in_a_run_of_four_spans():
    """Samples every 0.5 m from 0.25 m on; the supports at 5, 10 and 15 m rise by up to 239, 139 and 39 mm."""
    one = alone()
    assert (one.covered, one.figures, one.criteria, one.folded, one.by_span) == (None, None, [], None, [])
    assert one.inside.all()
    force = np.full(40, 100.0)
    force[[3, 4, 5, 39]] = 0.0, -2.0, 0.0, 0.0
    lost = alone(contact_force=force).losses
    assert [(loss.position, loss.duration) for loss in lost] == [
        (pytest.approx(1.75), pytest.approx(0.03)),
        (pytest.approx(19.75), pytest.approx(0.01)),
    ]
    assert [(k, place) for k, place, _ in one.uplifts] == [(1, 5.0), (2, 10.0), (3, 15.0)]
    assert [uplift for *_, uplift in one.uplifts] == pytest.approx([0.239, 0.139, 0.039])
    assert [k for k, *_ in alone(uplift=RUN.uplift[:, :2]).uplifts] == [1, 2]


@pytest.fixture(scope="module")
def whole():
    return Findings(simulate(**SHORT), "whole.parquet")


@pytest.fixture(scope="module")
def short():
    return Findings(simulate(**SHORT, distance=120.0), "short.parquet")


@pytest.fixture
def drawn(monkeypatch):
    """Charts that are only their names, with those of the runs that they were given."""
    for name in CHARTS:

        def told(given, *_, name=name):
            files = [one.file for one in given] if isinstance(given, dict) else [given.file]
            return f"{name}:{','.join(files)};"

        monkeypatch.setattr(charts, name, told)


def test_charts_stand_on_the_page_of_runs_that_have_them(whole, short, drawn):
    assert (short.figures, whole.figures is None) == (None, False)
    np.testing.assert_allclose(whole.folded.share, np.arange(240) / 240)
    of_short, of_whole = "force_along:short.parquet;", "force_along:whole.parquet;"
    judged = ["force_folded:whole.parquet;", "spectrum:whole.parquet;"]
    for runs, shown in (
        ([whole], [of_whole, *judged]), ([short], [of_short]), ([short, whole], [of_short, of_whole, *judged])
    ):  # fmt: skip
        text = page(runs)
        assert [each for each in shown if each in text] == shown
        assert sum(text.count(f"{name}:") for name in CHARTS) == len(shown)


@pytest.mark.longer
def test_a_page_holds_one_to_eight_runs(short, drawn):
    assert MOST == 8
    names = [f"{k}.parquet" for k in range(9)]
    runs = [Findings(short.run, name) for name in names]
    assert all(f"force_along:{name};" in page(runs[:8]) for name in names[:8])
    for count in (0, 9):
        with pytest.raises(InputError, match=f"^A report shows 1 to 8 runs, not {count}\\.$"):
            page(runs[:count])


def test_titles_and_names_tell_runs_apart():
    def of(file, **facts):
        usual = {"catenary": "a", "pantograph": "b", "speed_kmh": 250.0, "policy": "passive", "seed": 0}
        known = usual | facts
        return Findings(SimpleNamespace(**known, pantographs=known["pantograph"]), file)

    runs = [of("1"), of("2", speed_kmh=80.5), of("3", pantograph="c")]
    assert _title(runs) == "b on a, c on a at 80.5, 250 km/h"
    assert [*charts.names_of(runs).values()] == ["b, 250 km/h", "b, 80.5 km/h", "c, 250 km/h"]
    assert [*charts.names_of(runs[:1]).values()] == ["250 km/h"]
    assert [*charts.names_of([of("1"), of("2")]).values()] == ["250 km/h (1)", "250 km/h (2)"]
    assert [*charts.names_of([of("1"), of("2", seed=3)]).values()] == ["seed 0", "seed 3"]
    same = [of("1"), of("2", policy="pd"), of("3", policy="pd")]
    assert [*charts.names_of(same).values()] == ["passive (1)", "pd (2)", "pd (3)"]


def test_a_run_without_whole_spans_hides_no_other():
    axes, share = Figure().subplots(), np.linspace(0.0, 1.0, 5)
    levels = (None, 100.0, None, 120.0)
    folded = [level and Folded(share, 0 * share + level, share + 90, share + 130) for level in levels]
    found = [Findings(RUN, "it") for _ in folded]
    for one, each in zip(found, folded, strict=True):
        one.__dict__["folded"] = each
    charts.force_folded.__wrapped__(axes, {one: f"run {k}" for k, one in enumerate(found)})
    assert [line.get_label() for line in axes.lines] == ["run 1: median", "run 3: median"]
    assert [line.get_color() for line in axes.lines] == [series_colour(1), series_colour(3)]
    assert [line.get_ydata()[0] for line in axes.lines] == [100.0, 120.0]
