"""Commands in the help of ``panto`` by what a person wants to do, those of plug-ins too."""

from __future__ import annotations

from collections import Counter
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from ..base import plugins
from ..base.errors import InputError

PANELS = {
    "Simulate": ("list", "line", "simulate", "sweep", "permissible-speed", "design", "family", "film", "app"),
    "Judge": ("report", "record", "compare", "validate", "reproduce", "speed"),
    "Identify": ("identify", "estimate", "fit", "drift", "diagnose", "rig"),
    "Control": ("benchmark", "tune", "oracle", "replay", "returns", "submission"),
    "Learn": ("train", "trainings", "evaluate", "export", "ablation", "dataset"),
}
"""Commands of each panel, in the order of the help."""
OTHERS = "From other packages"
PANEL_OF = {name: panel for panel, names in PANELS.items() for name in names}
ORDER = list(PANEL_OF)


class _GivenOnce:
    """Command that refuses an option of one value that is given twice, instead of taking the last."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        command: Any = super()
        if args and not ctx.resilient_parsing:
            _, _, given = command.make_parser(ctx).parse_args(args=list(args))
            for option, times in Counter(given).items():
                single = option.param_type_name == "option" and not (option.multiple or option.count)
                if single and times > 1 and not option.is_eager:
                    flag, often = max(option.opts, key=len), "twice" if times == 2 else f"{times} times"
                    raise InputError(f"{flag} is given {often}; give it once.")
        parsed: list[str] = command.parse_args(ctx, args)
        return parsed


class _Command(_GivenOnce, TyperCommand):
    pass


class _Group(_GivenOnce, TyperGroup):
    pass


def give_options_once(app: typer.Typer) -> None:
    """Let every command of an app, and of those below it, refuse an option that is given twice."""
    for command in app.registered_commands:
        if command.cls in (None, TyperCommand):
            command.cls = _Command
    for group in app.registered_groups:
        if not (isinstance(group.cls, type) and issubclass(group.cls, _Group)):
            group.cls = _Group
        if group.typer_instance is not None:
            give_options_once(group.typer_instance)


class PlugInGroup(_Group):
    """Our commands, in the panels above, and those of plug-ins, loaded when they or their help are called.

    The list of commands describes our own; of others, which come last, it has the name and the package.
    """

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self._listing = False
        self._points = plugins.installed(plugins.COMMANDS, taken=tuple(self.commands))
        for name in self._points:
            self.add_command(TyperCommand(name))

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, in the order of the help."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda name: ORDER.index(name) if name in PANEL_OF else len(ORDER))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name, or None. Raises InputError for a plug-in's that cannot be loaded."""
        point = self._points.get(cmd_name)
        if point is not None and self._listing and not plugins.is_own(point):
            words = f"A plug-in of {plugins.package(point)}."
            return TyperCommand(cmd_name, help=words, rich_help_panel=OTHERS)
        if point is not None:
            loaded, app = plugins.load(point), typer.Typer(add_completion=False)
            app.callback()(lambda: None)  # so that it is a group even of one command
            with plugins.blamed(point):
                if isinstance(loaded, typer.Typer):
                    app.add_typer(loaded, name=cmd_name)
                else:
                    app.command(cmd_name)(loaded)
                give_options_once(app)
                group: Any = get_command(app)
            self.add_command(group.commands[cmd_name], cmd_name)
            del self._points[cmd_name]
        command: Any = super().get_command(ctx, cmd_name)
        if command is not None:
            command.rich_help_panel = PANEL_OF.get(cmd_name, OTHERS)
        return command

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        self._listing = True
        try:
            super().format_help(ctx, formatter)
        finally:
            self._listing = False
