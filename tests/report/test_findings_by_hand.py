"""What a report finds in runs that are made up, and which charts stand on its page."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from panto_env import InputError, simulate
from panto_env.base.plotting import series_colour
from panto_env.report import charts
from panto_env.report.findings import Findings, Folded
from panto_env.report.page import MOST, _title, page

from ..metrics.test_summary import RUN

SHORT = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
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


def test_a_run_without_whole_spans_hides_no_other(monkeypatch):
    axes, share = Figure().subplots(), np.linspace(0.0, 1.0, 5)
    monkeypatch.setattr(charts, "drawn", lambda draw: draw(axes))
    levels = (None, 100.0, None, 120.0)
    folded = [level and Folded(share, 0 * share + level, share + 90, share + 130) for level in levels]
    found = [Findings(RUN, "it") for _ in folded]
    for one, each in zip(found, folded, strict=True):
        one.__dict__["folded"] = each
    charts.force_folded({one: f"run {k}" for k, one in enumerate(found)})
    assert [line.get_label() for line in axes.lines] == ["run 1: median", "run 3: median"]
    assert [line.get_color() for line in axes.lines] == [series_colour(1), series_colour(3)]
    assert [line.get_ydata()[0] for line in axes.lines] == [100.0, 120.0]
