"""The program of a rig's real-time computer: measured force in, displacement to command out."""

from __future__ import annotations

import math
from typing import Any

from ..backend import bind, pack
from ..base.arrays import from_kmh
from ..base.errors import InputError
from ..catalog import load_catenary
from ..plant.catenary.protocol import check_speeds
from ..plant.catenary.rig import Rig, RigData
from ..plant.catenary.rig.arrays import RigRow
from ..plant.catenary.rig.computer import sample
from ..plant.line_condition import DrawnLine, LineCondition
from ..plant.numerics import Numerics, Runs
from ..plant.valid_range import Ending, reason


def load_rig(source: Any) -> RigData:
    """A rig of the catalogue, of a TOML file, or already loaded. Raises InputError for what is no rig."""
    data = load_catenary(source)
    if not isinstance(data, RigData):
        raise InputError(f"'{data.name}' is a line and not a rig; take a rig, such as 'rig-flexible'.")
    return data


class RigComputer:
    """Computes, sample by sample, where a line's contact point is under the force that is measured.

    ``step`` is to be called once in each sampling interval of the rig's computer. It allocates nothing that
    lasts and does the same work at each call, wherever the train is; memory does not grow. It goes through a
    compiled kernel, which ``__init__`` compiles or reads from disk, so that no call waits for that.
    """

    def __init__(
        self,
        rig: Any,
        speed_kmh: float,
        *,
        force: float,
        spans: int | None = None,
        numerics: Numerics | None = None,
    ) -> None:
        """Build the line, at rest under a force (N) at its start.

        rig: a rig of the catalogue, its TOML file, or ``RigData``. spans: of the line; by default as many as
        it has. Raises InputError for what is not valid.
        """
        data = load_catenary(rig)
        if not isinstance(data, RigData):
            raise InputError(
                f"The computer of a rig wants a rig, such as 'rig', and '{data.name}' is a line."
            )
        speed = from_kmh(speed_kmh)
        self.interval = data.computer.interval
        """Between two calls of ``step`` (s)."""
        condition = LineCondition()
        runs = Runs((speed, speed), self.interval, (condition,))
        self._model = model = Rig(
            data, lanes=1, collectors=1, spans=spans or data.spans, numerics=numerics or Numerics(), runs=runs
        )
        check_speeds(data.name, model.wave_speed, [speed])
        self._drawn, self._start_force, self._range = DrawnLine(condition), force, data.load_cell.force_range
        self._free_uplift = data.free_uplift
        self._stride, self._limit = speed * self.interval, model.usual_end
        self._own = model.wire.table[0]
        self._sample = bind(sample, pack(model.line, model.wire), 0.0, 0.0)
        self.reset()
        self._sample(force, 0.0)  # the first call of a kernel takes longer than all others
        self.reset()

    def reset(self) -> None:
        """Put the line at rest at its start again."""
        self._model.settle(0, self._drawn, self._start_force)
        self._own[RigRow.STRIDE] = self._stride * self._model.time_step / self.interval

    @property
    def position(self) -> float:
        """Where the train is along the line (m)."""
        return float(self._own[RigRow.STEPS] * self._own[RigRow.STRIDE])

    @property
    def ended(self) -> bool:
        """Whether the train has come to the end of the line."""
        return self.position > self._limit - 2 * self._stride

    def step(self, force: float, displacement: float = 0.0) -> float:
        """Displacement to command next (m), from where the contact point is at rest.

        force: of the collectors, upwards, measured now (N). displacement: of the cylinder, measured
        now (m), from the same zero; only ``compensation = "adaptive"`` looks at it. Raises InputError, and
        leaves the line as it is, for a force that is no number or beyond the load cell's range, for a
        displacement that is no number, and at the line's end; and where the line has left its valid range.
        """
        if not abs(force) <= self._range:  # nor is NaN
            raise InputError(
                f"The measured force must lie within the load cell's range of ±{self._range:g} N, not at "
                f"{force:g} N; stop the rig."
            )
        if not math.isfinite(displacement):
            raise InputError(
                f"The measured displacement must be a number, not {displacement:g}; stop the rig."
            )
        if self.ended:
            raise InputError(f"The train is at the end of the line, at {self.position:.1f} m; call reset.")
        command: float = self._sample(force, displacement)
        if self._own[RigRow.STOPPED] > 0:
            ending = Ending(int(self._own[RigRow.STOPPED]))
            raise InputError(
                f"The computed line left its valid range at {self.position:.1f} m: "
                f"{reason(ending, self._free_uplift)}; stop the rig."
            )
        return command
