"""The outcome for people, and the exit status."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from .mutant import Mutant


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant."""

    mutant: Mutant
    noticed_by: str  # the test that failed, or ""
    expected: bool  # whether that is one of the tests that its list names
    seconds: float

    @property
    def word(self) -> str:
        """Killed, or survived."""
        return "killed" if self.noticed_by else "survived"

    @property
    def fault(self) -> str:
        """What must be done about it, or nothing."""
        if self.noticed_by and self.mutant.harmless:
            return "was argued to be harmless: take the argument out"
        if not self.noticed_by and not self.mutant.harmless:
            return "no test notices it: write one, or argue in its list why it is harmless"
        return ""


def print_report(verdicts: Sequence[Verdict], console: Console) -> int:
    """Print all verdicts, survivors with their arguments, and faults; the exit status."""
    table = Table(title=f"{len(verdicts)} mutants, {sum(bool(v.noticed_by) for v in verdicts)} killed")
    for heading in ("file", "what is broken", "noticed by", "s"):
        table.add_column(heading, overflow="fold", justify="right" if heading == "s" else "left")
    path = ""
    for verdict in verdicts:
        if verdict.mutant.path != path:
            table.add_section()
        first = verdict.mutant.path if verdict.mutant.path != path else ""
        path = verdict.mutant.path
        note = "" if verdict.expected or not verdict.noticed_by else " (not in its list)"
        noticed = verdict.noticed_by.removeprefix("tests/") + note or "[yellow]survived[/yellow]"
        table.add_row(first, verdict.mutant.breaks, noticed, f"{verdict.seconds:.0f}")
    console.print(table)
    for verdict in verdicts:
        if not verdict.noticed_by and verdict.mutant.harmless:
            console.print(f"Harmless: {verdict.mutant.breaks}: {verdict.mutant.harmless}")
    faults = [verdict for verdict in verdicts if verdict.fault]
    for verdict in faults:
        console.print(f"[red]{verdict.mutant.path}: {verdict.mutant.breaks}: {verdict.fault}.[/red]")
    return int(bool(faults))
