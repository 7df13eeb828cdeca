"""Data sets of episodes: recorded in parts on all cores, then written as Minari's, whole or not at all."""

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
from panto_env.base.files import make_folder
from panto_env.base.locks import alone_in
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

PER_PART = 10
"""Episodes in a part: a second or two of work, so that little is lost where it ends."""
NAMESPACE_FILE = "namespace_metadata.json"
"""By which Minari knows a folder of data sets."""


@dataclass(frozen=True)
class Made:
    """One data set that is there."""

    dataset_id: str
    folder: Path
    episodes: int
    steps: int
    megabytes: float
    kept: bool  # whether it was there before


def make_episodes(
    settings: EpisodesSettings,
    output: Path,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> list[Made]:
    """Make all data sets in a folder that ``MINARI_DATASETS_PATH`` may name; those that are there are kept.

    workers, ray: as ``spread`` takes them; the data do not depend on it. A script must call this under ``if
    __name__ == "__main__":``. progress: called with the parts there, and of all.

    Raises InputError for settings that are not valid, a policy that fails, and where the folder holds a data
    set of the same id that was made of something else.
    """
    check_minari()
    check_places(settings)
    with alone_in(output, "makes data in"):
        wanted = [_Wanted.of(settings, policy_set, output) for policy_set in settings.sets]
        kept = [each.kept() for each in wanted]
        jobs: dict[Path, Job] = {}
        for one, there in zip(wanted, kept, strict=True):
            if not there:
                open_parts(one.parts, one.made_of)
                jobs |= one.jobs(settings)
        make_parts(jobs, read_part, workers=workers, ray=ray, progress=progress)
        for one, there in zip(wanted, kept, strict=True):
            if not there:
                _assemble(settings, one)
                remove_parts(one.parts)
        remove_if_empty(output / PARTS)
    return [_told(one, kept=there) for one, there in zip(wanted, kept, strict=True)]


@dataclass(frozen=True)
class _Wanted:
    """One data set to make: its settings, its places on disk, and its episodes in groups of one part each."""

    policy_set: PolicySet
    name: str
    folder: Path
    parts: Path
    groups: dict[Path, list[Plan]]
    made_of: dict[str, Any]

    @classmethod
    def of(cls, settings: EpisodesSettings, policy_set: PolicySet, output: Path) -> _Wanted:
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
        """Whether it is there. Raises InputError where another one is that has its id."""
        if not (self.folder / LIST).is_file():
            return False
        difference = first_difference(_metadata(self.folder).get(KEY, {}), self.made_of)
        if difference:
            raise InputError(
                f"{self.folder} holds another data set of this id ({difference}); raise the version in the "
                "file, or take another --output."
            )
        return True


def _assemble(settings: EpisodesSettings, one: _Wanted) -> None:
    """Write a data set beside its place, and bring it there once it is whole."""
    _make_namespaces(one.folder)
    unfinished = one.folder.with_name(f".{one.folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)  # of a process that was killed
    rows: list[tuple[Plan, dict[str, float]]] = []

    def episodes() -> Iterator[tuple[Plan, Episode]]:
        for path, plans in one.groups.items():
            for plan, episode in zip(plans, read_episodes(path, plans), strict=True):
                rows.append((plan, summary(episode)))
                yield plan, episode

    told = description(settings, one.policy_set)
    write_minari(unfinished, settings, one.policy_set, episodes(), one.made_of, told)
    env = make(settings)
    layout = env.unwrapped.task.layout  # type: ignore[attr-defined]
    env.close()
    text = card(settings, one.policy_set, rows, layout, one.made_of)
    (unfinished / "card.md").write_text(text, encoding="utf-8")
    write_checksums(unfinished)
    unfinished.rename(one.folder)


def _make_namespaces(folder: Path) -> None:
    """Folders above a data set, as Minari makes them."""
    make_folder(folder.parent)
    for above in (folder.parent, folder.parent.parent):
        if not (above / NAMESPACE_FILE).is_file():
            (above / NAMESPACE_FILE).write_text("{}", encoding="utf-8")
        if above.name == NAMESPACE:
            break


def _told(one: _Wanted, *, kept: bool) -> Made:
    metadata = _metadata(one.folder)
    size = sum(path.stat().st_size for path in one.folder.rglob("*") if path.is_file())
    steps, episodes = metadata["total_steps"], metadata["total_episodes"]
    return Made(one.name, one.folder, episodes, steps, size / 1e6, kept)


def _metadata(folder: Path) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((folder / "data" / "metadata.json").read_text(encoding="utf-8"))
    return table
