"""What commands share: tables for people, JSON for machines."""

from __future__ import annotations

import json
import math
import sys
from typing import Annotated, Any

import typer
from rich.console import Console

from .base.files import finite

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines instead of a table.")]
Plot = Annotated[str | None, typer.Option(help="Write a picture to this file (.png, .svg, .pdf).")]

console = Console()
progress_console = Console(stderr=True)


def print_json(value: Any) -> None:
    """Print JSON to standard output; figures that are not numbers become null."""
    json.dump(finite(value), sys.stdout, indent=2, ensure_ascii=False)
    sys.stdout.write("\n")


def number(value: float, digits: int = 1) -> str:
    """A figure for a table; a dash where there is none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"
