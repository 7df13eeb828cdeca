"""What a controller's step costs on a small processor: instructions, stack and memory.

Its C is compiled for the processor and runs in an emulator, which counts every instruction, those that a
condition skips too, with the mathematical functions that it calls. Instructions are not cycles: an emulator
knows nothing of caches, of waiting for memory, or of two instructions at once.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from panto_env.base.errors import InputError, suggest
from panto_env.base.extras import require

from .export import Exported
from .fmu import run_tool

PROCESSORS = {
    "cortex-m4": ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"),  # float in hardware, double by functions
    "cortex-m7": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"),
}
"""Options of the compiler for each processor."""
FLAGS = ("-std=c99", "-O2", "-mthumb", "-mfloat-abi=hard", "-ffunction-sections", "-fdata-sections")
PREFIX = "arm-none-eabi-"
PROGRAM, MEMORY, RETURN = 0x10000, 0x1000000, 0xFF0000
"""Address of the program, size of the memory from 0 on that it has, and address that a call returns to."""
STACK, DEPTH = 0x20000000, 0x10000
"""Address and size of the stack."""
PAINT = 0xA5
CLOCK = 100e6
"""Hz, with one instruction at each beat, for the share of the interval that a step takes."""
HOSTILE = (math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e-310, 1e9, -1e9, 1.7e308, -1.7e308)
"""Readings of broken sensors, of which some take the slow ways through functions and number formats."""
TYPICAL = {"N": (120.0, 60.0), "m": (0.0, 0.05), "m/s": (40.0, 40.0), "spans": (20.0, 20.0)}
"""Mean and deviation of readings, by unit; (0, 1) for others."""
STRIDE = 0.0128
"""Spans of 65 m that a train at 300 km/h passes in a step of 10 ms."""


@dataclass(frozen=True)
class Cost:
    """Cost of a controller on a processor."""

    worst: int  # instructions of the costliest step
    mean: float  # instructions of a step
    start: int  # instructions of the start
    program: int  # bytes of code and constants, mathematical functions included
    state: int  # bytes
    stack: int  # bytes, the deepest of all calls
    interval: float  # of control (s)

    @property
    def share(self) -> float:
        """Share of the interval that the costliest step takes at ``CLOCK``."""
        return self.worst / (self.interval * CLOCK)


def cost(exported: Exported, processor: str = "cortex-m7", steps: int = 100, seed: int = 0) -> Cost:
    """Cost over steps with readings that are drawn: as on a line, with single broken sensors, and nonsense.

    Raises InputError for an unknown processor, where the cross-compiler or the package unicorn is missing, or
    where the controller doesn't compile or needs more than 64 KiB of stack.
    """
    if processor not in PROCESSORS:
        raise InputError(f"There is no processor {processor}; {suggest(processor, list(PROCESSORS))}.")
    if shutil.which(f"{PREFIX}gcc") is None:
        raise InputError(
            f"Costs need the compiler {PREFIX}gcc with newlib; install gcc-arm-none-eabi and "
            "libnewlib-arm-none-eabi, as Debian calls them."
        )
    require("A step's cost", "onboard", "unicorn")
    image, symbols, program = _program(exported, PROCESSORS[processor])
    emulator = _Emulator(image, {name: address for name, (address, _) in symbols.items()})
    start, counts = emulator.call("begin"), []
    for readings in drawn(exported, steps, seed):
        emulator.write("readings", readings.astype("<f8").tobytes())
        counts.append(emulator.call("step"))
    return Cost(
        worst=max(counts),
        mean=float(np.mean(counts)),
        start=start,
        program=program,
        state=symbols["state"][1],
        stack=emulator.depth(),
        interval=exported.interval,
    )


def drawn(exported: Exported, steps: int, seed: int) -> Iterator[NDArray[np.float64]]:
    """Readings of each step, (inputs,), in their units: half of the steps as on a line, then with faults.

    On the line the place moves on, so that a controller that must first listen gets to act, if there are
    steps enough. Then the place jumps; in a third of these steps one sensor on average reads nonsense, in
    another third every one.
    """
    random = np.random.default_rng(seed)
    means, scales = np.transpose([TYPICAL.get(each.unit, (0.0, 1.0)) for each in exported.inputs])
    spans = np.array([each.unit == "spans" for each in exported.inputs])
    for step in range(steps):
        readings = random.normal(means, scales)
        broken = 0.0
        if step < steps // 2:
            readings[spans] = STRIDE * step
        else:
            broken = random.choice((0.0, 1.0 / len(means), 1.0))
        yield np.where(random.random(len(means)) < broken, random.choice(HOSTILE, len(means)), readings)


def _program(exported: Exported, processor: tuple[str, ...]) -> tuple[bytes, dict[str, tuple[int, int]], int]:
    """Image from ``PROGRAM`` on, addresses and sizes of its symbols, and bytes of code and constants."""
    name = exported.name
    harness = (
        f'#include "{name}.h"\n{name}_state state;\n{name}_readings readings;\n'
        f"double force[{len(exported.outputs)}];\n"
        f"void begin(void) {{ {name}_init(&state); }}\n"
        f"void step(void) {{ {name}_step(&state, &readings, force); }}\n"
    )
    link = ("--specs=nosys.specs", "-nostartfiles", f"-Wl,--gc-sections,-u,begin,-e,step,-Ttext={PROGRAM:#x}")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        texts = {f"{name}.c": exported.source, f"{name}.h": exported.header, "harness.c": harness}
        for each, text in texts.items():
            (folder / each).write_text(text)
        _tool(folder, "gcc", *FLAGS, *processor, *link, "-o", "program", f"{name}.c", "harness.c", "-lm")
        _tool(folder, "objcopy", "-O", "binary", "program", "image")
        symbols = {}
        for line in _tool(folder, "nm", "-S", "program").splitlines():
            address, size, *rest = line.split()
            if len(rest) == 2:
                symbols[rest[1]] = int(address, 16), int(size, 16)
        text, data = _tool(folder, "size", "program").splitlines()[1].split()[:2]
        return (folder / "image").read_bytes(), symbols, int(text) + int(data)


def _tool(folder: Path, name: str, *arguments: str) -> str:
    """What a tool prints. Raises InputError where it fails."""
    return run_tool(folder, [f"{PREFIX}{name}", *arguments], f"{PREFIX}{name} failed on the controller")


class _Emulator:
    """A processor with a program, whose calls are counted."""

    def __init__(self, image: bytes, symbols: dict[str, int]) -> None:
        """image: from ``PROGRAM`` on. symbols: addresses."""
        import unicorn
        from unicorn import arm_const

        self._symbols, self._registers = symbols, arm_const
        self._blocks: Counter[tuple[int, int]] = Counter()
        self._machine: Any = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB)
        self._machine.ctl_set_cpu_model(arm_const.UC_CPU_ARM_MAX)  # it has the instructions of all of them
        self._machine.mem_map(0, MEMORY)
        self._machine.mem_write(PROGRAM, image)
        self._machine.mem_map(STACK, DEPTH)
        self._machine.mem_write(STACK, bytes([PAINT]) * DEPTH)
        access = self._machine.reg_read(arm_const.UC_ARM_REG_C1_C0_2) | 0xF << 20
        self._machine.reg_write(arm_const.UC_ARM_REG_C1_C0_2, access)  # to the floating-point unit,
        self._machine.reg_write(arm_const.UC_ARM_REG_FPEXC, 1 << 30)  # which is switched on here
        self._machine.hook_add(unicorn.UC_HOOK_BLOCK, self._count)
        self._error = unicorn.UcError

    def write(self, name: str, content: bytes) -> None:
        """Put bytes into a variable."""
        self._machine.mem_write(self._symbols[name], content)

    def call(self, name: str) -> int:
        """Instructions of a call of a function without arguments."""
        self._blocks.clear()
        self._machine.reg_write(self._registers.UC_ARM_REG_SP, STACK + DEPTH)
        self._machine.reg_write(self._registers.UC_ARM_REG_LR, RETURN | 1)
        try:
            self._machine.emu_start(self._symbols[name] | 1, RETURN)
        except self._error as error:
            raise InputError(
                f"The controller failed in the emulator ({error}), as one does that needs more than "
                f"{DEPTH} bytes of stack."
            ) from error
        return sum(times * self._length(*block) for block, times in self._blocks.items())

    def depth(self) -> int:
        """Bytes of the stack that calls have written to."""
        touched = np.frombuffer(self._machine.mem_read(STACK, DEPTH), dtype=np.uint8) != PAINT
        return int(DEPTH - np.argmax(touched)) if touched.any() else 0

    def _count(self, machine: Any, address: int, size: int, data: Any) -> None:
        self._blocks[address, size] += 1

    def _length(self, address: int, size: int) -> int:
        """Instructions of a block: of four bytes where a half-word begins with the bits of 29 to 31."""
        halves = np.frombuffer(self._machine.mem_read(address, size), dtype="<u2") >> 11
        place = count = 0
        while place < len(halves):
            place += 2 if halves[place] >= 29 else 1
            count += 1
        return count
