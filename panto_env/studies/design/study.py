"""What design and control buy on three lines, each alone and together, and what control replaces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ...base.files import finite
from ...base.plotting import LIMIT, panels, series_colour
from ...base.table import Table
from ...catalog import load_catenary, load_pantograph
from ...metrics.compliance import STD_OF_MEAN
from ...plant.catenary.flexible import FlexibleCatenaryData
from ..permissible.scan import PASSIVE
from ..permissible.study import wave_limit
from ..study import Figure, Outcome, Report
from .check import CONTACT, MESSENGER, SPACING, Checked, Replaced, candidates_of, check, replaced
from .search import Design, best_of, read_design, search

CASES = ("benchmark-2015", "re250", "en50318-2002", "controlled")
"""Files of searches, beside this one; the last one searches the first one's line under control."""
RETROFITTED = CASES[:3]
FRONT = "front"
FRONT_SEEDS = (0, 1)
AGENT = "agent-any-pantograph"  # policy that replaces tension and droppers
PARTS = ("searched", "held_out", "as_built")  # where a design is checked
REPLACED = {CONTACT: "contact (kN)", MESSENGER: "messenger (kN)", SPACING: "droppers"}
NAMES = {"start": "as it is", "best": "found"}
Numbers = Mapping[str, Any]


def run(report: Report) -> Outcome:
    """Search and check each line, slacken it under control, and look for a front twice."""
    cases = []
    for k, name in enumerate(CASES):
        report(name, 0.2 * k)
        with TemporaryDirectory() as folder:
            cases.append(of_case(name, folder))
    fronts = []
    for k, seed in enumerate(FRONT_SEEDS):
        report(f"front, seed {seed}", 0.8 + 0.1 * k)
        with TemporaryDirectory() as folder:
            fronts.append(of_front(seed, folder))
    return outcome_of({"cases": cases, "fronts": fronts})


def file_of(name: str) -> Path:
    """The file of a search."""
    return Path(__file__).with_name(f"{name}.toml")


def of_case(name: str, folder: str | Path) -> Numbers:
    """Plain data of a search that is kept in a folder, of its check, and of what control replaces."""
    design = read_design(file_of(name))
    study = search(design, folder)
    candidates = candidates_of(design, study)
    done = [trial for trial in study.get_trials(deepcopy=False) if trial.values is not None]
    control_replaces = replaced(design, AGENT) if name in RETROFITTED else []
    found: Numbers = finite(
        {
            "name": name,
            "line": design.settings["catenary"],
            "policy": design.policy,
            "speeds_kmh": design.speeds_kmh,
            "designs": len(done),
            "refused": sum(bool(trial.user_attrs["refused"]) for trial in done),
            "variables": {
                key: {"range": ends, "start": start_of(design, key), "best": candidates["best"][key]}
                for key, ends in design.variables.items()
            },
            "checked": [_plain(one) for one in check(design, candidates)],
            "replaced": [_plain_replaced(one) for one in control_replaces],
        }
    )
    return found


def of_front(seed: int, folder: str | Path) -> Numbers:
    """Plain data of a front of two objectives that a search with this seed finds and keeps in a folder."""
    design = read_design(file_of(FRONT)).model_copy(update={"seed": seed})
    front = best_of(design, search(design, folder))
    return {
        "seed": seed,
        "line": design.settings["catenary"],
        "designs": design.designs,
        "front": [list(trial.values) for trial in front],
    }


def start_of(design: Design, name: str) -> float:
    """Value that the line or the pantograph of a search has by itself."""
    line = load_catenary(design.settings["catenary"])
    assert isinstance(line, FlexibleCatenaryData)
    places, sag = line.droppers.positions, line.droppers.sag
    family, *path = name.split(".")
    if path[0] == "droppers":
        return (places[-1] - places[0]) / (len(places) - 1) if name == SPACING else max(sag) - sag[0]
    entry: Any = line if family == "catenary" else load_pantograph(design.settings["pantographs"][0])
    for key in path:
        entry = entry[int(key) - 1] if key.isdigit() else getattr(entry, key)
    return float(entry)


def _plain_replaced(one: Replaced) -> dict[str, Any]:
    ends = {"equal_std": one.equal_std, "equal": one.equal_requirements}
    steps = {"steps": [step._asdict() for step in one.steps]}
    return one._asdict() | steps | {key: step and step._asdict() for key, step in ends.items()}


def _plain(one: Checked) -> dict[str, Any]:
    return one._asdict() | {part: asdict(getattr(one, part)) for part in PARTS}


def outcome_of(numbers: Numbers) -> Outcome:
    """Tables, picture and verdict of the study's plain data, as it is run or stored."""
    return Outcome(
        title="What design with control buys",
        comparisons=(),
        tables=tuple(table(numbers["cases"]) for table in TABLES),
        plots={"design": plot(numbers)},
        numbers=numbers,
        verdict=verdict(numbers["cases"]),
    )


def _ratio(case: Numbers, design: str, policy: str, part: str) -> float:
    """Largest σ/F_m of a design under a policy; nan where it ended early."""
    (one,) = (each for each in case["checked"] if (each["design"], each["policy"]) == (design, policy))
    ratio = one[part]["std_ratio"]
    return math.nan if ratio is None else float(ratio)


def _four(case: Numbers, policy: str, part: str) -> tuple[float, ...]:
    """σ/F_m of the line as it is, with control alone, with design alone, and with both."""
    pairs = (("start", PASSIVE), ("start", policy), ("best", PASSIVE), ("best", policy))
    return tuple(_ratio(case, *pair, part) for pair in pairs)


def bought_table(cases: Sequence[Numbers]) -> Table:
    """σ/F_m without design and control, with either, and with both; a row for each line and policy."""
    rows = []
    for case in cases:
        for policy in dict.fromkeys(each["policy"] for each in case["checked"] if each["policy"] != PASSIVE):
            ratios = (*_four(case, policy, "held_out"), *_four(case, policy, "as_built"))
            rows.append((case["name"], policy, *(f"{ratio:.2f}" for ratio in ratios)))
    names = ("as it is", "control", "design", "both")
    headings = ("search", "control by", *names, *(f"{name}, built" for name in names))
    return Table("Largest σ/F_m at held-out speeds and seeds", headings, rows, text_columns=2)


def fell_table(cases: Sequence[Numbers]) -> Table:
    """What was found, at the speeds of the search, at others, and as built."""
    rows = [
        (
            case["name"],
            each["design"],
            each["policy"],
            *(f"{_ratio(case, each['design'], each['policy'], part):.3f}" for part in PARTS),
            ", ".join(each["as_built"]["broken"]) or "none",
        )
        for case in cases
        for each in case["checked"]
    ]
    headings = ("search", "design", "control", "searched", "held out", "as built", "broken as built")
    return Table("σ/F_m searched and elsewhere", headings, rows, text_columns=3)


def values_table(cases: Sequence[Numbers]) -> Table:
    """What was searched, from what to what."""
    rows = []
    for name in cases[0]["variables"]:
        both = ([_short(case["variables"][name][key]) for key in ("start", "best")] for case in cases)
        rows.append((name, *map(" → ".join, both)))
    return Table("Values, as they are and found", ("variable", *(case["name"] for case in cases)), rows)


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 1e3 else f"{value:.3g}"


def replaced_table(cases: Sequence[Numbers]) -> Table:
    """How far tension and droppers of a line as it is may go under control, and why no farther."""
    rows = []
    for line, one in ((case["line"], one) for case in cases for one in case["replaced"]):
        first, std, equal = one["steps"][0], one["equal_std"], one["equal"]
        beyond = one["steps"][one["steps"].index(equal) + 1 :] if equal else one["steps"]
        amounts = (_amount(one, step) for step in (first, std, equal))
        broken, waves = ", ".join(beyond[0]["more_broken"]) if beyond else "", ""
        if std and one["parameter"] == CONTACT:
            waves = f"{wave_limit(line, std['value']):.0f}"
        rows.append((line, REPLACED[one["parameter"]], *amounts, broken, waves))
    first = ("line", "what", "as it is", "equal σ/F_m", "equal requirements", "broken first", "0.7 c (km/h)")
    return Table("Tension of the wires and droppers in a span", first, rows, text_columns=2)


TABLES = (bought_table, fell_table, values_table, replaced_table)


def _amount(one: Numbers, step: Numbers | None) -> str:
    if step is None:
        return "none"
    amount = f"{step['droppers']}" if one["parameter"] == SPACING else f"{step['value'] / 1e3:.4g}"
    return f"≤ {amount}" if step == one["steps"][-1] and len(one["steps"]) > 1 else amount


def plot(numbers: Numbers) -> Figure:
    """σ/F_m over speed on each line, and the fronts of all seeds."""
    cases = [case for case in numbers["cases"] if case["name"] in RETROFITTED]
    figure, axes = panels((10, 7), 2, 2)
    *of_lines, last = axes.flat
    for axis, case in zip(of_lines, cases, strict=False):
        shown = [each for each in case["checked"] if each["policy"] in (PASSIVE, AGENT)]
        for k, each in enumerate(shown):
            by_speed = {float(v): math.nan if r is None else r for v, r in each["by_speed"].items()}
            held = {v: r for v, r in by_speed.items() if v not in case["speeds_kmh"]}
            style: dict[str, Any] = {"color": series_colour(k)}
            label = f"{NAMES[each['design']]}, {each['policy']}"
            axis.plot(list(by_speed), list(by_speed.values()), label=label, **style)
            axis.plot(list(held), list(held.values()), "o", markerfacecolor="white", **style)
        axis.axhline(STD_OF_MEAN, color=LIMIT, linestyle=(0, (5, 3)), linewidth=0.9)
        axis.set(title=case["line"], xlabel="speed (km/h); circles: held out", ylabel="σ / F_m (-)")
        axis.set_ylim(bottom=0)
    for k, each in enumerate(numbers["fronts"]):
        ratios, tensions = zip(*each["front"], strict=True)
        label = f"seed {each['seed']}, {each['designs']} designs"
        last.plot([t / 1e3 for t in tensions], ratios, "os"[k % 2], color=series_colour(k), label=label)
    title = f"{numbers['fronts'][0]['line']}, two objectives"
    last.set(title=title, xlabel="tension of both wires (kN)", ylabel="largest σ / F_m (-)")
    last.legend(fontsize="small")
    of_lines[0].legend(fontsize="small")
    for axis in axes.flat:
        axis.grid(color="0.92")
    return figure


def verdict(cases: Sequence[Numbers]) -> str:
    """What it comes to."""
    own = [_four(case, AGENT, "as_built") for case in cases if case["name"] in RETROFITTED]
    shares = [[100 * (1 - four[k] / four[0]) for four in own] for k in (1, 2, 3)]
    words = [f"{min(each):.0f} to {max(each):.0f} %" for each in shares]
    return (
        f"As built, at held-out speeds, the largest σ/F_m falls by {words[0]} with {AGENT} alone, by "
        f"{words[1]} with another line and pantograph alone, by {words[2]} with both."
    )
