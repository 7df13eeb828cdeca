"""A controller in C beside the environment's policy: compiled, loaded, and given the same readings."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from panto_env.analysis.simulation import OFF_LINE, ready_pass
from panto_env.control.state import NOW_ROWS, Now, Result, TaskRow

GCC = shutil.which("gcc")
STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wdouble-promotion", "-Werror")
SANITIZED = ("-g", "-fsanitize=undefined,address", "-fsanitize=float-divide-by-zero,float-cast-overflow")
EXACT = {"kind": "delayed", "delay": 0.005}
"""Realistic sensors without noise: the environment takes its slow averages before the noise of readings, and
scales by the true speed; a controller on a train has only what it reads."""
AS_BUILT = {"actuator": "realistic", "sensors": EXACT, "line_condition": "as-built", "accuracy": "fast"}
needs_gcc = pytest.mark.skipif(GCC is None, reason="there is no gcc")
COMPILERS = [
    pytest.param(each, marks=pytest.mark.skipif(shutil.which(each) is None, reason=f"there is no {each}"))
    for each in ("gcc", "clang")
]

SIZE = """
#include "{name}.h"
unsigned long size(void);
unsigned long size(void) {{ return sizeof({name}_state); }}
"""
FEED = """
#include <stdio.h>
#include "{name}.h"
int main(void)
{{
    static {name}_state state;
    static {name}_readings readings;
    double force[{outputs}];
    {name}_init(&state);
    while (fread(&readings, sizeof readings, 1, stdin) == 1) {{
        {name}_step(&state, &readings, force);
        fwrite(force, sizeof force, 1, stdout);
    }}
    return 0;
}}
"""


def build(exported, folder, target, extra, *options, compiler="gcc"):
    """Compile a controller with some more C, and return the file made."""
    exported.write(folder / f"{exported.name}.c")
    (folder / "extra.c").write_text(extra.format(name=exported.name, outputs=len(exported.outputs)))
    command = [compiler, *STRICT, *options, f"{exported.name}.c", "extra.c", "-o", target, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / target


class Compiled:
    """A controller in C, as a library in this process."""

    def __init__(self, exported, folder, compiler="gcc"):
        name = f"{exported.name}-{compiler}.so"
        path = build(exported, folder, name, SIZE, "-shared", "-fPIC", compiler=compiler)
        library = ctypes.CDLL(str(path))
        library.size.restype = ctypes.c_ulong
        self.bytes_of_state = library.size()
        self._init, self._step = (getattr(library, f"{exported.name}_{each}") for each in ("init", "step"))
        self._state = ctypes.create_string_buffer(self.bytes_of_state + 16)
        self._force = (ctypes.c_double * len(exported.outputs))()
        self._readings = ctypes.c_double * len(exported.inputs)
        self.begin()

    def begin(self):
        self._init(self._state)

    def step(self, readings):
        given = readings[: self._readings._length_]  # few have need of the actuators' forces
        self._step(self._state, self._readings(*given), self._force)
        return list(self._force)


def fed(exported, folder, readings, compiler="gcc"):
    """Forces, (steps, outputs), of a program with sanitizers that is fed readings, (steps, inputs)."""
    program = build(exported, folder, "feed", FEED, *SANITIZED, compiler=compiler)
    done = subprocess.run([program], input=np.ascontiguousarray(readings).tobytes(), capture_output=True)
    assert done.returncode == 0, done.stderr
    assert not done.stderr, done.stderr
    return np.frombuffer(done.stdout).reshape(len(readings), -1)


def readings_of(task, row=0):
    """What the sensors of a task read last, as a controller on a train has it."""
    episode = task.episode
    now, averages = episode.now[row], episode.averages[row]
    read = now[Now.READING : NOW_ROWS].copy()
    read[: len(averages)] += averages
    front = now[NOW_ROWS : NOW_ROWS + episode.front.ahead.size]
    acted = [task.results.values[row, Result.FRAME_FORCE + place] for place in episode.places]
    return [*read, now[Now.SPANS], now[Now.SPEED], *front, *acted]


def passed(policy, settings, controller=None, closes=False, noted=None):
    """Run a pass; standard deviation of the force (N), largest difference of the actions (-).

    controller: runs beside the policy, or, where it ``closes`` the loop, in its place. noted: a list to which
    readings, action done and controller's action of each step are appended.
    """
    task, driver = ready_pass(policy, settings, 0)
    driver.reset(task.context(0))
    limit, most, own = task.actuator.force_limit, 0.0, None
    action = np.zeros((1, len(task.actuator.places)))
    while not (task.results.truncated[0] or task.results.terminated[0]):
        if task.results.values[0, Result.POSITION] >= -OFF_LINE:
            read = readings_of(task)
            own = None if controller is None else np.array(controller.step(read)) / limit
            action[0] = own if closes else driver.act(task.results.observation[0].copy())
        task.step(action)
        if own is not None:
            done = task.episode.table[0, TaskRow.ACTION : TaskRow.ACTION + len(own)].copy()
            most = max(most, float(np.abs(own - done).max()))
            if noted is not None:
                noted.append((read, done, own))
    return task.trajectory(0, last=True).summary("all").std, most
