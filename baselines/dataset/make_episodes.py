"""Data sets of episodes: recorded in parts on all cores, then written by Minari, whole or not at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.errors import InputError
from panto_env.base.files import alone_in, make_folder
from panto_env.cluster.parts import (
    PARTS,
    Job,
    first_difference,
    identity,
    make_parts,
    open_parts,
    remove_if_empty,
    remove_parts,
)

from .checksums import LIST, write_checksums
from .episodes import Episode, check_places, make, read_episodes, read_part, record
from .episodes_card import card, description, summary
from .minari_set import KEY, check_minari, write_minari
from .settings import NAMESPACE, EpisodesSettings, Plan, PolicySet
from .steps_table import STEPS, StepsTable

PER_PART = 10
"""Episodes per part: a second or two of work, so that little is lost by an interruption."""
NAMESPACE_FILE = "namespace_metadata.json"
"""File by which Minari recognises a folder of data sets."""


@dataclass(frozen=True)
class Made:
    """A finished data set."""

    dataset_id: str
    folder: Path
    episodes: int
    steps: int
    megabytes: float
    kept: bool  # whether it existed before


def make_episodes(
    settings: EpisodesSettings,
    output: Path,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> list[Made]:
    """Make all data sets in a folder; those that exist are kept. ``MINARI_DATASETS_PATH`` may point to it.

    workers, ray: see ``spread``; the data do not depend on them. A script must call this under ``if
    __name__ == "__main__":``. progress: called with the number of parts done and of all.

    Raises InputError for invalid settings, for a policy that fails, and if the folder holds a data set of the
    same id made with other settings.
    """
    check_minari()
    check_places(settings)
    with alone_in(output, "makes data in"):
        sets = [_Order.of(settings, policy_set, output) for policy_set in settings.sets]
        kept = [each.kept() for each in sets]
        jobs: dict[Path, Job] = {}
        for one, there in zip(sets, kept, strict=True):
            if not there:
                open_parts(one.parts, one.made_of)
                jobs |= one.jobs(settings)
        make_parts(jobs, read_part, workers=workers, ray=ray, progress=progress)
        for one, there in zip(sets, kept, strict=True):
            if not there:
                _assemble(settings, one)
                remove_parts(one.parts)
        remove_if_empty(output / PARTS)
    return [_made(one, kept=there) for one, there in zip(sets, kept, strict=True)]


@dataclass(frozen=True)
class _Order:
    """One data set to make: its settings, its paths, and its episodes in groups of one part each."""

    policy_set: PolicySet
    name: str
    folder: Path
    parts: Path
    groups: dict[Path, list[Plan]]
    made_of: dict[str, Any]

    @classmethod
    def of(cls, settings: EpisodesSettings, policy_set: PolicySet, output: Path) -> _Order:
        name = settings.dataset_id(policy_set)
        parts = output / PARTS / name.replace("/", "_")
        plans = list(settings.plans(policy_set))
        groups = {
            parts / f"{first:06d}.safetensors": plans[first : first + PER_PART]
            for first in range(0, len(plans), PER_PART)
        }
        table = settings.model_copy(update={"sets": (policy_set,)}).model_dump(mode="json")
        return cls(policy_set, name, output / name, parts, groups, identity("episodes", table))

    def jobs(self, settings: EpisodesSettings) -> dict[Path, Job]:
        return {path: partial(record, settings, group) for path, group in self.groups.items()}

    def kept(self) -> bool:
        """Whether the data set exists. Raises InputError if a different one with its id exists."""
        if not (self.folder / LIST).is_file():
            return False
        difference = first_difference(_metadata(self.folder).get(KEY, {}), self.made_of)
        if difference:
            raise InputError(
                f"{self.folder} holds another data set of this id ({difference}); raise the version in the "
                "file, or take another --output."
            )
        return True


def _assemble(settings: EpisodesSettings, one: _Order) -> None:
    """Write a data set to a hidden folder, and rename that once it is complete."""
    _make_namespaces(one.folder)
    unfinished = one.folder.with_name(f".{one.folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)  # left by a process that was killed
    rows: list[tuple[Plan, dict[str, float]]] = []

    def episodes() -> Iterator[tuple[Plan, Episode]]:
        for path, plans in one.groups.items():
            for plan, episode in zip(plans, read_episodes(path, plans), strict=True):
                rows.append((plan, summary(episode)))
                table.add(plan, episode)
                yield plan, episode

    paragraph = description(settings, one.policy_set)
    unfinished.mkdir()
    with StepsTable(unfinished / STEPS) as table:
        write_minari(unfinished, settings, one.policy_set, episodes(), one.made_of, paragraph)
    env = make(settings)
    layout = env.unwrapped.task.layout  # type: ignore[attr-defined]
    env.close()
    text = card(settings, one.policy_set, rows, layout, one.made_of)
    (unfinished / "card.md").write_text(text, encoding="utf-8")
    write_checksums(unfinished)
    unfinished.rename(one.folder)


def _make_namespaces(folder: Path) -> None:
    """Make the folders above a data set in the way that Minari does."""
    make_folder(folder.parent)
    for above in (folder.parent, folder.parent.parent):
        if not (above / NAMESPACE_FILE).is_file():
            (above / NAMESPACE_FILE).write_text("{}", encoding="utf-8")
        if above.name == NAMESPACE:
            break


def _made(one: _Order, *, kept: bool) -> Made:
    metadata = _metadata(one.folder)
    size = sum(path.stat().st_size for path in one.folder.rglob("*") if path.is_file())
    steps, episodes = metadata["total_steps"], metadata["total_episodes"]
    return Made(one.name, one.folder, episodes, steps, size / 1e6, kept)


def _metadata(folder: Path) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((folder / "data" / "metadata.json").read_text(encoding="utf-8"))
    return table
