"""Command lines that users should not write: every option of every command times values that are no good."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from itertools import chain, zip_longest
from pathlib import Path

from .options import Parameter, parameters

HUGE = "1" + "0" * 400
LONG = "x" * 5000
QUICK = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass")
"""A line and a pantograph that are computed in no time."""
SHORT = (*QUICK, "--distance", "100", "--spans", "1-2")
MARKUP = ("--catenary", "markup.toml", "--pantograph", "three-mass")
MARKED = ("--catenary", "markup.toml", "--pantograph", "marked.toml")

USUAL: dict[tuple[str, ...], tuple[str, ...]] = {
    ("list",): ("pd",),
    ("simulate",): SHORT,
    ("film",): (
        "passive",
        *QUICK,
        "--distance",
        "600",
        "--first-span",
        "1",
        "--seconds",
        "0.1",
        "--size",
        "64",
        "64",
        "--output",
        "film.gif",
    ),
    ("sweep",): ("catenary.mean_stiffness=3000,4000", "--workers", "1", *SHORT),
    ("line",): ("re250",),
    ("family",): ("high-speed", "--seeds", "1"),
    ("validate",): (),
    ("identify",): ("rig.csv", "--measured", "k1T=32992,m2=5,k2=14544"),
    ("estimate",): ("motion.csv", "--pantograph", "own-two-mass"),
    ("record",): ("measured.csv", "--line", "en50318-2002"),
    ("compare",): ("measured.csv", "passes/4.parquet"),
    ("fit",): (
        "measured.csv",
        "--line",
        "en50318-2002",
        "--pantograph",
        "dsa250",
        "--free",
        "tensions",
    ),
    ("drift",): ("month1.safetensors", "month2.safetensors"),
    ("diagnose",): (
        "passes/1.parquet",
        "--healthy",
        "passes/2.parquet",
        "passes/3.parquet",
        "passes/4.parquet",
    ),
    ("speed",): ("speed.json",),
    ("reproduce",): ("paper3-parameters",),
    ("rig",): ("rig", "--reference", "periodic-stiffness", "--spans", "1-2"),
    ("ablation",): ("ablation.toml", "--workers", "1"),
    ("benchmark",): ("passive", *QUICK, "--speed", "300", "--seeds", "1", "--workers", "1"),
    ("evaluate",): ("passive", *QUICK, "--speed", "300", "--line-condition", "fair"),
    ("export",): ("agent.safetensors", "model.safetensors"),
    ("oracle",): (*QUICK, "--spans", "1-1", "--hops", "0"),
    ("replay",): ("result.json", "--workers", "1"),
    ("report",): ("benchmark.json",),
    ("returns",): ("result.json", "--id", "PantographStiffness-v0", "--episodes", "2", "--workers", "1"),
    ("submission", "check"): ("mine", "--config", "small.toml", "--seeds", "1", "--workers", "1"),
    ("train",): ("training.toml", "--output", "run"),
    ("trainings",): ("training.toml", "--workers", "1"),
    ("tune",): (
        *("skyhook", *QUICK, "--seeds", "1", "--passes", "1", "--speed", "300"),
        *("--workers", "1", "--output", "gains.toml"),
    ),
    ("dataset", "episodes"): ("episodes.toml", "--workers", "1"),
    ("dataset", "designs"): ("designs.toml", "--workers", "1"),
    ("dataset", "verify"): ("set",),
}
"""What goes before the bad option, or is an argument in whose place the bad one stands: quick to compute."""

BAD: dict[type, tuple[str, ...]] = {
    int: ("-1", "1.5", "٣", "²", HUGE, "nan", "", "2147483648", "1_0", "999999999999"),
    float: ("nan", "inf", "-inf", "1e308", "-1", "1e-308", "٣", "²", HUGE, "", "1,5", "0"),
    str: (
        *(
            "",
            " ",
            "[bold]",
            "[/]",
            LONG,
            "a\nb",
            "\x1b[31m",
            "nowhere:x=1",
            ":",
            "=",
            "a=b",
            "٣",
            "../..",
            ".",
        ),
        *("nowhere.toml", "bad.toml", "deep.toml", "\0", "\udc80", "1e400", "ideal:", "ideal:delay", "[1,2]"),
        *("ideal:delay=nan", "realistic:delay=1e9", "new:wear_depth=" + HUGE, "pd:gain=" + HUGE, "-", "None"),
        *("ideal:delay=" + "(" * 2000, "pd:gain=" + "-" * 3000 + "1", "pd:" + "gain=1," * 500),
    ),
    Path: (
        *(
            "",
            ".",
            "nowhere",
            "nowhere/x.toml",
            LONG,
            LONG + ".toml",
            "\0",
            "\0.toml",
            "bad.toml",
            "deep.toml",
        ),
        *(
            "lists.toml",
            "nul.toml",
            "binary.toml",
            "[/].toml",
            "\udc80.toml",
            "huge.toml",
            "picture.png",
            "a\nb",
        ),
    ),
    tuple: ("0", "-2", "٣", HUGE, "nan"),
    bool: (),
    Enum: ("", "nowhere", "[/]", LONG),
}
"""By the kind of an option."""

BY_HAND: tuple[tuple[str, ...], ...] = (
    ("nowhere",),
    ("simulate", "--nowhere"),
    ("simulate", "one", "two"),
    ("simulate", "--seed"),
    ("[/]",),
    (LONG,),
    ("simulate", "--speed", "0.001"),
    ("simulate", "--speed", "1e-300"),
    ("simulate", "--time-step", "1e-3"),
    ("simulate", "--time-step", "1e-300"),
    ("simulate", "--spacing", "1e300"),
    ("simulate", "--spacing", "1e-300"),
    ("simulate", "--spacing", "1e-6"),
    ("simulate", "--line-spans", "1000", "--window", "0", "--spacing", "0.03", "--time-step", "0.001"),
    ("simulate", "--line-spans", "1000", "--distance", "59000", "--speed", "5"),
    ("simulate", "--window", "999999999"),
    ("simulate", "--run-in", "20", "--speed", "0.01"),
    ("simulate", "--speed-drift", "20", "--speed", "20.001"),
    ("simulate", *SHORT[:-1], "²-³"),
    ("simulate", *SHORT[:-1], "٣-٤"),
    ("simulate", *SHORT[:-1], "1-" + HUGE),
    ("simulate", *SHORT[:-1], "1-"),
    ("simulate", *SHORT[:-1], "2-1"),
    ("simulate", *SHORT[:-1], "0-1"),
    ("simulate", *SHORT[:-1], "-1-2"),
    ("simulate", *SHORT, "--output", LONG + ".parquet"),
    ("simulate", *SHORT, "--plot", LONG + ".png"),
    ("simulate", *SHORT, "--output", "\0.parquet"),
    ("simulate", *SHORT, "--plot", "\0.png"),
    ("simulate", *SHORT, "--output", ".parquet"),
    ("simulate", *SHORT, "--output", "[bold].parquet"),
    ("simulate", *MARKUP, *SHORT[4:]),
    ("simulate", *MARKED, *SHORT[4:]),
    ("sweep", "catenary.mean_stiffness=3000,4000", *MARKUP, *SHORT[4:]),
    ("sweep", "catenary.mean_stiffness=3000,4000", *SHORT, "--policy", "p:gain=[bold]"),
    ("benchmark", "p", *MARKUP, "--seeds", "1", "--workers", "1"),
    ("evaluate", "p", *MARKUP, "--speed", "300"),
    ("rig", "rig", "--reference", "markup.toml", "--spans", "1-2", "--pantograph", "three-mass"),
    ("film", "p", *MARKUP, *SHORT[4:-2], "--output", "f.gif", "--first-span", "1"),
    ("list", "markup.toml"),
    ("list", "marked.toml"),
    ("list", "heavy.toml"),
    ("simulate", "--catenary", "heavy.toml"),
    ("line", "section:main-line"),
    ("line", "section:"),
    ("line", "section:nowhere"),
    ("line", "section:high-speed"),
    ("line", "section:bad.toml"),
    ("line", "section:main-line", "--seed", "-1"),
    ("line", "section:main-line", "--speed", "nan"),
    ("family", "main-line", "--seeds", "1"),
    ("family", "section:main-line:nowhere", "--seeds", "1"),
    ("simulate", "--catenary", "section:main-line", "--speed", "150", "--spans", "1-1", "--distance", "60"),
    ("simulate", "--catenary", "section:main-line", "--speed", "300"),
    ("simulate", "--catenary", "section:[/]"),
    ("oracle", "--catenary", "section:nowhere"),
    ("benchmark", "passive", "--catenary", "section:lists.toml", "--seeds", "1", "--workers", "1"),
    ("simulate", *SHORT, "--policy", "policies.py:Nowhere"),
    ("simulate", *SHORT, "--policy", "policies.py:Endless:depth=3"),
    ("simulate", *SHORT, "--policy", "policies.py:Huge"),
    ("simulate", *SHORT, "--policy", "policies.py:Complex"),
    ("simulate", *SHORT, "--policy", "policies.py:Words"),
    ("simulate", *SHORT, "--policy", "policies.py:Marked"),
    ("simulate", *SHORT, "--policy", "policies.py:Nothing"),
    ("simulate", *SHORT, "--policy", "policies.py:Masked"),
    ("benchmark", "passive", *QUICK, "--speed", "300", "--seeds", "50000"),
    (
        "benchmark",
        "passive",
        *QUICK,
        "--speed",
        "300",
        "--seeds",
        "1",
        "--workers",
        "1",
        "--html",
        LONG + ".html",
    ),
    ("benchmark", "p:gain=" + LONG, *QUICK, "--speed", "300", "--seeds", "1", "--workers", "1"),
    ("benchmark", "--config", "lists.toml"),
    ("benchmark", "--config", "strings.toml"),
    ("sweep", "speed_kmh=1:1e308:3", *SHORT),
    ("sweep", "speed_kmh=nan", *SHORT),
    ("sweep", "speed_kmh=200:300:" + HUGE, *SHORT),
    ("sweep", "speed_kmh=200:300:٣", *SHORT),
    ("sweep", "speed_kmh=²", *SHORT),
    ("sweep", "catenary.description=1", *SHORT),
    ("sweep", "catenary." + LONG + "=1", *SHORT),
    ("sweep", "catenary=1", *SHORT),
    ("sweep", "policy.gain=1", *SHORT),
    ("sweep", "catenary.mean_stiffness=" + "3000," * 5000 + "1", *SHORT),
    ("estimate", "wide.csv", "--pantograph", "own-two-mass"),
    ("identify", "wide.csv"),
    ("estimate", "empty.csv", "--pantograph", "own-two-mass"),
    ("identify", "empty.csv"),
    ("estimate", "motion.csv", "--pantograph", "own-two-mass", "--unit", "head=[/]"),
    ("estimate", "motion.csv", "--pantograph", "own-two-mass", "--force-model", "shaped:wavelength=nan"),
    ("identify", "rig.csv", "k1T=nan"),
    ("identify", "rig.csv", "k1T=inf"),
    ("identify", "rig.csv", "[/]=1"),
    ("train", "million.toml"),
    ("train", "lists.toml"),
    ("train", "strings.toml"),
    ("train", "deep.toml"),
    ("trainings", "training.toml", "training.toml", "--workers", "1"),
    ("dataset", "episodes", "lists.toml"),
    ("dataset", "designs", "lists.toml"),
    ("dataset", "designs", "designs.toml", "--count", "1048577"),
    ("report", "bad.json"),
    ("report", "deep.json"),
    ("report", "run.parquet"),
    ("speed", "bad.json"),
    ("speed", "deep.json"),
    ("diagnose", "bad.parquet", "--healthy", "bad.parquet"),
    ("film", "bad.parquet", "--output", "film.gif"),
    ("film", "passive", "p", "pd", "p", "pd", "--output", "film.gif"),
)


def command_lines() -> list[tuple[str, ...]]:
    """All of them, words after "panto", without any twice, the options in turn."""
    generated = [list(_of(parameter)) for parameter in parameters()]
    mixed = chain.from_iterable(zip_longest(*generated))
    return list(dict.fromkeys([*BY_HAND, *(line for line in mixed if line is not None)]))


def _without(words: tuple[str, ...], flag: str) -> tuple[str, ...]:
    """Words of a command line without an option and its values."""
    if flag not in words:
        return words
    first = words.index(flag)
    after = [k for k in range(first + 1, len(words)) if words[k].startswith("--")]
    return (*words[:first], *words[after[0] if after else len(words) :])


def _of(parameter: Parameter) -> Iterator[tuple[str, ...]]:
    usual = _without(USUAL[parameter.command], parameter.flag)  # an option is given once
    kind = Enum if issubclass(parameter.kind, Enum) else parameter.kind
    for value in BAD[kind]:
        if not parameter.flag:  # the first argument; what follows it is a usual option
            yield (*parameter.command, value, *usual[1:])
        elif kind is tuple:
            yield (*parameter.command, *usual, parameter.flag, value, value)
        else:
            yield (*parameter.command, *usual, f"{parameter.flag}={value}")
