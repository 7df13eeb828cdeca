"""A picture of a running episode."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .analysis.plots import say_what_is_hidden
from .metrics.trajectory import Trajectory


def picture(run: Trajectory) -> NDArray[np.uint8]:
    """The last two spans of a run as an RGB image, (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), dpi=80, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    force, height = figure.subplots(2, 1, sharex=True)
    reach = 2 * run.span_length
    end = max(float(run.position[-1]) if len(run.position) else 0.0, reach)
    near = run.position > end - reach
    force.plot(run.position[near], run.contact_force[near], color="tab:blue", label="contact force")
    actuator = run.frame_force + run.head_force
    force.plot(run.position[near], actuator[near], color="tab:green", label="actuator force")
    force.axhline(run.nominal_force, color="0.6", linestyle=":", label="nominal force")
    force.set(ylabel="force (N)", ylim=(-150, 400), title=f"{run.catenary}, {run.speed_kmh:.0f} km/h")
    force.legend(loc="upper left", ncols=3, fontsize="small")
    height.plot(run.position[near], 1e3 * run.wire[near], color="tab:red", label="contact wire")
    height.plot(run.position[near], 1e3 * run.head[near], color="tab:blue", label="collector head")
    height.set(xlabel="position (m)", ylabel="height (mm)", xlim=(end - reach, end), ylim=(-60, 200))
    height.legend(loc="upper left", ncols=2, fontsize="small")
    for axis in (force, height):
        say_what_is_hidden(axis)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3].copy()
