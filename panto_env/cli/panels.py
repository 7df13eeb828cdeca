"""Commands in the help of ``panto`` by what a person wants to do."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

PANELS = {
    "Simulate": ("list", "line", "simulate", "sweep", "family", "film"),
    "Judge": ("report", "record", "compare", "validate", "reproduce", "speed"),
    "Identify": ("identify", "estimate", "fit", "drift", "diagnose", "rig"),
    "Control": ("benchmark", "tune", "oracle", "replay", "returns", "submission"),
    "Learn": ("train", "trainings", "evaluate", "export", "ablation", "dataset"),
}
"""Commands of each panel, in the order of the help."""
OTHERS = "From other packages"
PANEL_OF = {name: panel for panel, names in PANELS.items() for name in names}
ORDER = list(PANEL_OF)


class PanelGroup(TyperGroup):
    """A group that shows its commands in the panels above; those of other packages come last."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, in the order of the help."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda name: ORDER.index(name) if name in PANEL_OF else len(ORDER))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name, or None."""
        command: Any = super().get_command(ctx, cmd_name)
        if command is not None:
            command.rich_help_panel = PANEL_OF.get(cmd_name, OTHERS)
        return command
