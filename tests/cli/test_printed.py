"""What commands print is as it was, word for word: whoever changes it reads it, and stores it anew.

python -m tests.cli.test_printed   # writes printed/*.txt anew
"""

import contextlib
import os
import re
import tempfile
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from panto_env import simulate, terminal
from panto_env.catalog import load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.identification import (
    FREQUENCY_SWEEP,
    IDENTIFIED,
    MEASURED,
    OUTPUT_ERROR,
    PRINTED,
    Fit,
    Identification,
    add_noise,
    clean_record,
    parameters_of,
    write_record,
)

from ..command import panto

STORED = Path(__file__).with_name("printed")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")
CLOSE = 2e-3
"""Relative difference that another processor's rounding may make in a number that is printed."""

THREE_MASS = ("--catenary", "periodic-stiffness", "--pantograph", "three-mass")
HEAVY = (*THREE_MASS[:3], "heavy.toml")
FILES = {"rig.csv", "motion.csv", "heavy.toml"}
"""What ``record`` writes."""
COMMANDS = {
    "list-of-droppers": ("list", "en50318-2002"),
    "list-of-a-preset": ("list", "worn"),
    "list-of-a-policy": ("list", "pd"),
    "line": ("line", "en50318-2002", "--speed", "250"),
    "simulate": ("simulate", *THREE_MASS, "--spans", "5-8", "--policy", "p", "--seed", "3"),
    "simulate-json": ("simulate", *THREE_MASS, "--spans", "5-8", "--json"),
    "simulate-early": ("simulate", *HEAVY, "--figures", "a.csv", "--droppers", "b.csv"),
    "simulate-early-json": ("simulate", *HEAVY, "--json"),
    "sweep": ("sweep", "speed_kmh=200,250", "pantograph.masses.1=6:8:3", *THREE_MASS, "--policy", "p"),
    "sweep-json": ("sweep", "speed_kmh=250", *THREE_MASS, "--json"),
    "identify": ("identify", "rig.csv", "--measured", "k1T=32992 m2=5 k2=14544"),
    "identify-json": ("identify", "rig.csv", "--measured", "k1T=32992 m2=5 k2=14544", "--json"),
    "estimate": ("estimate", "motion.csv", "--pantograph", "own-two-mass", "--speed", "250", "--lag", "0.1"),
    "estimate-json": ("estimate", "motion.csv", "--pantograph", "own-two-mass", "--speed", "250", "--json"),
}


def record(folder):
    """Records for the commands that read one."""
    truth = parameters_of(load_pantograph("identified-2dof"))
    noisy = add_noise(clean_record(FREQUENCY_SWEEP, truth, duration=5.0), np.random.default_rng(0))
    write_record(noisy, folder / "rig.csv")
    run = simulate("periodic-stiffness", "own-two-mass", 250.0)
    noise = 2e-5 * np.random.default_rng(1).standard_normal((2, len(run.time)))
    header = "time (s),head (m),frame (m),contact_force (N)"
    table = np.column_stack([run.time, run.head + noise[0], run.frame + noise[1], run.contact_force])
    np.savetxt(folder / "motion.csv", table, delimiter=",", header=header, comments="")
    text = text_of("three-mass").replace("static_force = { value = 70", "static_force = { value = 900")
    (folder / "heavy.toml").write_text(text)


def identified(*_, **__):
    """A fit of each kind, made up: of an output-error fit the printed numbers would depend on a search."""
    truth = parameters_of(load_pantograph("identified-2dof"))
    known = {name: truth[name] for name in MEASURED}
    values = np.array([truth[name] for name in IDENTIFIED])
    fits = {
        PRINTED: Fit(PRINTED, known, IDENTIFIED, values * [1, 1, -1, 1, 1], 0.7 * values, 4321.0, 12.0),
        OUTPUT_ERROR: Fit(OUTPUT_ERROR, known, IDENTIFIED, values, 0.01 * values, 21.0, 12.0),
    }
    return Identification(4.2, fits, {"equation error, low-passed": "The record is too short."})


def printed(name):
    """Status, output and errors of a command, in a terminal of 100 columns."""
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        mock.patch.object(terminal.console, "_width", 100),
        mock.patch("panto_env.identification.identify", identified),
    ):
        if FILES & {*COMMANDS[name]}:
            record(Path(folder))
        done = panto(*COMMANDS[name])
        left = sorted(set(os.listdir(".")) - FILES)
    assert left == []
    lines = [line.rstrip() for line in f"{done.stdout}{done.stderr}status {done.returncode}\n".splitlines()]
    return "\n".join(line for line in lines if '"version"' not in line) + "\n"


def parts(text):
    """Words and numbers of a text; widths of columns depend on numbers."""
    numbers = [float(each.replace(",", "")) for each in NUMBER.findall(text)]
    return re.sub(r"[ ─━]+", " ", NUMBER.sub("#", text)).split("\n"), numbers


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_prints_what_it_did(name):
    words, numbers = parts(printed(name))
    then_words, then_numbers = parts((STORED / f"{name}.txt").read_text(encoding="utf-8"))
    assert words == then_words
    np.testing.assert_allclose(numbers, then_numbers, rtol=CLOSE, atol=1e-6)


if __name__ == "__main__":
    STORED.mkdir(exist_ok=True)
    for each in COMMANDS:
        (STORED / f"{each}.txt").write_text(printed(each), encoding="utf-8")
