"""How fast lanes are on a GPU: steps by themselves, and through the environment's ``step``, beside its
memory.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import torch

from ...base.errors import InputError
from ...base.table import Table
from ...control.state import TaskRow
from ...envs import IDS
from ...envs.tensors import PantographTensorEnv, usable_device
from ...plant.state import Row
from .study import Report

LANES = (1, 32, 1024, 8192, 65_536, 262_144, 1_048_576)
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "Pantograph-v0": ("Pantograph-v0", {}),
    'Pantograph-v0, accuracy="fast"': ("Pantograph-v0", {"accuracy": "fast"}),
    **{name: (name, {}) for name in IDS if name != "Pantograph-v0"},
}
STARTS = 64
"""Starts of episodes: their number does not change the speed."""
MINIMUM = 0.2
"""Minimum time (s) of a repeat."""
PAIR = 2**30
"""Bytes that are copied to measure the memory."""


def run(name: str, repeats: int, report: Report = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data; name: of the device. Raises InputError where it cannot be used."""
    device, rows = usable_device(name), []
    for label, (id_, settings) in CASES.items():
        for lanes in LANES:
            report(f"{label}, {lanes} lanes")
            try:
                made: Any = gymnasium.make_vec(
                    id_, num_envs=lanes, device=name, starts=STARTS, figures=False, **settings
                )
                env: PantographTensorEnv = made.unwrapped
                env.reset(seed=0)
            except InputError as error:  # it is too small for so many
                rows.append({"case": label, "lanes": lanes, "refused": str(error)})
                break
            rows.append({"case": label, "lanes": lanes} | _speeds(env, repeats))
            del env, made
    return {"device": _name(device), "copied": _copied(device, repeats), "repeats": repeats, "speeds": rows}


def _name(device: torch.device) -> str:
    return torch.cuda.get_device_name(device) if device.type == "cuda" else "the processor"


def _wait(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def _speeds(env: PantographTensorEnv, repeats: int) -> dict[str, float]:
    """Steps per second under random actions, by themselves and through ``step``, and what wires read and
    write.
    """
    random = torch.Generator(env.device).manual_seed(0)
    shape = env.action_space.shape or ()
    actions = 2 * torch.rand(shape, generator=random, device=env.device) - 1
    nobody = torch.zeros(env.num_envs, dtype=torch.bool, device=env.device)
    lanes, wire = env._lanes, env.task.plant.model.wire
    # Steps by themselves begin no episodes, and lanes whose episode has ended stand still.
    ends = env.task.episode.table[:, TaskRow.END] - env.task.plant.row(Row.STEP)
    most = int(ends.min()) // env.task.length.control_steps
    raw = _median(lambda: lanes.step(actions, nobody, random), env, repeats, most // 2)
    whole = _median(lambda: env.step(actions), env, repeats)
    moved = 0.0
    if hasattr(wire, "displacement"):  # read and written once in each step of the plant
        once = wire.displacement.nbytes + wire.increment.nbytes
        moved = 2 * once / env.task.lanes * env.task.length.control_steps
    return {"steps_per_second": raw, "through_step": whole, "wire_bytes_per_second": moved * raw}


def _median(step: Callable[[], Any], env: PantographTensorEnv, repeats: int, most: int = 10**9) -> float:
    """Environment steps per second, the median of repeats of at most so many steps, each from new starts."""
    step()
    _wait(env.device)
    begun = time.perf_counter()
    step()
    _wait(env.device)
    count = min(most, max(1, round(MINIMUM / (time.perf_counter() - begun))))
    rates = []
    for _ in range(repeats):
        env.reset(seed=0)
        _wait(env.device)
        begun = time.perf_counter()
        for _ in range(count):
            step()
        _wait(env.device)
        rates.append(env.num_envs * count / (time.perf_counter() - begun))
    return statistics.median(rates)


def _copied(device: torch.device, repeats: int) -> float:
    """Bytes per second, read and written, of a copy within the device's memory."""
    one = torch.zeros(PAIR, dtype=torch.uint8, device=device)
    other, rates = torch.empty_like(one), []
    for _ in range(repeats + 1):
        begun = time.perf_counter()
        other.copy_(one)
        _wait(device)
        rates.append(2 * PAIR / (time.perf_counter() - begun))
    return statistics.median(rates[1:])


def table(result: dict[str, Any]) -> Table:
    """Speeds by case and lanes."""
    rows = []
    for row in result["speeds"]:
        lanes = f"{row['lanes']:,}"
        if "refused" in row:
            rows.append((row["case"], lanes, "–", "–", row["refused"]))
            continue
        share = row["wire_bytes_per_second"] / result["copied"]
        speeds = (f"{row[key]:,.0f}" for key in ("steps_per_second", "through_step"))
        rows.append((row["case"], lanes, *speeds, f"{100 * share:.0f} %" if share else "–"))
    title = f"{result['device']}, whose memory copies {result['copied'] / 1e9:,.0f} GB/s"
    return Table(title, ("environment", "lanes", "steps/s", "through step()", "memory's share"), rows)
