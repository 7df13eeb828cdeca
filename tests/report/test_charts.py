"""Charts of several runs: each that has something to show is in them, whichever stands before it."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from panto_env.base.plotting import series_colour
from panto_env.report import charts


class Found:
    """Findings of a run, as far as the force over the place within a span needs them."""

    def __init__(self, level=None):
        self.folded = None if level is None else Folded(level)


class Folded:
    def __init__(self, level):
        self.share = np.linspace(0.0, 1.0, 5)
        self.median, self.low, self.high = (np.full(5, level + by) for by in (0.0, -10.0, 10.0))


@pytest.fixture
def axes(monkeypatch):
    """Axes on which what is drawn stays."""
    axes = Figure().subplots()

    def drawn(draw, *_, **__):
        draw(axes)
        return ""

    monkeypatch.setattr(charts, "drawn", drawn)
    return axes


@pytest.mark.parametrize(
    "levels", [(100.0, None, 120.0), (None, 100.0, 120.0), (100.0, 120.0, None), (None, None, 90.0)]
)
def test_a_run_without_whole_spans_hides_no_other(axes, levels):
    names = {Found(level): f"run {k}" for k, level in enumerate(levels)}
    charts.force_folded(names)
    shown = [k for k, level in enumerate(levels) if level is not None]
    assert [line.get_label() for line in axes.lines] == [f"run {k}: median" for k in shown]
    assert [line.get_color() for line in axes.lines] == [series_colour(k) for k in shown]
    for line, k in zip(axes.lines, shown, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), levels[k])
        np.testing.assert_array_equal(line.get_xdata(), np.linspace(0.0, 1.0, 5))
    assert len(axes.collections) == len(shown)
    for band, k in zip(axes.collections, shown, strict=True):
        heights = band.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (levels[k] - 10.0, levels[k] + 10.0)
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_ylabel() == "contact force,\nlow-passed at 20 Hz (N)"
