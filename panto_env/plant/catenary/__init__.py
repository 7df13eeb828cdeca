"""The catenaries: one model a file.

Each module provides the functions that ``Plant`` calls (``wave_speed``, ``line_length``, ``line_end``,
``build``, ``at_rest``, ``start_point``, ``settle``, ``supports``, ``droppers``) and overloads those of
``coupling`` for its own type of line. One whose line can have defects also has ``DefectiveLine``.
"""

from types import ModuleType

from .flexible import build as flexible
from .periodic_stiffness import build as periodic_stiffness
from .three_span import build as three_span

MODELS: dict[str, ModuleType] = {
    "flexible": flexible,
    "periodic_stiffness": periodic_stiffness,
    "three_span": three_span,
}
