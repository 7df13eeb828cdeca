"""How fast lanes are on a GPU: steps alone and through the environment's ``step``, beside its memory."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from itertools import product
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
STARTS = 64  # starts of episodes: their number does not change the speed
MINIMUM = 0.2  # minimum time (s) of a repeat
PAIR = 2**30  # bytes that are copied to measure the memory


def run(name: str, repeats: int, report: Report = lambda _: None) -> dict[str, Any]:
    """Everything, as plain data; name: of the device. Raises InputError where it cannot be used."""
    device = usable_device(name)
    rows: list[dict[str, Any]] = []
    for (label, (id_, settings)), lanes in product(CASES.items(), LANES):
        if rows and rows[-1]["case"] == label and "refused" in rows[-1]:
            continue
        report(f"{label}, {lanes} lanes")
        row = {"case": label, "lanes": lanes}
        given = {"num_envs": lanes, "device": name, "starts": STARTS, "figures": False, **settings}
        try:
            made: Any = gymnasium.make_vec(id_, **given)
            env: PantographTensorEnv = made.unwrapped
            env.reset(seed=0)
        except InputError as error:  # it is too small for so many
            rows.append(row | {"refused": str(error)})
            continue
        rows.append(row | _speeds(env, repeats))
        del env, made
    device_name = torch.cuda.get_device_name(device) if device.type == "cuda" else "the processor"
    return {"device": device_name, "copied": _copied(device, repeats), "repeats": repeats, "speeds": rows}


def _wait(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def _speeds(env: PantographTensorEnv, repeats: int) -> dict[str, float]:
    """Steps per second under random actions, alone and through ``step``, and what wires read and write."""
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

    def timed(count: int) -> float:
        begun = time.perf_counter()
        for _ in range(count):
            step()
        _wait(env.device)
        return time.perf_counter() - begun

    timed(1)
    count = min(most, max(1, round(MINIMUM / timed(1))))
    rates = []
    for _ in range(repeats):
        env.reset(seed=0)
        _wait(env.device)
        rates.append(env.num_envs * count / timed(count))
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
        cells = ["–", "–", row.get("refused", "–")]
        if "refused" not in row:
            cells[:2] = (f"{row[key]:,.0f}" for key in ("steps_per_second", "through_step"))
            if share := row["wire_bytes_per_second"] / result["copied"]:
                cells[2] = f"{100 * share:.0f} %"
        rows.append((row["case"], f"{row['lanes']:,}", *cells))
    title = f"{result['device']}, whose memory copies {result['copied'] / 1e9:,.0f} GB/s"
    return Table(title, ("environment", "lanes", "steps/s", "through step()", "memory's share"), rows)
