"""The catenaries: one model a file.

Each module provides the functions that ``Plant`` calls (``wave_speed``, ``line_length``, ``line_end``,
``build``, ``at_rest``, ``start_point``, ``settle``, ``supports``, ``droppers``) and overloads those of
``coupling`` for its own type of line. One whose line can have defects also has ``DefectiveLine``.
"""

from types import ModuleType

from . import flexible, periodic_stiffness, three_span

MODELS: dict[str, ModuleType] = {
    "flexible": flexible,
    "periodic_stiffness": periodic_stiffness,
    "three_span": three_span,
}
