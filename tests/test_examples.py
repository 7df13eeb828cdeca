"""The examples, each run and judged by a number."""

import importlib.util
import sys
from pathlib import Path

import numpy as np

from panto_env import simulate
from panto_env.metrics.spectrum import in_band

EXAMPLES = Path(__file__).parents[1] / "examples"


def load(name, monkeypatch):
    """An example as a module; its processes find it by the same name."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    spec = importlib.util.find_spec(name)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


def test_a_rig_over_udp_feels_the_line_that_another_process_computes(monkeypatch):
    """Its pantograph and cylinder are written once more there: the force is that under the line itself."""
    example = load("rig_over_udp", monkeypatch)
    forces, trips = example.run(6.0)
    assert len(trips) == len(forces) == 6000
    line = simulate("en50318-2002", example.PANTOGRAPH, example.SPEED_KMH, time_step=2.5e-4)
    true = line.contact_force[: 4 * 6000].reshape(-1, 4).mean(axis=1)
    ours, true = (in_band(each[2000:], 1e-3, 0.0, 20.0) for each in (forces, true))
    assert np.corrcoef(ours, true)[0, 1] > 0.98
    assert abs(ours.std() / true.std() - 1) < 0.05
