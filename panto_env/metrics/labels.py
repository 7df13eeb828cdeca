"""Labels of figures for tables and plots: name, short name, unit, and scale from SI."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Label:
    """Label of one figure in a table or a plot."""

    name: str
    short: str  # for narrow columns
    unit: str
    scale: float = 1.0  # from SI to ``unit``
    si: str = ""  # unit in SI, where that is another one

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})"

    @property
    def short_heading(self) -> str:
        """Short name and unit."""
        return f"{self.short} ({self.unit})"

    @property
    def column(self) -> str:
        """Short name above the unit, for a narrow column."""
        return f"{self.short}\n({self.unit})"


LABELS = {
    "mean": Label("mean force F_m", "F_m", "N"),
    "std": Label("standard deviation σ", "σ", "N"),
    "statistical_max": Label("statistical maximum F_m + 3σ", "F_m + 3σ", "N"),
    "statistical_min": Label("statistical minimum F_m − 3σ", "F_m − 3σ", "N"),
    "max": Label("maximum", "max", "N"),
    "min": Label("minimum", "min", "N"),
    "max_uplift": Label("maximum uplift at the supports", "uplift", "mm", 1e3, "m"),
    "contact_loss": Label("contact loss CL", "CL", "%"),
    "cost_function": Label("cost function CF", "CF", "N m"),
    "effort": Label("actuator force, rms", "effort", "N"),
    "effort_rate": Label("rate of actuator force, rms", "effort rate", "N/s"),
    "distance": Label("over a distance of", "distance", "m"),
}
"""Label of every field of ``Figures``, in its order."""

NUMBER = "pantograph_number"
"""Column with the number of a pantograph in its train, 1 for the first, in tables of several."""

HEADINGS = {name: f"{name} ({label.si or label.unit})" for name, label in LABELS.items()} | {
    "speed_kmh": "speed (km/h)",
    "nominal_force": "nominal_force (N)",
    "time_step": "time_step (s)",
    "spacing": "spacing (m)",
    "window": "window (spans)",
    "dropper_force": "dropper_force (N)",
    "slack": "slack (% of time)",
}
"""Headings with units of figures and settings, which are in SI, in files of tables."""
