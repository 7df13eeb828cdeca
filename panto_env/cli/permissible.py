"""``panto permissible-speed``: up to which speed a train may run, with control and without."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

from typer import Argument, Option

from ..analysis.options import with_settings
from ..analysis.plots import save
from ..base.checksums import __version__
from ..base.errors import InputError
from ..base.files import PAGES
from ..catalog import load_catenary
from ..cluster import RayAddress
from ..control.identity import plain
from ..control.settings import run_settings
from ..studies.permissible import USUAL, Scan, scan
from ..studies.permissible.scan import VERIFIED_FROM
from ..studies.permissible.study import NOTES, answers_table, plot_scan, reasons, write_page
from ..terminal import Json, Plot, console, counting, into_file, print_json, print_table, written_last


@with_settings(left_out=("observation", "catenary", "speed_kmh", "speed_profile"), defaults=False)
def permissible_speed(
    settings: dict[str, Any],
    line: Annotated[str, Argument(help="Line: a name of the catalogue or a TOML file.")],
    policy: Annotated[
        list[str] | None,
        Option(
            help="Policy: a name, name:key=value,... or a model file; may be repeated. passive always runs."
        ),
    ] = None,
    speeds: Annotated[
        str,
        Option(help="Speeds as first:last:step (km/h), all of which are run: forbidden ones come in bands."),
    ] = "200:350:10",
    seeds: Annotated[int, Option(min=1, help="Number of lines as built, with a drifting speed each.")] = 8,
    verify: Annotated[
        bool, Option("--verify", help="Scan again with other seeds at half the step; the lower limit counts.")
    ] = False,
    workers: Annotated[int | None, Option(help="Processes; one per core by default.", min=1)] = None,
    ray: RayAddress = None,
    plot: Plot = None,
    html: Annotated[str | None, into_file("Write a page of it to this file", PAGES)] = None,
    json: Json = False,
) -> None:
    """Scan speeds for those at which a train keeps all requirements, without control and with.

    Lines are as built, actuator and sensors realistic, and the mean force is the standard's, unless the
    options say otherwise. Each pass is run once more with an actuator that fails half-way.
    """
    values = parse_speeds(speeds)
    data = load_catenary(line)
    given: dict[str, Any] = {"catenary": line, "workers": workers, "ray": ray} | settings
    with counting("lines and speeds") as progress:
        found = scan(values, policy or (), seeds=range(seeds), progress=progress, **given)
    again: Scan | None = None
    if verify:
        half = sorted({*values, *((a + b) / 2 for a, b in pairwise(values))})
        others = range(VERIFIED_FROM, VERIFIED_FROM + seeds)
        with counting("lines and speeds, other seeds") as progress:
            again = scan(half, policy or (), seeds=others, progress=progress, **given)
    used = USUAL | settings | {"seeds": seeds}
    with written_last() as later:
        if plot is not None:
            later(save, plot_scan(found, data), plot)
        if html is not None:
            later(write_page, found, again, data, used, html)
        if json:
            facts = plain(run_settings(USUAL | settings | {"catenary": line, "speed_kmh": values[0]}))
            verification = {} if again is None else {"verification": again.as_dict()}
            print_json({"version": __version__, "settings": facts} | found.as_dict() | verification)
            return
        print_table(answers_table(found, again))
        for sentence in reasons(found):
            console.print(sentence)
        for note in NOTES:
            console.print(note, style="dim")


def parse_speeds(text: str) -> list[float]:
    """Speeds (km/h) from first:last:step. Raises InputError for anything else."""
    try:
        first, last, step = (float(each) for each in text.split(":"))
        if not (0 < first <= last and step > 0):
            raise ValueError
    except ValueError as error:
        raise InputError(f"--speeds must read first:last:step, such as 200:400:5, not '{text}'.") from error
    count = int((last - first) / step + 1e-9) + 1
    if count > MOST_SPEEDS:
        raise InputError(f"--speeds has {count:,} speeds; the maximum is {MOST_SPEEDS}, take a larger step.")
    return [first + k * step for k in range(count)]


MOST_SPEEDS = 1000
"""Maximum number of speeds of a scan."""
