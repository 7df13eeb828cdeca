"""Flexible catenary: two tensioned beams, droppers that go slack, supports and steady arms.

Motion is computed about the static shape by finite differences on a uniform grid, with an explicit
leapfrog in time, whose seven-point stencil is fitted to the frequencies of a wire's own waves. Point loads
and droppers act through four nodes by cubic interpolation; what the grid's wires yield less than real ones
under a point load is in the compliance of droppers and contact. Droppers pull by their extension at the
middle of a step. Other local springs (supports, steady arms) act by the mean of two half-steps, which is
(1/4, 1/2, 1/4) over three time levels, each implicitly on its own: they conserve energy and do not bound the
step.

The grid covers a window that travels with the train a span at a time, as paper 2's model does. Its ends
are anchors where the line ends and absorb waves elsewhere. A window of all spans is the whole line.
"""

from ..protocol import CatenaryKind
from . import step as step
from .model import FlexibleCatenary
from .resolution import clear_spans, warn_if_short
from .schema import FlexibleCatenaryData
from .static import hang

__all__ = ["KIND", "FlexibleCatenary", "FlexibleCatenaryData"]

KIND = CatenaryKind(
    FlexibleCatenaryData, FlexibleCatenary, hang, clear_spans, warn_if_short, several_collectors=True
)
