"""Episodes: a policy's actions and the environment's responses, as a Minari data set and as one table.

Minari and PyArrow, of the extra 'data', are imported late.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from panto_env.base.checksums import __version__, read_arrays, write_arrays
from panto_env.base.errors import InputError
from panto_env.metrics.figures import Figures
from panto_env.policies import Policy, checked_action, errors_name, find_policy, wishes

from ..benchmark.settings import DATA
from .settings import ENVIRONMENT, EpisodesSettings, Plan, PolicySet

INFOS = ("contact_force", "head", "wire", "frame_force", "head_force", "position", "speed_kmh")
"""Entries of the environment's info that are recorded, in addition to the terms of the reward."""
FIGURES = tuple(field.name for field in fields(Figures))
"""Figures of an episode; one that it does not have is recorded as infinite."""
NOISE_STREAM = 1
"""Second seed of the noise on actions, after the episode's: other numbers than those of its line."""


class Episode(NamedTuple):
    """One recorded episode of n steps; the first row of infos belongs to the start, before any action."""

    observations: NDArray[np.float32]  # (n + 1, entries): as the environment returns them
    actions: NDArray[np.float32]  # (n, actions): actions taken, in -1..1
    rewards: NDArray[np.float64]  # (n,)
    terminations: NDArray[np.bool_]  # (n,)
    truncations: NDArray[np.bool_]  # (n,)
    infos: dict[str, NDArray[np.float64]]  # (n + 1, ...): INFOS, "reward_terms/...", "policy_action"
    figures: dict[str, float]  # of the whole episode, from the environment's info


def make(settings: EpisodesSettings, **changes: Any) -> gymnasium.Env[Any, Any]:
    """Make the environment to record, by id and plain arguments, so that others can make it again.

    changes: arguments that differ from the settings'. Raises InputError if the arguments are not valid.
    """
    try:
        return gymnasium.make(f"panto_env:{ENVIRONMENT}", **settings.arguments() | changes)
    except TypeError as error:
        raise InputError(f"The arguments of the environment are not valid: {error}.") from error


def check_places(settings: EpisodesSettings) -> None:
    """Raise InputError unless each policy can begin at each place, at its minimum and maximum speed."""
    stage = Stage(settings)
    for policy in dict.fromkeys(policy for each in settings.sets for policy in each.policies):
        for place in settings.places:
            for speed in place.speed_kmh:
                stage.begin(policy, DATA[0], place.options() | {"speed_kmh": [speed, speed]})


def record(settings: EpisodesSettings, plans: Sequence[Plan], path: Path) -> None:
    """Record episodes one after another and write a file for ``read_episodes``, whole or not at all."""
    arrays: dict[str, NDArray[Any]] = {}
    stage = Stage(settings)
    for plan in plans:
        for name, value in stage.play(plan)._asdict().items():
            for key, array in (value if isinstance(value, dict) else {"": value}).items():
                arrays[f"{plan.number}|{name}|{key}"] = np.asarray(array)
    write_arrays(path, {}, arrays)


def read_part(path: Path) -> dict[str, NDArray[Any]]:
    """Read the arrays that ``record`` wrote. Raises InputError if the file is missing or damaged."""
    try:
        return read_arrays(path)[1]
    except (OSError, ValueError) as error:
        raise InputError(f"{path} could not be read: {error}; give the same command again.") from error


def read_episodes(path: Path, plans: Sequence[Plan]) -> list[Episode]:
    """Read the episodes that ``record`` wrote, in the order of the plans.

    Raises InputError if the file is missing or damaged.
    """
    tables: dict[int, dict[str, Any]] = {plan.number: {"infos": {}, "figures": {}} for plan in plans}
    for key, value in read_part(path).items():
        number, name, part = key.split("|")
        if part == "":
            tables[int(number)][name] = value
        else:
            tables[int(number)][name][part] = value if name == "infos" else float(value)
    return [Episode(**tables[plan.number]) for plan in plans]


class Stage:
    """Records episodes in an environment, with a twin of it for each other observation that is requested.

    A policy that requests an observation other than the recorded one gets it from a twin, which has the same
    seed and gets the same actions. The twin's motion is the same bit for bit: the observation does not affect
    it.
    """

    def __init__(self, settings: EpisodesSettings) -> None:
        self._settings, self._env = settings, make(settings)
        self._twins: dict[str, gymnasium.Env[Any, Any]] = {}

    def play(self, plan: Plan) -> Episode:
        """Record one episode. Raises InputError if the policy fails, or if its twin's motion differs."""
        env, options = self._env, self._settings.options(plan)
        policy, twin, observation, seen, info = self.begin(plan.policy, plan.seed, options)
        random = np.random.default_rng([plan.seed, NOISE_STREAM])
        shape = env.action_space.shape or ()
        observations, infos = [observation], [_kept(info, np.zeros(shape))]
        steps: list[tuple[Any, ...]] = []
        ended = False
        while not ended:
            with errors_name(plan.policy, "act"):
                action = checked_action(policy.act(seen.copy()), shape)  # a copy: the policy may keep it
            policy_action = np.clip(action, -1.0, 1.0)
            noisy = policy_action + plan.noise * random.standard_normal(shape)
            action = np.clip(noisy, -1.0, 1.0).astype(np.float32)
            observation, reward, terminated, truncated, info = env.step(action)
            seen = observation if twin is None else _seen(twin, action, info, plan.policy)
            ended = terminated or truncated
            steps.append((action, reward, terminated, truncated))
            observations.append(observation)
            infos.append(_kept(info, policy_action))
        actions, rewards, terminations, truncations = (np.array(each) for each in zip(*steps, strict=True))
        return Episode(
            np.array(observations),
            actions,
            rewards.astype(np.float64),
            terminations,
            truncations,
            {key: np.array([each[key] for each in infos], dtype=np.float64) for key in infos[0]},
            dict.fromkeys(FIGURES, np.inf) | info["figures"],
        )

    def begin(self, name: str, seed: int, options: dict[str, Any]) -> tuple[Policy, Any, Any, Any, Any]:
        """Begin an episode: its policy, twin or None, recorded observation, the policy's, and info.

        Raises InputError if the policy cannot begin it.
        """
        policy = find_policy(name)
        twin = self._twin(policy, name)
        observation, info = self._env.reset(seed=seed, options=options)
        seen = observation if twin is None else twin.reset(seed=seed, options=options)[0]
        with errors_name(name, "reset"):
            policy.reset((twin or self._env).unwrapped.context)  # type: ignore[attr-defined]
        return policy, twin, observation, seen, info

    def _twin(self, policy: Policy, name: str) -> gymnasium.Env[Any, Any] | None:
        """Environment with the observation that a policy requests; None if that is the recorded one.

        Raises InputError for a policy that needs another washout: its actions would mean other forces.
        """
        offered = self._env.unwrapped.task.settings  # type: ignore[attr-defined]
        changes = {key: value for key, value in wishes(policy).items() if value != getattr(offered, key)}
        if "washout" in changes:
            needed = changes["washout"]
            raise InputError(
                f"The policy '{name}' needs washout = {needed:g}, and the data set's environment has "
                f"{offered.washout:g}; set washout = {needed:g} in its environment, or leave the policy out."
            )
        key = repr(sorted(changes.items()))
        if changes and key not in self._twins:
            self._twins[key] = make(self._settings, **changes)
        return self._twins.get(key)


def _seen(
    twin: gymnasium.Env[Any, Any], action: NDArray[np.float32], info: dict[str, Any], policy: str
) -> NDArray[np.float32]:
    """Step a twin: the policy's next observation. Raises InputError if the twin's motion differs."""
    seen: NDArray[np.float32]
    seen, _, _, _, other = twin.step(action)
    if other["contact_force"] != info["contact_force"]:
        raise InputError(
            f"The policy '{policy}' requests an observation under which the same seed gives a different run, "
            "so that it cannot be recorded beside others; leave it out."
        )
    return seen


def _kept(info: dict[str, Any], policy_action: NDArray[Any]) -> dict[str, Any]:
    """Recorded entries of an info, as a flat table."""
    terms = {f"reward_terms/{name}": value for name, value in info["reward_terms"].items()}
    return {name: info[name] for name in INFOS} | terms | {"policy_action": policy_action}


STEPS = "steps.parquet"  # name of the table in a data set's folder
PER_GROUP = 100  # episodes per row group


COLUMNS = {
    "episode": "number of the episode, from 0",
    "step": "number of the control step in its episode, from 0",
    "policy": "policy that acted",
    "observation": "before the step, as the environment returned it",
    "action": "taken, noise included, as a share of the actuator's force limit",
    "reward": "of the step",
    "next_observation": "after the step",
    "terminated": "whether the step ended the episode early",
    "truncated": "whether the episode reached its distance",
}
"""Descriptions of the columns before the infos, which have the names of Minari's, at the step's end."""


class StepsTable:
    """Writes the table; a context manager."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: Any = None
        self._waiting: list[Any] = []

    def __enter__(self) -> StepsTable:
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        if self._writer is not None:
            self._writer.close()

    def add(self, plan: Plan, episode: Episode) -> None:
        """Add an episode."""
        import pyarrow as pa

        count = len(episode.rewards)
        values = (
            pa.array(np.full(count, plan.number)),
            pa.array(np.arange(count)),
            pa.array([plan.policy] * count),
            _column(episode.observations[:-1]),
            _column(episode.actions),
            pa.array(episode.rewards),
            _column(episode.observations[1:]),
            pa.array(episode.terminations),
            pa.array(episode.truncations),
        )
        infos = {name: _column(array[1:]) for name, array in episode.infos.items()}
        self._waiting.append(pa.table(dict(zip(COLUMNS, values, strict=True)) | infos))
        if len(self._waiting) == PER_GROUP:
            self._flush()

    def _flush(self) -> None:
        if not self._waiting:
            return
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.concat_tables(self._waiting)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._path, table.schema, compression="zstd")
        self._writer.write_table(table)
        self._waiting.clear()


def _column(array: Any) -> Any:
    """Arrow array of (n,) numbers, or of (n, k) as lists of k."""
    import pyarrow as pa

    if array.ndim == 1:
        return pa.array(array)
    return pa.FixedSizeListArray.from_arrays(pa.array(array.ravel()), array.shape[1])


KEY = "panto_env"  # key of a data set's identity in its metadata


def write_minari(
    folder: Path,
    settings: EpisodesSettings,
    policy_set: PolicySet,
    episodes: Iterable[tuple[Plan, Episode]],
    made_of: Mapping[str, Any],
    description: str,
) -> None:
    """Write a data set to a folder, for ``minari.load_dataset``.

    Each episode's metadata hold its seed and options, with which ``reset`` begins it again, its policy, the
    noise on the action, and its figures.
    """
    import minari
    from minari.data_collector import EpisodeBuffer
    from minari.dataset.minari_storage import MinariStorage

    env = make(settings)
    data = folder.resolve() / "data"  # Minari takes no relative path
    data.mkdir(parents=True)
    storage = MinariStorage.new(
        data, env_spec=env.spec, observation_space=env.observation_space, action_space=env.action_space
    )
    env.close()
    commit = f", commit {made_of['commit']}" if made_of["commit"] else ""
    noises = ", ".join(f"{noise:g}" for noise in sorted(policy_set.noise) if noise)
    added = f", with white noise of rms {noises} on the action" if noises else ""
    storage.update_metadata(
        {
            "dataset_id": settings.dataset_id(policy_set),
            "minari_version": minari.__version__,
            "author": {settings.author},
            "algorithm_name": " and ".join(policy_set.policies) + added,
            "code_permalink": f"panto-env {made_of['version']}{commit}",
            "description": description,
            "requirements": [f"panto-env=={__version__}"],
            KEY: dict(made_of),
        }
    )
    for plan, episode in episodes:
        kept = episode._asdict() | {"infos": _nested(episode.infos)}
        figures = kept.pop("figures")  # those that the episode does not have are infinite
        options = settings.options(plan) or None
        storage.update_episodes([EpisodeBuffer(seed=plan.seed, options=options, **kept)])
        place = settings.places[plan.place]
        facts = {
            "policy": plan.policy,
            "noise": plan.noise,
            "catenary": place.catenary,
            "pantograph": place.pantograph,
            "speed_kmh": float(episode.infos["speed_kmh"][0]),
            "return": float(np.sum(episode.rewards)),
        }
        facts |= {f"figures/{name}": value for name, value in figures.items()}
        storage.update_episode_metadata([facts], [plan.number])


def _nested(infos: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables from keys such as "a/b"."""
    nested: dict[str, Any] = {}
    for key, value in infos.items():
        *above, last = key.split("/")
        table = nested
        for name in above:
            table = table.setdefault(name, {})
        table[last] = value
    return nested
