"""Random environments under hostile hands: each is refused in a sentence, or stays finite and in its space.

CASES=2000 is how many are tried. Each time the same ones: what fails here fails anywhere.
"""

import os
import re
import warnings
from collections import Counter
from typing import Any

import gymnasium
import numpy as np
import pytest
from pydantic import ValidationError

from panto_env import InputError
from panto_env.backend import JIT
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import load_drawn

FIRST = 50_000
"""Of the seeds."""
USUAL, WILD = 3.0, 30.0
"""By how much values differ from the catalogue's, either way; in the wild tier, a third of all cases."""
STEPS = 120
KEPT = ("kind", "name", "description", "sources", "spans", "modes", "sampling_interval")
"""Of a line or a pantograph, not varied: names, and what decides how long a case takes."""
LENGTHS = ("span_length", "positions", "sag")
"""Varied by one factor, up to ``GEOMETRY`` either way: else droppers would not lie in their span."""
GEOMETRY = 1.5
DRAWN = 1 / 6
"""Share of cases whose lines are drawn."""
WEATHER = ("as-built", "as-built", {"ice": 0.5}, {"ice": 0.2, "wind": 12.0}, {"side_wind": 25.0})
"""Further conditions of flexible lines."""
HANDS = ("uniform", "reversed", "full", "huge", "wrong")
WRONG = (np.nan, np.inf, "up", None, 1j, [[1.0, 2.0], [3.0]], np.zeros((3, 7)), object())


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


def made(seed: int) -> tuple[Any, int, str]:
    """The environment of a seed, its lanes, and by which hand it is used."""
    random = np.random.default_rng(seed)
    most = WILD if seed % 3 == 2 else USUAL
    line = load_catenary(one_of(random, *available("catenary")))
    pantograph = load_pantograph(one_of(random, *available("pantograph")))
    speed: Any = float(random.uniform(50, 450))
    if drawn := random.random() < DRAWN:
        names = [f"{kind}:{name}" for kind in ("family", "section") for name in available(kind)]
        line, speed = load_drawn(one_of(random, *names)), (50.0, 450.0)  # of which the line's are left
    weather = WEATHER if drawn or line.kind == "flexible" else ()
    settings = {
        "accuracy": one_of(random, "fast", "full"),
        "line_condition": one_of(random, "new", "fair", "worn", *weather),
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
    settings = {name: value for name, value in settings.items() if random.random() < 0.4}
    settings |= {"speed_kmh": speed, "distance": float(random.uniform(1, 150))}
    for name, entry in (("catenary", line), ("pantograph", pantograph)):
        table = entry.model_dump(mode="json")
        as_it_is = drawn and name == "catenary" and seed % 2  # with other ranges most are refused
        settings[name] = type(entry).model_validate(table if as_it_is else varied(table, random, most))
    lanes, hand = one_of(random, 0, 0, 3), one_of(random, *HANDS)
    name = "panto_env:PantographStiffness-v0"  # it sets nothing but line and pantograph
    if lanes:
        return gymnasium.make_vec(name, num_envs=lanes, **settings), lanes, hand
    return gymnasium.make(name, disable_env_checker=True, **settings), lanes, hand


def action_of(hand: str, k: int, random: np.random.Generator, shape: tuple[int, ...]) -> Any:
    """The action of a step."""
    if hand == "uniform":
        return random.uniform(-1, 1, shape)
    if hand == "huge":
        return random.choice([-1e308, 1e308, 5e-324, 0.0], shape)
    return np.full(shape, -1.0 if hand == "reversed" and k % 2 else 1.0)


def end_of(seed: int) -> str:
    """How a case ends; AssertionError where that is bad."""
    try:
        return _run(seed)
    except ValidationError:
        return "refused"
    except InputError as error:
        return "refused" if re.fullmatch(r".*\.", str(error)) else f"no sentence: {error}"


def _run(seed: int) -> str:
    env, lanes, hand = made(seed)
    random, space, shape = np.random.default_rng(seed), env.observation_space, env.action_space.shape
    seen, _ = env.reset(seed=seed)
    kind, running = "finite", True
    for k in range(STEPS):
        assert space.contains(seen), f"the observation is outside its space: {seen}"
        if not running:
            seen, _ = env.reset()
        if hand == "wrong" and k % 10 == 0:
            wrong = WRONG[k // 10 % len(WRONG)]
            with pytest.raises(InputError, match=r"\.$"):
                env.step(np.full(shape, wrong) if isinstance(wrong, float) else wrong)
        seen, reward, terminated, truncated, info = env.step(action_of(hand, k, random, shape))
        assert np.isfinite(reward).all(), f"the reward is {reward}"
        if np.any(terminated):
            kind = "ended early"
        running = bool(lanes) or not (terminated or truncated)
        assert running or not any(np.isnan(each) for each in info["figures"].values())
    env.close()
    return kind


@pytest.mark.slow
@pytest.mark.skipif(not JIT, reason="plain Python takes too long")
def test_many():
    ends, bad, count = Counter(), {}, int(os.environ.get("CASES", "2000"))
    for seed in range(FIRST, FIRST + count):
        with warnings.catch_warnings(action="ignore"):
            try:
                ends[end_of(seed)] += 1
            except Exception as error:
                bad[seed] = repr(error)
    print(dict(ends))
    assert bad == {}
    assert set(ends) <= {"finite", "ended early", "refused"}
    assert ends["finite"] > 0.3 * count  # else it is the generator that is refused
