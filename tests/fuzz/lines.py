"""Command lines that users should not write: every option of every command times values that are no good."""

from collections.abc import Iterator
from itertools import chain, zip_longest
from typing import Any

from ..command import whole

HUGE = "1" + "0" * 400
LONG = "x" * 5000
QUICK = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass")
"""A line and a pantograph that are computed in no time."""
SHORT = (*QUICK, "--distance", "100", "--spans", "1-2")
LINE, RUN = " ".join(QUICK), " ".join(SHORT)
ONE = "--seeds 1 --workers 1"
PASSES = "passes/1.parquet --healthy passes/2.parquet passes/3.parquet passes/4.parquet"

USUAL = {
    tuple(command.split()): tuple(words.split())
    for command, words in {
        "list": "pd",
        "simulate": RUN,
        "film": f"passive {LINE} --distance 600 --first-span 1 --seconds 0.1 --size 64 64 --output film.gif",
        "sweep": f"catenary.mean_stiffness=3000,4000 --workers 1 {RUN}",
        "line": "re250",
        "family": "high-speed --seeds 1",
        "validate": "",
        "identify": "rig.csv --measured k1T=32992,m2=5,k2=14544",
        "estimate": "motion.csv --pantograph own-two-mass",
        "record": "measured.csv --line en50318-2002",
        "compare": "measured.csv passes/4.parquet",
        "fit": "measured.csv --line en50318-2002 --pantograph dsa250 --free tensions",
        "drift": "month1.safetensors month2.safetensors",
        "diagnose": PASSES,
        "speed": "speed.json",
        "reproduce": "paper3-parameters",
        "permissible-speed": f"re330 --distance 900 --speeds 250:250:10 {ONE}",
        "design": "study.toml --designs 1 --workers 1 --output design",
        "rig": "rig --reference periodic-stiffness --spans 1-2",
        "ablation": "ablation.toml --workers 1",
        "benchmark": f"passive {LINE} --speed 300 {ONE}",
        "evaluate": f"passive {LINE} --speed 300 --line-condition fair",
        "export": "agent.safetensors model.safetensors",
        "oracle": f"{LINE} --spans 1-1 --hops 0",
        "replay": "result.json --workers 1",
        "report": "benchmark.json",
        "returns": "result.json --id PantographStiffness-v0 --episodes 2 --workers 1",
        "submission check": f"mine --config small.toml {ONE}",
        "train": "training.toml --output run",
        "trainings": "training.toml --workers 1",
        "tune": f"skyhook {LINE} --passes 1 --speed 300 {ONE} --output gains.toml",
        "dataset episodes": "episodes.toml --workers 1",
        "dataset designs": "designs.toml --workers 1",
        "dataset verify": "set",
    }.items()
}
"""What goes before the bad option, or is an argument in whose place the bad one stands: quick to compute."""

BAD = (
    *("-1", "1.5", "٣", "²", HUGE, "nan", "", "1e308", "1,5", "[/]", LONG, "a\nb", "nowhere:x=1", "a=b"),
    *("../..", "nowhere/x.toml", "bad.toml", "deep.toml", "lists.toml", "binary.toml", "picture.png", "None"),
    *("ideal:delay=nan", "new:wear_depth=" + HUGE, "pd:gain=" + "-" * 3000 + "1", "pd:" + "gain=1," * 500),
)
"""Values for every option that takes one."""

WORDS = f"""
nowhere
[/]
simulate --nowhere
simulate one two
simulate --seed
simulate --speed 1e-300
simulate --time-step 1e-3
simulate --time-step 1e-300
simulate --spacing 1e300
simulate --spacing 1e-300
simulate --line-spans 1000 --window 0 --spacing 0.03 --time-step 0.001
simulate --line-spans 1000 --distance 59000 --speed 5
simulate --window 999999999
simulate --run-in 20 --speed 0.01
simulate --speed-drift 20 --speed 20.001
simulate {LINE} --spans ٣-٤
simulate {LINE} --spans 1-{HUGE}
simulate {LINE} --spans 2-1
simulate {RUN} --output {LONG}.parquet
simulate {RUN} --plot {LONG}.png
simulate {RUN} --output .parquet
simulate {RUN} --output [bold].parquet
simulate --catenary markup.toml --pantograph marked.toml --distance 100 --spans 1-2
sweep catenary.mean_stiffness=3000,4000 {RUN} --policy p:gain=[bold]
benchmark p --catenary markup.toml --pantograph three-mass {ONE}
rig rig --reference markup.toml --spans 1-2 --pantograph three-mass
film p --catenary markup.toml --pantograph three-mass --distance 100 --output f.gif --first-span 1
list markup.toml
list heavy.toml
simulate --catenary heavy.toml
line section:main-line
line section:
line section:nowhere
line section:bad.toml
line section:main-line --speed nan
family section:main-line:nowhere --seeds 1
simulate --catenary section:main-line --speed 150 --spans 1-1 --distance 60
simulate --catenary section:main-line --speed 300
oracle --catenary section:nowhere
benchmark passive --catenary section:lists.toml {ONE}
simulate {RUN} --policy policies.py:Nowhere
simulate {RUN} --policy policies.py:Endless:depth=3
simulate {RUN} --policy policies.py:Huge
simulate {RUN} --policy policies.py:Complex
simulate {RUN} --policy policies.py:Words
simulate {RUN} --policy policies.py:Nothing
benchmark passive {LINE} --speed 300 --seeds 50000
benchmark passive {LINE} --speed 300 {ONE} --html {LONG}.html
benchmark --config lists.toml
benchmark --config strings.toml
sweep speed_kmh=1:1e308:3 {RUN}
sweep speed_kmh=200:300:{HUGE} {RUN}
sweep speed_kmh=² {RUN}
sweep catenary.description=1 {RUN}
sweep catenary.{LONG}=1 {RUN}
sweep catenary=1 {RUN}
sweep policy.gain=1 {RUN}
estimate wide.csv --pantograph own-two-mass
identify wide.csv
estimate empty.csv --pantograph own-two-mass
estimate motion.csv --pantograph own-two-mass --unit head=[/]
estimate motion.csv --pantograph own-two-mass --force-model shaped:wavelength=nan
identify rig.csv k1T=nan
identify rig.csv [/]=1
train million.toml
train lists.toml
train strings.toml
train deep.toml
trainings training.toml training.toml --workers 1
dataset episodes lists.toml
dataset designs lists.toml
dataset designs designs.toml --count 1048577
app --port 0
app --port 65536
app --port nan
app --port ٣
report bad.json
report deep.json
report run.parquet
speed bad.json
diagnose bad.parquet --healthy bad.parquet
film bad.parquet --output film.gif
film passive p pd p pd --output film.gif
"""
BY_HAND = [tuple(line.split(" ")) for line in WORDS.strip().splitlines()]


def command_lines() -> list[tuple[str, ...]]:
    """All of them, words after "panto", without any twice, the options in turn."""
    mixed = chain.from_iterable(zip_longest(*map(list, _generated(whole()))))
    return list(dict.fromkeys([*BY_HAND, *(line for line in mixed if line is not None)]))


def _generated(command: Any, words: tuple[str, ...] = ()) -> Iterator[Iterator[tuple[str, ...]]]:
    for name, below in getattr(command, "commands", {}).items():
        yield from _generated(below, (*words, name))
    if words in USUAL:
        named = [each for each in command.params if not each.is_eager and not getattr(each, "is_flag", False)]
        for each in named:
            yield _with_bad(words, each)


def _with_bad(command: tuple[str, ...], parameter: Any) -> Iterator[tuple[str, ...]]:
    words, flag = USUAL[command], max(parameter.opts, key=len)
    if flag in words:  # an option is given once
        first = words.index(flag)
        after = [k for k in range(first + 1, len(words)) if words[k].startswith("--")]
        words = (*words[:first], *words[after[0] if after else len(words) :])
    for value in BAD:
        if not flag.startswith("--"):  # the first argument; what follows it is a usual option
            yield (*command, value, *words[1:])
        elif parameter.nargs > 1:
            yield (*command, *words, flag, *[value] * parameter.nargs)
        else:
            yield (*command, *words, f"{flag}={value}")
