"""Coverage of the intervals of ``panto fit`` on lines as built, and what the errors are.

python -m tests.fitting.coverage FOLDER --lines 100           # goes on where it was broken off
python -m tests.fitting.coverage FOLDER --wrong pantograph    # the model wrong, in one of several ways
python -m tests.fitting.coverage FOLDER --passes 1            # fewer passes
python -m tests.fitting.coverage FOLDER --line section        # lines whose spans differ, each drawn
python -m tests.fitting.coverage FOLDER --line midst          # records from the midst of a line
python -m tests.fitting.coverage FOLDER --freed               # the pantograph's values fitted, too
python -m tests.fitting.coverage FOLDER --diagnose            # and what later passes over these lines show
python -m tests.fitting.coverage FOLDER --table
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from panto_env import simulate
from panto_env.base.files import write_whole
from panto_env.catalog import load_catenary, load_pantograph, load_section
from panto_env.diagnosis import diagnose_records
from panto_env.fitting.fit import INTERVAL, WHITE, Fit, fit
from panto_env.fitting.stored import knowledge
from panto_env.fitting.values import CHAIN, USUAL
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.line_condition import LINE_CONDITIONS, LineCondition, draw
from panto_env.plant.pantograph.schema import PantographData
from panto_env.records.measured import measured
from panto_env.records.record import Record

LINE, PANTOGRAPH, SPANS, BEYOND = "en50318-2002", "dsa380", 16, 12
SECTION, SECTION_SPANS = "fast-line", 18
SPEEDS = (180.0, 220.0, 250.0, 200.0)
"""Of the passes on that line (km/h), as many as are asked for, from the end of this list on backwards; on
others as large a share of the wave speed."""
NOISE, RATE, PLACE = 2.0, 500.0, 0.3
"""Of sensors: rms of a sample (N), samples a second, and standard deviation of the odometer's error (m)."""
GAIN, ZERO = 0.015, 2.5
"""Standard deviations of the sensors' gain and zero (N): half of what a fit expects."""
LINES = ("uniform", "section", "midst")
"""Kinds of lines: all spans alike, spans that differ, and records from the midst of the first kind."""
BOTH = LINES[:2]
BEFORE = {"midst": 64}
"""Spans that trains have run before records of some kinds of lines begin."""
HEADINGS = (
    "line",
    "model",
    "passes",
    "lines",
    "tension (%), inside",
    "dropper (mm)",
    "support (mm)",
    "damping (%)",
    "waves (mm)",
    "unlike noise",
)
SCALES = {"tensions": 100.0, "droppers": 1e3, "supports": 1e3, "damping": 100.0, "unevenness": 1e3}
WRONG = ("nothing", "grid", "damping", "pantograph", "drift", "wheel")
WHEEL = 1e-3
"""Share by which the positions of a worn wheel are too large."""


def design_of(seed: int, line: str) -> FlexibleCatenaryData:
    """A line as designed: the uniform one, or a section drawn by seed."""
    if line in ("uniform", "midst"):
        found = load_catenary(LINE)
        assert isinstance(found, FlexibleCatenaryData)
        return found
    section = load_section(SECTION).model_copy(update={"spans": (SECTION_SPANS, SECTION_SPANS)})
    return section.draw(np.random.default_rng(seed))[0]


def wrong_pantograph(seed: int) -> PantographData:
    """The pantograph with masses that are 5 % larger or smaller, and springs 5 % stiffer."""
    pantograph, signs = load_pantograph(PANTOGRAPH), np.random.default_rng(seed).choice([-1, 1], 3)
    masses = tuple(float(m * (1 + 0.05 * s)) for m, s in zip(pantograph.masses, signs, strict=True))
    springs = (*(float(1.05 * k) for k in pantograph.stiffnesses[:-1]), pantograph.stiffnesses[-1])
    return pantograph.model_copy(update={"masses": masses, "stiffnesses": springs})


def records_of(
    seed: int,
    passes: int,
    wrong: str,
    kind: str,
    *,
    condition: LineCondition | str = "as-built",
    speeds: tuple[float, ...] = (),
    visit: int = 0,
) -> list[Record]:
    """Records of passes over one line.

    wrong: what the fit will not know. condition: of the line as built, and with what is defect. speeds:
    instead of the usual ones (km/h). visit: with other noise, gain, zero and place of the sensors.
    """
    random = np.random.default_rng([seed, passes, visit])
    line, pantograph = design_of(seed, kind), load_pantograph(PANTOGRAPH)
    faster = line.contact_wire.wave_speed / design_of(0, "uniform").contact_wire.wave_speed
    settings: dict[str, Any] = {}
    before = BEFORE.get(kind, 0)
    if not line.ends:
        settings = {"spans": before + SPANS + BEYOND, "distance": (before + SPANS) * line.span_length}
    if wrong == "damping":
        damping = line.damping
        other = damping.model_copy(update={"alpha": 2 * damping.alpha, "beta": 2 * damping.beta})
        line = line.model_copy(update={"damping": other})
    if wrong == "pantograph":
        pantograph = wrong_pantograph(seed)
    if wrong == "grid":
        settings |= {"window": 0, "spacing": 0.25, "time_step": 5e-4, "precision": "double"}
    found = []
    for k, speed in enumerate(faster * np.array(speeds or SPEEDS[-passes:])):
        run = simulate(
            line,
            pantograph,
            float(speed),
            line_condition=condition,
            seed=seed,
            record_droppers=False,
            **settings,
        )
        record = measured(
            run,
            rate=RATE,
            force_noise=NOISE,
            position_error=float(PLACE * random.standard_normal()),
            seed=1000 * seed + 10 * visit + k,
            name=f"{speed:g} km/h",
        )
        (piece,) = record.pieces
        if before:
            inside = piece.position > before * line.span_length
            piece = replace(piece, position=piece.position[inside], force=piece.force[inside], height=None)
            record = replace(record, pieces=(piece,))
        if wrong == "wheel":
            (piece,) = record.pieces
            record = replace(record, pieces=(replace(piece, position=(1 + WHEEL) * piece.position),))
            (piece,) = record.pieces
        gain, zero = (GAIN, ZERO) * random.standard_normal(2)
        piece.force[:] = (1 + gain) * piece.force + zero
        if wrong == "drift":
            piece.force[:] = 1.03 * piece.force + 8.0 * np.sin(2 * np.pi * piece.time / 30.0)
        found.append(record)
    return found


def truths_of(found: Fit, seed: int, wrong: str, kind: str) -> dict[str, Any]:
    """True values by kind and by index of the values of a fit to ``records_of`` these."""
    line, design = design_of(seed, kind), load_pantograph(PANTOGRAPH)
    first = found.problem.values.design.first_span
    spans = line.spans if line.ends else BEFORE.get(kind, 0) + SPANS + BEYOND
    droppers = len(line.layout(spans).positions)
    true = draw((LINE_CONDITIONS["as-built"],), np.random.default_rng(seed), droppers, spans - 1)
    assert true.scatter is not None
    assert true.heights is not None
    phases = 2 * np.pi * (true.waves[:, 2] + found.problem.before * true.waves[:, 1])
    pantograph = wrong_pantograph(seed) if wrong == "pantograph" else design
    return {
        "tensions": np.array(true.tensions) - 1,
        "droppers": true.scatter[first * droppers // spans :],
        "supports": true.heights[first:],
        "damping": dict.fromkeys([("alpha",), ("beta",)], 1.0 if wrong == "damping" else 0.0),
        "unevenness": true.waves[:, :1] * np.stack([np.cos(phases), -np.sin(phases)], axis=1),
        "pantograph": {
            (name, k): getattr(pantograph, name)[k] / own - 1
            for name in CHAIN
            for k, own in enumerate(getattr(design, name))
            if own > 0
        },
    }


def judge(
    seed: int, passes: int, wrong: str, kind: str, *, diagnose: bool = False, freed: bool = False
) -> dict[str, Any]:
    """Errors and standard deviations of one fit by kind, in the values' own units.

    diagnose: and what later passes show that are held against it. freed: whether the pantograph is, too.
    """
    records, line = records_of(seed, passes, wrong, kind), design_of(seed, kind)
    free = (*USUAL, "pantograph") if freed else USUAL
    found = fit(records, line, load_pantograph(PANTOGRAPH), free=free)
    by_noise = replace(found, solution=replace(found.solution, residual=0.0 * found.solution.residual))
    rows: dict[str, Any] = {"line": kind, "seed": seed, "passes": passes, "wrong": wrong, "freed": freed}
    rows["by_noise"] = {}
    rows["settled"] = found.solution.converged
    rows["left"] = [_short(residual) for _, residual in found.std]
    rows["as_noise"] = [_short(white.probability) for white in found.whiteness]
    for name, truth in truths_of(found, seed, wrong, kind).items():
        own = found.of_kind(name)
        pairs = [(each.difference - float(truth[each.value.index]), each.deviation) for each in own]
        rows[name] = [[_short(number) for number in pair] for pair in pairs]
        rows["by_noise"][name] = [_short(each.deviation) for each in by_noise.of_kind(name)]
    if diagnose:
        rows["later"] = later(found, partial(records_of, seed, passes, wrong, kind), seed)
    return rows


SPEED = 235.0
"""Of later passes (km/h on the uniform line), at which nothing was fitted."""
LOST = 0.01
"""Share of the contact wire's tension that is lost."""
LATER = (
    "healthy, called so",
    "broken dropper, found in its place",
    "1 % of tension lost, line called changed",
)


def later(fit: Fit, passes: Callable[..., list[Record]], seed: int) -> dict[str, bool]:
    """Whether each of three later passes is diagnosed as what it is: over the line as it was, with one broken
    dropper, and with less tension.

    passes: records over the line of the fit, as ``coverage.records_of`` takes its last arguments. seed: of
    which dropper is broken, of the middle half of those compared.
    """
    known, built = knowledge(fit, "earlier"), LINE_CONDITIONS["as-built"]
    droppers = fit.of_kind("droppers")
    value = droppers[int(len(droppers) * np.random.default_rng(seed).uniform(0.25, 0.75))].value
    _, number, _, _, span = value.name.split()
    broken = built.model_copy(update={"broken_droppers": ((int(span), int(number)),)})
    slack = built.model_copy(update={"lost_contact_tension": LOST})
    healthy, other, changed = (
        diagnose_records(passes(condition=condition, speeds=(SPEED,), visit=visit), known)
        for visit, condition in enumerate((built, broken, slack), start=1)
    )
    places = [(each.kind, each.span, each.dropper) for each in other.findings]
    found = healthy.healthy, ("broken dropper", int(span), int(number)) in places, changed.changed
    return dict(zip(LATER, found, strict=True))


def _short(number: float) -> float:
    return float(f"{number:.3g}")


def known(path: Path) -> list[dict[str, Any]]:
    """What was found before of lines of a group."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []


def groups(folder: Path) -> Iterator[tuple[tuple[int, int, int], list[Any]]]:
    """What was found, by number of the line's kind, number of what is wrong, and number of passes."""
    found: dict[tuple[int, int, int], list[Any]] = {}
    for path in sorted(folder.glob("*-*-*.json")):
        for each in known(path):
            wrong = WRONG.index(each["wrong"]) + len(WRONG) * each.get("freed", False)
            order = LINES.index(each["line"]), wrong, each["passes"]
            found.setdefault(order, []).append(each)
    yield from sorted(found.items())


def model_of(number: int) -> str:
    """What is wrong with the model, in a table's words."""
    freed, wrong = divmod(number, len(WRONG))
    return f"{f'wrong: {WRONG[wrong]}' if wrong else 'right'}{', pantograph freed' if freed else ''}"


def table(folder: Path) -> Iterator[str]:
    """Rows of a table in Markdown: coverage and errors by line, what is wrong, and the number of passes."""
    yield f"| {' | '.join(HEADINGS)} |"
    yield f"| --- | --- |{' ---: |' * (len(HEADINGS) - 2)}"
    for line, number, passes, own in _rows(folder):
        unlike = np.mean([min(each["as_noise"]) < WHITE for each in own])
        for alone in (False, True) if all("by_noise" in each for each in own) else (False,):
            cells = []
            for kind, scale in SCALES.items():
                errors, deviations = np.array([pair for each in own for pair in each[kind]]).T
                if alone:
                    deviations = np.concatenate([each["by_noise"][kind] for each in own])
                inside = 100 * np.mean(np.abs(errors) < INTERVAL * deviations)
                cells.append(f"{scale * np.median(np.abs(errors)):.2g}, {inside:.0f} %")
            model = model_of(number) + (", by noise alone" if alone else "")
            cells = [line, model, f"{passes}", f"{len(own)}", *cells, f"{100 * unlike:.0f} %"]
            yield f"| {' | '.join(cells)} |"


def _rows(folder: Path) -> Iterator[tuple[str, int, int, list[Any]]]:
    """Lines, number of what is wrong, number of passes, and what was found of these.

    Where lines of all kinds were tried: also of them together, and of the fits that call themselves good.
    """
    together: dict[tuple[int, int], dict[str, list[Any]]] = {}
    for (line, number, passes), own in groups(folder):
        yield LINES[line], number, passes, own
        together.setdefault((number, passes), {})[LINES[line]] = own
    for (number, passes), kinds in together.items():
        if set(BOTH) <= set(kinds):
            kinds = {name: kinds[name] for name in BOTH}
            kinds["both"] = [each for own in kinds.values() for each in own]
            yield "both", number, passes, kinds["both"]
            for name, own in kinds.items():
                good = [each for each in own if each["settled"] and not min(each["as_noise"]) < WHITE]
                if good:
                    yield f"{name}, settled and like noise", number, passes, good


def diagnosed(folder: Path) -> Iterator[str]:
    """Rows of a table in Markdown: what ``panto diagnose`` said of later passes over the fitted lines."""
    yield f"| {' | '.join(('line', 'model', 'lines', *LATER))} |"
    yield f"| --- | --- |{' ---: |' * (1 + len(LATER))}"
    for (line, number, _), rows in groups(folder):
        own = [row["later"] for row in rows if "later" in row]
        if own:
            cells = [f"{sum(each[name] for each in own)}" for name in LATER]
            yield f"| {' | '.join([LINES[line], model_of(number), f'{len(own)}', *cells])} |"


def main(
    folder: Path,
    lines: int = 20,
    passes: int = len(SPEEDS),
    line: str = LINES[0],
    wrong: str = WRONG[0],
    freed: bool = False,
    diagnose: bool = False,
    only_table: Annotated[bool, typer.Option("--table")] = False,
) -> None:
    """Judge lines that are missing, and print the table."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{line}-{wrong}-{passes}{'-freed' if freed else ''}.json"
    done = {row["seed"] for row in known(path) if "later" in row or not diagnose}
    for seed in [] if only_table else sorted(set(range(lines)) - done):
        rows = [other for other in known(path) if other["seed"] != seed]
        rows.append(judge(seed, passes, wrong, line, diagnose=diagnose, freed=freed))
        text = ",\n".join(json.dumps(row) for row in sorted(rows, key=lambda row: row["seed"]))
        with write_whole(path) as temporary:
            temporary.write_text(f"[\n{text}\n]\n", encoding="utf-8")
        print(f"line {seed + 1} of {lines}", flush=True)
    for text in (*table(folder), "", *diagnosed(folder)):
        print(text)


if __name__ == "__main__":
    typer.run(main)
