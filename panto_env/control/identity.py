"""Identity of a run: every setting as plain data, with the resulting grid and time step."""

from __future__ import annotations

from typing import Any

from ..base.checksums import __version__
from ..base.files import finite
from ..metrics.trajectory import Trajectory
from ..plant.pantograph.schema import PantographData
from ..plant.plant import Plant
from .observation import OBSERVATION_SETTINGS
from .settings import RunSettings

OF_TRAINS = ("pantographs", "distances", "controlled")
"""Settings that say nothing of a train with one pantograph."""
NOT_OF_A_RUN = (*OBSERVATION_SETTINGS, "reward", "cost", "settle")
"""Settings that only concern policies; the distance of a run includes what settles."""


def plain(settings: RunSettings) -> dict[str, Any]:
    """Settings by name as plain data; line and pantograph only by their names."""
    alone = () if settings.pantographs else OF_TRAINS
    values = settings.model_dump(mode="json", exclude={*NOT_OF_A_RUN, *alone}, serialize_as_any=True)
    names: dict[str, Any] = {name: getattr(settings, name).name for name in ("catenary", "pantograph")}
    if settings.pantographs:
        names["pantographs"] = [own.name for own in settings.pantographs]
    table: dict[str, Any] = finite(values | names)
    return table


def identity(settings: RunSettings, plant: Plant, distance: float) -> dict[str, Any]:
    """Identity of a run over ``distance`` (m): version, settings, time step (s), spans and grid."""
    resulting = {"time_step": plant.time_step, "spans": plant.spans, "distance": distance}
    grid = plant.model.grid or dict.fromkeys(("spacing", "window", "precision"))
    return {"version": __version__, **plain(settings), **resulting, **grid}


def settings_of(run: Trajectory) -> dict[str, Any]:
    """Settings with which a run can be repeated, but for those that only concern policies.

    The inverse of ``identity``. Raises KeyError or ValueError where something is missing or not valid.
    """
    design, known = run.designed, run.settings.get("known_pantograph")
    values = {
        **run.settings,
        "catenary": design.line,
        "pantograph": design.pantograph,
        "pantographs": design.pantographs,
        "known_pantograph": PantographData.model_validate(known) if known else None,
    }
    return {
        name: value
        for name, value in values.items()
        if name in RunSettings.model_fields and value not in (None, ())  # not given
    }
