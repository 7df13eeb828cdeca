"""Charts of the page: contact force and uplift over place, spectrum; drawn once, then only given new data."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, HoverTool, Range1d
from bokeh.plotting import figure
from numpy.typing import ArrayLike

from ..base.plotting import BLUE, NEAR, ORANGE, VERMILION
from ..metrics.compliance import maximum_limit
from ..metrics.low_pass import amplitudes, zero_phase_low_pass
from ..report.charts import HIGHEST
from ..report.findings import Findings

COLOURS = {"passive": ORANGE, "policy": BLUE}  # colours of the two runs
RAW, SUPPORT, BLACK = "#c8ccd2", "#9aa3ad", "#1a1a1a"
LEGEND = {
    "without control": f"solid {ORANGE}",
    "with the policy": f"solid {BLUE}",
    "not filtered": f"solid {RAW}",
    "contact lost": f"dotted {VERMILION}",
    "0 N, and the limit where it is near": f"dashed {BLACK}",
    "supports; in the spectrum once per span": f"dashed {SUPPORT}",
}
"""What the charts show, and how."""
BAR = 0.3  # width of an uplift's bar over a span
Columns = dict[str, ArrayLike]


class Charts:
    """Three charts of a passive run and of the same under a policy."""

    def __init__(self) -> None:
        source: defaultdict[str, ColumnDataSource] = defaultdict(
            lambda: ColumnDataSource({"x": [], "y": [], "width": []})
        )
        self._sources = source
        self._limits = 0.0, 1.0
        self._place, self._newtons = Range1d(), Range1d()
        self.force = _chart("place (m)", "contact force (N)", 330, x_range=self._place, y_range=self._newtons)
        self.uplift = _chart("place (m)", "uplift at the supports (mm)", 240, x_range=self._place)
        self.spectrum = _chart("frequency (Hz)", "amplitude (N)", 240, x_range=Range1d(start=0, end=HIGHEST))
        self.force.line("x", "y", source=source["raw"], color=RAW)
        self.force.vspan("x", source=source["supports"], color=SUPPORT, line_dash="dashed")
        self.force.hspan("y", source=source["limits"], color=BLACK, line_dash="dashed")
        self.spectrum.vspan("x", source=source["per span"], color=SUPPORT, line_dash="dashed")
        for name, colour in COLOURS.items():
            own = self.force.line("x", "y", source=source[f"{name} force"], color=colour, line_width=2)
            tip = HoverTool(renderers=[own], tooltips=[(name, "@y{0.0} N at @x{0.0} m")], mode="vline")
            self.force.add_tools(tip)
            self.spectrum.line("x", "y", source=source[f"{name} spectrum"], color=colour, line_width=2)
            self.uplift.vbar("x", "width", "y", source=source[f"{name} uplift"], color=colour)
        self.force.scatter("x", "y", source=source["losses"], marker="square", color=VERMILION, size=7)

    def show(self, runs: Mapping[str, Findings]) -> None:
        """Draw runs by name, as ``COLOURS`` has them; what belongs to one run is that of the last one."""
        new: dict[str, Columns] = {}
        for name, one in runs.items():
            run, inside = one.run, one.inside
            smooth = zero_phase_low_pass(run.contact_force, run.time_step)[inside]
            new[f"{name} force"] = {"x": run.position[inside], "y": smooth}
            frequency, amplitude = amplitudes(run.contact_force[inside], run.time_step)
            shown = frequency <= HIGHEST
            new[f"{name} spectrum"] = {"x": frequency[shown], "y": amplitude[shown]}
            width = BAR * run.alignment.mean_length
            beside = width * (list(runs).index(name) - 0.5 * (len(runs) - 1))
            new[f"{name} uplift"] = {
                "x": [place + beside for _, place, _ in one.uplifts],
                "y": [1e3 * uplift for _, _, uplift in one.uplifts],
                "width": [width] * len(one.uplifts),
            }
        if runs:
            new |= self._surroundings(list(runs.values()))
        for name, source in self._sources.items():
            values = new.get(name, {})
            count = np.size(values.get("x", []))
            columns = {key: values.get(key, np.zeros(count)) for key in ("x", "y", "width")}
            source.data = {key: np.asarray(column, np.float32) for key, column in columns.items()}

    def _surroundings(self, runs: list[Findings]) -> dict[str, Columns]:
        """What is drawn besides curves, of the last run; the axes that fit them."""
        one, run = runs[-1], runs[-1].run
        place, force = run.position[one.inside], run.contact_force[one.inside]
        limit = maximum_limit(run.speed, run.line.system)
        forces = np.concatenate([each.run.contact_force[each.inside] for each in runs])
        top = max(1.0, forces.max(), limit if limit <= NEAR * forces.max() else 0.0)
        self._newtons.update(start=min(0.0, forces.min()) - 0.05 * top, end=1.06 * top)
        limits = run.alignment.limits(one.covered) if one.covered else (place[0], place[-1])
        if limits != self._limits:  # else a part that was zoomed into stays in view
            self._limits = limits
            begin, end = np.add(limits, np.array([-1, 1]) * BAR * run.alignment.mean_length)
            self._place.update(start=begin, end=end, reset_start=begin, reset_end=end)
        return {
            "raw": {"x": place, "y": force},
            "supports": {"x": run.alignment.supports_within(place[0], place[-1])},
            "limits": {"x": [0.0, 0.0], "y": [0.0, limit]},
            "losses": {"x": [loss.position for loss in one.losses]},
            "per span": {"x": [run.speed / run.alignment.mean_length]},
        }


def _chart(along: str, up: str, height: int, **ranges: Any) -> figure:
    chart = figure(
        height=height,
        sizing_mode="stretch_width",
        tools="xpan,xbox_zoom,xwheel_zoom,reset,save",
        active_drag="xbox_zoom",
        active_scroll=None,  # else the page could not be scrolled over a chart
        x_axis_label=along,
        y_axis_label=up,
        **{"y_range": DataRange1d(start=0)} | ranges,
    )
    chart.toolbar.logo = None
    chart.xgrid.visible = False
    return chart
