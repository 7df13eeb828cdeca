"""Files, good and bad, that command lines of the table name: made once, and copied for each of them."""

from __future__ import annotations

import re
import shutil
import warnings
from pathlib import Path

import numpy as np

from panto_agents.stored import FOLDER as MODELS
from panto_baselines.benchmark.run import run as run_benchmark
from panto_baselines.benchmark.settings import load_benchmark
from panto_baselines.dataset.make import write_checksums
from panto_env import simulate
from panto_env.base.files import read_text
from panto_env.catalog import load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.estimation.motion import measure, write_motion
from panto_env.fitting.passes import BANDS
from panto_env.fitting.stored import Stored, store
from panto_env.fitting.values import Value
from panto_env.identification import FREQUENCY_SWEEP, clean_record, parameters_of, write_record
from panto_env.records.measured import measured
from panto_env.records.record_file import write_record as write_measured

DOCS = Path(__file__).parents[2] / "docs"
TRAINING = """
algorithm = "ppo"
total_steps = {steps}
checkpoint_steps = 128
lanes = 2
environment = {{ id = "PantographStiffness-v0", distance = 80 }}
evaluation = {{ interval_steps = 128 }}
hyperparameters = {{ n_steps = 64, batch_size = 64, n_epochs = 1, net_arch = [{widths}] }}
"""
ABLATION = """
training = "training.toml"
seeds = [2000, 2001]
total_steps = 128
judged_by = "track.toml"
judged_on = 1
[variants."no history".environment]
history = 0
"""
EPISODES = """
title = "some"
[[places]]
catenary = "periodic-stiffness"
pantograph = "three-mass"
speed_kmh = [250, 300]
[environment]
line_condition = "fair"
washout = 0
[[sets]]
name = "own"
policies = ["passive"]
episodes = 1
"""
TRACK = """
line_condition = "fair"
[[lines]]
catenary = "periodic-stiffness"
pantograph = "three-mass"
speeds_kmh = [300]
"""
STUDY = """
speeds_kmh = [250]
[variables]
"catenary.contact_wire.tension" = [20e3, 27e3]
[run]
catenary = "re330"
distance = 900
"""
DESIGNS = """
title = "some"
catenary = "periodic-stiffness"
pantograph = "three-mass"
count = 2
[ranges]
speed_kmh = [250, 300]
"""
LISTS = """
title = [1]
algorithm = ["ppo"]
lines = "all"
sets = 1
ranges = []
kind = ["flexible"]
"""
STRINGS = """
algorithm = "ppo"
lines = ["one"]
policies = "pd"
seeds = "5"
total_steps = "many"
"""
POLICIES = """
class Nothing:
    action = None
    def reset(self, context):
        pass
    def act(self, observation):
        return self.action

class Huge(Nothing):
    action = [1e400]

class Complex(Nothing):
    action = [1j]

class Words(Nothing):
    action = "up"

class Endless(Nothing):
    def __init__(self, depth):
        self.__init__(depth)
"""


def write_files(folder: Path) -> None:
    """Write all of them into a folder."""
    texts = {
        "training.toml": TRAINING.format(steps=128, widths=8),
        "million.toml": TRAINING.format(steps=128, widths=1_000_000),
        "ablation.toml": ABLATION,
        "track.toml": TRACK,
        "small.toml": f'policies = ["passive"]\nseeds = 1\n{TRACK}',
        "episodes.toml": EPISODES,
        "designs.toml": DESIGNS,
        "study.toml": STUDY,
        "policies.py": POLICIES,
        "bad.toml": "kind = [",
        "bad.json": "{",
        "deep.toml": "a = " + "[" * 20_000,
        "deep.json": "[" * 200_000,
        "lists.toml": LISTS,
        "strings.toml": STRINGS,
        "markup.toml": marked("periodic-stiffness", "a [bold]line[/] of [/] its own", "[/]line[bold]"),
        "marked.toml": marked("three-mass", "[red", "[/b]"),
        "heavy.toml": text_of("en50318-2002").replace("[droppers]", "[droppers]\nmass = 30.0"),
        "empty.csv": "",
        "wide.csv": "time (s)" + " " * 20_000 + ",head (mm),frame (mm)\n" + "0,0,0\n" * 30,
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "binary.toml").write_bytes(bytes(range(256)))
    (folder / "bad.parquet").write_bytes(b"PAR1half")
    truth = parameters_of(load_pantograph("identified-2dof"))
    write_record(clean_record(FREQUENCY_SWEEP, truth), folder / "rig.csv")
    with warnings.catch_warnings(action="ignore"):
        run = simulate("periodic-stiffness", "three-mass", distance=100.0)
        run.save(folder / "run.parquet")
        moved = simulate("periodic-stiffness", "own-two-mass", distance=300.0)
    write_motion(measure(moved), folder / "motion.csv")


def write_made_files(folder: Path) -> None:
    """Write files that commands have made, which take some seconds: passes, a model, results, a data set."""
    (folder / "passes").mkdir()
    for k in range(1, 5):
        speed = 220.0 + 0.2 * k
        run = simulate("en50318-2002", "dsa250", speed, accuracy="fast", distance=1200.0)
        run.save(folder / "passes" / f"{k}.parquet")
    write_measured(measured(run, position_error=0.3), folder / "measured.csv")
    values = tuple(Value("droppers", f"dropper {k}", "mm", 1e3, 5e-3, 6e2 + 6 * k, (k,)) for k in range(10))
    known = np.zeros(10), 1e-6 * np.eye(10), (540.0, 900.0), np.ones(BANDS), ()
    for name in ("month1", "month2"):
        store(Stored(name, "{}", "{}", values, *known), folder / f"{name}.safetensors")
    shutil.copy(next(MODELS.glob("*.safetensors")), folder / "agent.safetensors")
    (folder / "benchmark.json").write_text(read_text(DOCS / "benchmark" / "head.json.gz"), encoding="utf-8")
    run_benchmark(load_benchmark(folder / "small.toml"), workers=1).save(folder / "result.json")
    shutil.copytree(DOCS.parent / "examples" / "submission", folder / "mine")
    shutil.copy(next((DOCS / "speed").glob("*.json")), folder / "speed.json")
    (folder / "set").mkdir()
    shutil.copy(folder / "rig.csv", folder / "set" / "rig.csv")
    write_checksums(folder / "set")


def marked(entry: str, description: str, name: str) -> str:
    """The TOML file of an entry with another description, and with a name of its own."""
    new = f'name = "{name}"\ndescription = "{description}"'
    return re.sub(r'^description = ".*"', new, text_of(entry), count=1, flags=re.MULTILINE)
