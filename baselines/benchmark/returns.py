"""Returns of an environment beside the benchmark: whether a return ranks policies as the benchmark does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from panto_env.analysis.pool import Progress, check_passes
from panto_env.base.errors import InputError
from panto_env.cluster import spread
from panto_env.envs import IDS
from panto_env.policies import errors_name, find_policy, wishes

from .settings import Line, control_of

INGREDIENTS: dict[str, dict[str, Any]] = {
    "all": {},
    "CF and CL alone": {"reward": {"target": "passive"}},
    "without CF": {"reward": "benchmark:cost_function=0"},
    "without the squared deviation": {"reward": "benchmark:low_passed=0"},
    "without the rate": {"reward": "benchmark:rate=0"},
    "about the nominal force": {"reward": "benchmark:target=nominal"},
    "a weight of 50 for the mean": {"reward": "benchmark:mean_force=50"},
    "paper 1's reward": {"reward": "paper1"},
    "counted from the start": {"settle": 0.0},
    "counted from span 3": {"settle": 3.0},
    "speeds between those of the result, too": {"speed_kmh": (250.0, 350.0)},
}
"""Arguments that replace those of the id, by what they change."""


@dataclass(frozen=True)
class Returned:
    """Mean return of one policy beside its result in the benchmark."""

    policy: str
    mean: float  # of the return over the episodes
    error: float  # standard error of that mean
    change: float  # of sigma in the benchmark (%)
    disqualified: str  # there: the reason, or ""


def returns(
    result: Any,
    identifier: str = "Pantograph-v0",
    *,
    episodes: int = 20,
    arguments: Mapping[str, Any] | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> list[Returned]:
    """Mean returns of all policies of a benchmark's result, in episodes on its line at its speeds in turn.

    Actuator and sensors are those of the result. Speeds between would ask another question: gains fitted at
    the result's speeds are worth less there. result: as ``read_result`` gives it, of one line. Episodes have
    the seeds 0, 1, ... A policy that wants no washout has none. arguments: of the environment, instead of
    those of its id. Raises InputError for a result of several lines, an id that does not exist, several
    controlled pantographs, too many episodes, and a policy that fails.
    """
    if identifier not in IDS:
        raise InputError(f"Unknown id '{identifier}': known are {', '.join(IDS)}.")
    lines = [Line.model_validate(each) for each in result.settings["lines"]]
    if len(lines) != 1:
        raise InputError(f"A result of one line or case is needed, not of {len(lines)}; take another one.")
    (line,) = lines
    if len(line.controlled) > 1:
        numbers = " and ".join(map(str, line.controlled))
        raise InputError(f"A result of one controlled pantograph is needed, not of {numbers}.")
    standings = [each for each in result.standings if not (control_of(each.policy) or each.trainings)]
    check_passes(episodes * len(standings), "This comparison")
    speeds = sorted({cell.speed_kmh for cell in result.cells})
    place = line.settings | {name: result.settings[name] for name in ("actuator", "sensors")}
    given = [place | {"speed_kmh": speeds[k % len(speeds)]} | dict(arguments or {}) for k in range(episodes)]
    jobs = [
        partial(one_return, identifier, given[seed], each.policy, seed)
        for each in standings
        for seed in range(episodes)
    ]
    found = np.array(spread(jobs, workers=workers, progress=progress)).reshape(-1, episodes)
    return [
        Returned(
            each.policy,
            float(own.mean()),
            float(own.std(ddof=1) / np.sqrt(episodes)) if episodes > 1 else float("nan"),
            each.change,
            each.disqualified,
        )
        for each, own in zip(standings, found, strict=True)
    ]


def one_return(identifier: str, arguments: Mapping[str, Any], policy: str, seed: int) -> float:
    """Return of one episode under a policy."""
    driver = find_policy(policy)
    env = gymnasium.make(f"panto_env:{identifier}", **wishes(driver) | dict(arguments)).unwrapped
    observation, _ = env.reset(seed=seed)
    with errors_name(policy, "reset"):
        driver.reset(env.context)  # type: ignore[attr-defined]
    total, ended = 0.0, False
    while not ended:
        with errors_name(policy, "act"):
            action = driver.act(observation)
        observation, reward, terminated, truncated, _ = env.step(np.asarray(action))
        total, ended = total + float(reward), terminated or truncated
    return total


def rank_correlation(found: Sequence[Returned]) -> float:
    """Spearman's rank correlation of return and benchmark, disqualified policies sharing the last rank."""
    from scipy.stats import spearmanr  # slow to import

    benchmark = [np.inf if each.disqualified else each.change for each in found]
    return float(-spearmanr([each.mean for each in found], benchmark).statistic)


def as_dict(found: Sequence[Returned]) -> dict[str, Any]:
    """The outcome as plain data for JSON."""
    return {"rank_correlation": rank_correlation(found), "policies": [asdict(each) for each in found]}
