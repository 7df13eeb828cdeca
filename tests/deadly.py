"""A policy that ends its own process by SIGKILL, once, in the middle of an episode."""

from __future__ import annotations

from pathlib import Path

from .plugin import install

SOURCE = """
import os, signal
from pathlib import Path
import numpy as np

class Deadly:
    def reset(self, context):
        self.steps = 0
    def act(self, seen):
        self.steps += 1
        mark = Path(__file__).with_suffix(".dead")
        if self.steps == 30 and Path("{WANTED}").exists() and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return np.array([0.2 * np.sin(0.1 * self.steps)])
"""


def deadly(folder: Path, wanted: Path) -> str:
    """The policy, in a new file of ``folder``, as ``find_policy`` takes it.

    With the folder on Python's path it is installed, by the name "deadly".

    It kills in the 30th control step of an episode, once ``wanted`` exists; then "deadly.dead" is beside
    it, and from then on it is harmless.
    """
    source = SOURCE.replace("{WANTED}", str(wanted))
    install(folder, {"panto_env.policies": {"deadly": "deadly:Deadly"}}, {"deadly": source})
    return f"{folder / 'deadly.py'}:Deadly"
