"""Random environments under hostile hands: each is refused in a sentence, or stays finite and in its space.

python -m tests.fuzz.environments --count 2000   # tells each bad end, then how many there were of each kind
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import warnings
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from pydantic import ValidationError

from panto_env import InputError
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import load_drawn

from .processes import End, run_all

LIMIT = 120.0
"""Seconds that a case may take: with a kernel to compile, on a busy machine."""
BAD = "bad"
USUAL, WILD = 3.0, 30.0
"""By how much values differ from the catalogue's, either way; in the wild tier, a third of all cases."""
STEPS = 120
KEPT = ("kind", "name", "description", "sources", "spans", "modes", "sampling_interval")
"""Of a line or a pantograph, not varied: names, and what decides how long a case takes."""
LENGTHS = ("span_length", "positions", "sag")
"""Varied by one factor, up to ``GEOMETRY`` either way: else droppers would not lie in their span."""
GEOMETRY = 1.5


def varied(value: Any, random: np.random.Generator, most: float) -> Any:
    """Plain data with a third of its numbers multiplied by up to so much, either way."""
    stretch = float(np.exp(random.uniform(-1, 1) * np.log(GEOMETRY)))

    def change(value: Any, key: str) -> Any:
        if isinstance(value, dict):
            return {name: change(each, name) for name, each in value.items()}
        if isinstance(value, list):
            return [change(each, key) for each in value]
        if key in KEPT or not isinstance(value, float):
            return value
        if key in LENGTHS:
            return value * stretch
        chosen = random.random() < 1 / 3
        return value * float(np.exp(random.uniform(-1, 1) * np.log(most))) if chosen else value

    return change(value, "")


def one_of(random: np.random.Generator, *values: Any) -> Any:
    return values[random.integers(len(values))]


def case_of(seed: int) -> dict[str, Any]:
    """What the environment of a seed is made with, and how it is used."""
    random = np.random.default_rng(seed)
    most = WILD if seed % 3 == 2 else USUAL
    entries = {
        "catenary": load_catenary(one_of(random, *available("catenary"))),
        "pantograph": load_pantograph(one_of(random, *available("pantograph"))),
    }
    settings: dict[str, Any] = {
        "speed_kmh": float(random.uniform(50, 450)),
        "accuracy": one_of(random, "fast", "full"),
        "distance": float(random.uniform(1, 150)),
        "line_condition": one_of(
            random, "new", "fair", "worn", *CONDITIONS.get(entries["catenary"].kind, ())
        ),
        "actuator": one_of(
            random, "ideal", "realistic", {"place": "both"}, {"force_limit": 2000.0, "lag": 0.0}
        ),
        "sensors": one_of(random, "ideal", "realistic", "blind"),
        "observation": one_of(random, "measured", "centred", "full"),
        "reward": one_of(random, "paper1", "agent"),
        "run_in": one_of(random, 0, 2),
        "control_interval": one_of(random, 0.01, 0.02),
        "bilateral": bool(random.random() < 0.1),
        "history": int(random.integers(0, 3)),
        "harmonics": int(random.integers(1, 4)),
        "pantograph_scatter": one_of(random, 0.0, 0.2),
        "speed_drift": one_of(random, 0.0, 5.0),
        "mean_force": one_of(random, None, None, 90.0),
    }
    if drawn := drawn_of(np.random.default_rng([seed, 1])):
        entries["catenary"] = drawn
        settings["speed_kmh"] = (50.0, 450.0)  # of which those of the drawn lines are left
        settings["line_condition"] = one_of(random, "new", "fair", "worn", *CONDITIONS["flexible"])
    chosen = {name: value for name, value in settings.items() if name in KEEP or random.random() < 0.4}
    entries = {
        name: (type(entry), varied(entry.model_dump(mode="json"), random, most))
        for name, entry in entries.items()
    }
    if drawn and seed % 2:  # as it is: with other ranges most are refused
        entries["catenary"] = (type(drawn), drawn.model_dump(mode="json"))
    return {
        "entries": entries,
        "settings": chosen,
        "lanes": one_of(random, 0, 0, 3),
        "hand": one_of(random, *HANDS),
        "seed": seed,
    }


def drawn_of(random: np.random.Generator) -> Any:
    """In some cases a family of lines, or a section, to draw a line from in each episode."""
    if random.random() > DRAWN:
        return None
    names = [f"{kind}:{name}" for kind in ("family", "section") for name in available(kind)]
    return load_drawn(one_of(random, *names))


DRAWN = 1 / 6
"""Share of cases whose lines are drawn."""
CONDITIONS = {
    "flexible": ("as-built", "as-built", {"ice": 0.5}, {"ice": 0.2, "wind": 12.0}, {"side_wind": 25.0})
}
"""Further conditions that lines of a kind have."""
KEEP = ("speed_kmh", "distance")
HANDS = ("uniform", "reversed", "full", "huge", "wrong")
WRONG = (np.nan, np.inf, "up", None, 1j, [[1.0, 2.0], [3.0]], np.zeros((3, 7)), object())


def action_of(hand: str, k: int, random: np.random.Generator, shape: tuple[int, ...]) -> Any:
    """The action of a step."""
    if hand == "uniform":
        return random.uniform(-1, 1, shape)
    if hand == "huge":
        return random.choice([-1e308, 1e308, 5e-324, 0.0], shape)
    return np.full(shape, -1.0 if hand == "reversed" and k % 2 else 1.0)


def run_case(case: dict[str, Any]) -> None:
    """Run it, and print how it ended; AssertionError where that is bad."""
    warnings.simplefilter("ignore")
    try:
        kind = _ended(case)
    except (InputError, ValidationError) as error:
        sentence = str(error)
        if isinstance(error, InputError):
            assert sentence.endswith("."), sentence
            assert "\n" not in sentence, sentence
        kind = "refused"
        print(sentence)
    print(kind)


def _ended(case: dict[str, Any]) -> str:
    lanes, seed = case["lanes"], case["seed"]
    entries = {name: schema.model_validate(table) for name, (schema, table) in case["entries"].items()}
    settings = entries | case["settings"]
    name = "panto_env:PantographStiffness-v0"  # it sets nothing but line and pantograph
    env: Any = (
        gymnasium.make_vec(name, num_envs=lanes, **settings)
        if lanes
        else gymnasium.make(name, disable_env_checker=True, **settings)
    )
    random, space, shape = np.random.default_rng(seed), env.observation_space, env.action_space.shape
    seen, _ = env.reset(seed=seed)
    kind, running = "finite", True
    for k in range(STEPS):
        if not space.contains(seen):
            raise AssertionError(f"the observation is outside its space: {seen}")
        if not running:
            seen, _ = env.reset()
            running = True
        if case["hand"] == "wrong" and k % 10 == 0:
            _refused(env, WRONG[k // 10 % len(WRONG)], shape)
        seen, reward, terminated, truncated, info = env.step(action_of(case["hand"], k, random, shape))
        assert np.isfinite(reward).all(), f"the reward is {reward}"
        if np.any(terminated):
            kind = "ended early"
        if not lanes and (terminated or truncated):
            running = False
            assert not any(np.isnan(each) for each in info["figures"].values())
    env.close()
    return kind


def _refused(env: Any, action: Any, shape: tuple[int, ...]) -> None:
    """A wrong action is refused in a sentence."""
    given = np.full(shape, action) if isinstance(action, float) else action
    with pytest.raises(InputError, match=r"\.$"):
        env.step(given)


def judged(end: End) -> str:
    """Of which kind an end is; bad ones begin with BAD."""
    if end.status is None:
        return f"{BAD}: it hung"
    if end.status < 0:
        return f"{BAD}: it crashed"
    return end.output.split("\n")[-2] if end.status == 0 else f"{BAD}: an error of another kind"


def tried(seeds: range, folder: Path, tell: Any = print) -> Counter[str]:
    """How many cases ended in each way; each bad one is told."""
    ends: Counter[str] = Counter()
    for number, end in run_all([partial(run_case, case_of(seed)) for seed in seeds], folder, LIMIT):
        kind = judged(end)
        ends[kind] += 1
        if kind.startswith(BAD):
            tell(f"seed {seeds[number]}: {kind} after {end.seconds:.0f} s\n{end.errors[-1500:]}")
    return ends


def main() -> None:
    """Try as many as asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ends = tried(range(given.first, given.first + given.count), Path(folder))
    print(json.dumps(ends))
    sys.exit(any(kind.startswith(BAD) for kind in ends))


if __name__ == "__main__":
    main()
