"""Cases: what the command ``panto`` prints as JSON or writes into files."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from tape import Tape

PANTO = (sys.executable, "-c", "from panto_env.cli import main; main()")
# Training is as exact as its sums: of threads, the order is chance.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
STUDIES = ("paper1-control", "paper1-identification", "paper3-parameters")
MEASURED = ("--measured", "k1T=32992 m2=5 k2=14544")
SMALL = ("--line-condition", "fair", "--workers", "2")
SWEEP = ("sweep", "pantograph.masses.1=5:9:3", "speed_kmh=250,300", "--spans", "5-6")
POLICY_SWEEP = ("sweep", "policy.gain=0.4,0.9", "--policy", "p", "--policy", "pd", "--speed", "280")
SIMULATE = ("simulate", "--speed", "270", "--spans", "4-9", "--policy", "fb+ff", "--seed", "3")
ARGUMENTS: dict[str, tuple[str, ...]] = {
    "list": ("list",),
    "list en50318-2002": ("list", "en50318-2002"),
    "simulate": (*SIMULATE, "--sensors", "realistic", "--line-condition", "worn"),
    "simulate, time step": ("simulate", "--time-step", "1", "--spacing", "0.25", "--window", "5"),
    "sweep": SWEEP,
    "sweep of a policy": (*POLICY_SWEEP, "--actuator", "realistic", "--sensors", "realistic"),
    "benchmark": ("benchmark", "passive", "pd", "--seeds", "2", "--speed", "250", *SMALL),
    "benchmark, realistic": (
        *("benchmark", "fb+ff", "p:gain=0.5", "--seeds", "2", "--speed", "230", *SMALL),
        *[
            "--actuator",
            "realistic",
            "--sensors",
            "realistic",
            "--catenary",
            "re250",
            "--pantograph",
            "dsa250",
        ],
    ),
}
TRAINING = """\
algorithm = "{algorithm}"
total_steps = {steps}
lanes = 4
checkpoint_steps = {steps}
environment = {{ id = "Pantograph-v0", speed_kmh = [250, 320], line_condition = "fair" }}
evaluation = {{ interval_steps = {steps} }}
hyperparameters = {hyperparameters}
"""
# Algorithm: environment steps, hyperparameters.
TRAININGS = {
    "ppo": (2048, "{ n_steps = 256, batch_size = 256 }"),
    "sac": (600, "{ learning_starts = 200, batch_size = 64 }"),
}
SLOW: dict[str, tuple[str, ...]] = {"validate": ("validate", "--window", "--wear", "--convergence")}


def cases() -> dict[str, Callable[[Tape], None]]:
    """All cases of this file by name."""
    found = {f"panto {title}": partial(_json, arguments) for title, arguments in ARGUMENTS.items()}
    return found | {"panto identify": _identify, "panto identify, options": _identify_options}


def slow_cases() -> dict[str, Callable[[Tape], None]]:
    """Those that take half a minute or more each."""
    found = {f"panto {title}": partial(_json, arguments) for title, arguments in SLOW.items()}
    found |= {f"panto reproduce {study}": partial(_reproduce, study) for study in STUDIES}
    if find_spec("stable_baselines3") is None:  # without the extra 'agents'
        return found
    return found | {f"panto train {algorithm}": partial(_train, algorithm) for algorithm in TRAININGS}


def _panto(arguments: tuple[str, ...], folder: str = ".") -> subprocess.CompletedProcess[str]:
    """Run a command in a folder; raises RuntimeError with what it said where it fails."""
    done = subprocess.run(
        [*PANTO, *arguments], cwd=folder, env=os.environ | ONE_THREAD, capture_output=True, text=True
    )
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:  # 1: a figure that is not accepted
        raise RuntimeError(f"panto {arguments[0]} ended with {done.returncode}:\n{done.stderr}")
    return done


def _json(arguments: tuple[str, ...], tape: Tape, folder: str = ".") -> None:
    done = _panto((*arguments, "--json"), folder)
    tape.add("exit status", done.returncode)
    tape.add("printed", json.loads(done.stdout))


def _train(algorithm: str, tape: Tape) -> None:
    """What an agent that was trained for seconds does."""
    steps, hyperparameters = TRAININGS[algorithm]
    with TemporaryDirectory() as folder:
        text = TRAINING.format(algorithm=algorithm, steps=steps, hyperparameters=hyperparameters)
        (Path(folder) / "training.toml").write_text(text, encoding="utf-8")
        _panto(("train", "training.toml", "--output", "run"), folder)
        _json(("evaluate", "run/model.safetensors", "--seeds", "2"), tape, folder)


def _reproduce(study: str, tape: Tape) -> None:
    """Numbers of a study, and the bytes of its pictures."""
    with TemporaryDirectory() as folder:
        _panto(("reproduce", study, "--output", "."), folder)
        files = sorted(path for path in Path(folder).rglob("*") if path.is_file())
        tape.add("files", [path.name for path in files])
        for path in files:
            if path.suffix == ".json":
                tape.add(path.stem, json.loads(path.read_text(encoding="utf-8")))
            else:
                tape.add(f"picture {path.stem}", path.read_bytes())


def _identify(tape: Tape, options: tuple[str, ...] = ()) -> None:
    with TemporaryDirectory() as folder:
        (Path(folder) / "rig.csv").write_text(_rig(), encoding="utf-8")
        _json(("identify", "rig.csv", *MEASURED, *options), tape, folder)


def _identify_options(tape: Tape) -> None:
    _identify(tape, ("--free-offset", "--band", "5", "--method", "low-passed"))


def _rig(duration: float = 10.0, step: float = 1e-3, parts: int = 20) -> str:
    """Record of a two-mass pantograph on a plate that is swept from 0.3 to 4 Hz, with noise, as CSV.

    duration, step: s. Each step is integrated in so many parts: the first spring is stiff.
    """
    k1, c1, m2, k2, c2, m3, k3, c3 = 32992.0, 12.0, 5.0, 14544.0, 40.0, 10.4, 612.0, 110.0  # SI
    y2 = y3 = 0.0543
    v2 = v3 = 0.0
    part = step / parts
    noise = np.random.default_rng(1).standard_normal((round(duration / step), 4))
    lines = ["time (s),force (N),y_p1 (mm),y_p2 (mm),y_p3 (mm)"]
    for k in range(len(noise)):
        for j in range(parts):
            time = (k + j / parts) * step
            turn = 2 * math.pi * (0.3 * time + (4.0 - 0.3) / duration * time**2 / 2)
            turning = 2 * math.pi * (0.3 + (4.0 - 0.3) / duration * time)
            y1, v1 = 0.0543 + 0.00099 * math.sin(turn), 0.00099 * turning * math.cos(turn)
            force = k1 * (y1 - y2) + c1 * (v1 - v2)
            inner = k2 * (y2 - y3) + c2 * (v2 - v3)
            if j == 0:
                clean = (force, 1e3 * y1, 1e3 * y2, 1e3 * y3)
                rms = (0.02, 0.002, 0.002, 0.002)
                shown = (c + r * n for c, r, n in zip(clean, rms, noise[k].tolist(), strict=True))
                lines.append(",".join([f"{time:.3f}", *(f"{value:.6f}" for value in shown)]))
            v2 += part * (force - inner) / m2
            v3 += part * (inner - k3 * y3 - c3 * v3) / m3
            y2 += part * v2
            y3 += part * v3
    return "\n".join(lines) + "\n"
