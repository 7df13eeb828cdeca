"""Writes recorded episodes as a Minari data set. Minari, part of the extra 'data', is imported late."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from panto_env.base.checksums import __version__
from panto_env.base.errors import InputError

from .episodes import Episode, make
from .settings import EpisodesSettings, Plan, PolicySet

KEY = "panto_env"
"""Key of a data set's identity in its metadata."""


def check_minari() -> None:
    """Raise InputError if Minari, or h5py, which it writes with, is not installed."""
    try:
        import h5py  # noqa: F401
        import minari  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"Data sets of episodes need Minari, which is not installed ({error}); install panto-env with "
            "its extra: pip install 'panto-env[data]'."
        ) from error


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
    version = f"panto-env {made_of['version']}"
    noises = sorted(noise for noise in policy_set.noise if noise)
    added = f", with white noise of rms {', '.join(f'{noise:g}' for noise in noises)} on the action"
    storage.update_metadata(
        {
            "dataset_id": settings.dataset_id(policy_set),
            "minari_version": minari.__version__,
            "author": {settings.author},
            "algorithm_name": " and ".join(policy_set.policies) + (added if noises else ""),
            "code_permalink": f"{version}, commit {made_of['commit']}" if made_of["commit"] else version,
            "description": description,
            "requirements": [f"panto-env=={__version__}"],
            KEY: dict(made_of),
        }
    )
    for plan, episode in episodes:
        storage.update_episodes(
            [
                EpisodeBuffer(
                    seed=plan.seed,
                    options=settings.options(plan) or None,
                    observations=episode.observations,
                    actions=episode.actions,
                    rewards=episode.rewards,
                    terminations=episode.terminations,
                    truncations=episode.truncations,
                    infos=_nested(episode.infos),
                )
            ]
        )
        storage.update_episode_metadata([_facts(settings, plan, episode)], [plan.number])


def _facts(settings: EpisodesSettings, plan: Plan, episode: Episode) -> dict[str, Any]:
    """Metadata of an episode; figures that it does not have are infinite."""
    place = settings.places[plan.place]
    facts = {
        "policy": plan.policy,
        "noise": plan.noise,
        "catenary": place.catenary,
        "pantograph": place.pantograph,
        "speed_kmh": float(episode.infos["speed_kmh"][0]),
        "return": float(np.sum(episode.rewards)),
    }
    return facts | {f"figures/{name}": value for name, value in episode.figures.items()}


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
