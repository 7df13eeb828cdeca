"""Use what was added to a copy of the project; test_extension.py runs this in a process of its own."""

import contextlib
import inspect
import json
import sys

import gymnasium
import numpy as np

import panto_env
from panto_env.cli import main
from panto_env.envs import PantographEnv

line = "rail.toml"
env = gymnasium.make(
    "Pantograph-v0", line_condition="new", catenary=line, actuator={"kind": "integrating"}, comment="mine"
)
env.reset(seed=0)
observation, _, _, _, info = env.step(np.ones(1, dtype=np.float32))
layout = env.unwrapped.context.layout
run = panto_env.simulate(line, "three-mass", 200, "steady:share=0.25", comment="mine", distance=30.0)
sys.argv = ["panto", "simulate", "--help"]
with contextlib.suppress(SystemExit):
    main()
print(
    json.dumps(
        {
            "frame_force": info["frame_force"],
            "stiffness": float(run.contact_force[0] / run.wire[0]),
            "nominal force": layout.read(observation, "nominal force"),
            "last entry": layout.entries[-1].name,
            "policy force": float(run.frame_force[-1]),
            "in signature": "comment" in inspect.signature(PantographEnv).parameters,
            "in docstring": "`comment`" in (PantographEnv.__doc__ or ""),
        }
    )
)
