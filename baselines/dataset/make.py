"""Data sets made in parts, each whole or not at all, with a list that `sha256sum --check` can read."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked, sha256_of
from panto_env.base.errors import InputError
from panto_env.base.extras import require
from panto_env.base.files import alone_in, make_folder, write_whole
from panto_env.cluster import (
    PARTS,
    PartJob,
    first_difference,
    identity,
    make_parts,
    open_parts,
    remove_if_empty,
    remove_parts,
)

from .cards import TABLE, card_of_designs, card_of_episodes, columns, description, summary
from .designs import DesignsSettings, simulate_designs
from .episodes import (
    KEY,
    STEPS,
    Episode,
    StepsTable,
    check_places,
    make,
    read_episodes,
    read_part,
    record,
    write_minari,
)
from .settings import NAMESPACE, EpisodesSettings, Plan, PolicySet

LIST = "SHA256SUMS"


def write_checksums(folder: Path) -> None:
    """Write the checksums of all files of a folder except hidden ones."""
    lines = [f"{sha256_of(folder / name)}  {name}\n" for name in _files(folder)]
    with write_whole(folder / LIST) as temporary:
        temporary.write_text("".join(lines), encoding="utf-8", newline="")


def verify(path: Path) -> list[tuple[Path, int]]:
    """Verify all data sets in or below ``path``: their folders, each with its number of files.

    Raises InputError, naming the file, if one is missing, differs or is not listed, or if there is no list.
    """
    lists = sorted(path.rglob(LIST))
    if not lists:
        raise InputError(f"There is no {LIST} in or below {path}; give the folder of a data set.")
    return [(each.parent, _verify(each.parent)) for each in lists]


def _verify(folder: Path) -> int:
    try:
        lines = (folder / LIST).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{folder / LIST} could not be read, or is damaged; make or download the data set anew."
        ) from error
    listed = {name: checksum for checksum, _, name in (line.partition("  ") for line in lines)}
    found = _files(folder)
    for name, checksum in listed.items():
        if name not in found:
            raise InputError(f"{folder / name} is missing; make or download the data set anew.")
        if sha256_of(folder / name) != checksum:
            raise InputError(
                f"{folder / name} does not match {LIST}: it was damaged or changed; make or download the "
                "data set anew."
            )
    for name in found:
        if name not in listed:
            raise InputError(
                f"{folder / name} is not in {LIST}; move it elsewhere, it is not part of the data."
            )
    return len(listed)


def _files(folder: Path) -> list[str]:
    """Relative paths of a folder's files, sorted."""
    paths = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file() and path.name != LIST)
    return sorted(path.as_posix() for path in paths if not any(p.startswith(".") for p in path.parts))


DESIGNS_PER_PART = 64  # designs per part: some seconds of work
TABLE_KEY = b"panto_env"
"""Key of the table's identity in the schema's metadata; a column's metadata hold its description."""


@dataclass(frozen=True)
class MadeTable:
    """A finished table of designs."""

    folder: Path
    designs: int
    refused: int
    ended_early: int
    warned: int  # designs with a warning of inaccurate figures
    megabytes: float
    kept: bool  # whether it existed before


def make_designs(
    settings: DesignsSettings,
    output: Path,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> MadeTable:
    """Make the table in a folder, with its card and checksums; a table that exists is kept.

    workers, ray: see ``spread``; the table does not depend on them. A script must call this under
    ``if __name__ == "__main__":``. progress: called with the number of parts done and of all.

    Raises InputError if the folder holds a table made with other settings.
    """
    require("A table of designs", "data", "pyarrow")
    made_of = identity("designs", settings.model_dump(mode="json"))
    folder = output / "designs"
    with alone_in(output, "makes data in"):
        there = (folder / LIST).is_file()
        if there:
            difference = first_difference(read_identity(folder / TABLE), made_of)
            if difference:
                raise InputError(f"{folder} holds another table ({difference}); take another --output.")
        else:
            parts = output / PARTS / "designs"
            open_parts(parts, made_of)
            jobs: dict[Path, PartJob] = {}
            for first in range(0, settings.count, DESIGNS_PER_PART):
                last = min(first + DESIGNS_PER_PART, settings.count)
                jobs[parts / f"{first:07d}.json"] = partial(simulate_designs, settings, first, last)
            make_parts(jobs, read_checked, workers=workers, ray=ray, progress=progress)
            _assemble_designs(settings, folder, list(jobs), made_of)
            remove_parts(parts)
            remove_if_empty(output / PARTS)
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    table = pq.read_table(folder / TABLE, columns=["refused", "ending", "accuracy_warning"])
    refused, ended, warned = (int(pc.sum(pc.not_equal(each, "")).as_py()) for each in table.columns)
    size = (folder / TABLE).stat().st_size / 1e6
    return MadeTable(folder, table.num_rows, refused, ended, warned, size, there)


def read_identity(path: Path) -> dict[str, Any]:
    """Identity of a table: the settings and version it was made with. Raises InputError for another file."""
    from pyarrow import ArrowException
    from pyarrow.parquet import read_schema

    try:
        table: dict[str, Any] = json.loads(read_schema(path).metadata[TABLE_KEY])
        return table
    except (OSError, ArrowException, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is not a complete table of designs; make it anew.") from error


def _assemble_designs(
    settings: DesignsSettings, folder: Path, parts: Sequence[Path], made_of: dict[str, Any]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    described = columns(settings)
    schema = pa.schema(
        [
            pa.field(each.name, getattr(pa, each.kind)(), metadata={"description": each.description})
            for each in described
        ],
        metadata={TABLE_KEY: json.dumps(made_of)},
    )
    table = pa.Table.from_pylist([row for path in parts for row in read_checked(path)["rows"]], schema=schema)
    with _whole_folder(folder) as unfinished:
        pq.write_table(table, unfinished / TABLE, compression="zstd")
        text = card_of_designs(settings, described, table, made_of)
        (unfinished / "card.md").write_text(text, encoding="utf-8")


@contextmanager
def _whole_folder(folder: Path) -> Iterator[Path]:
    """A hidden folder to write to, which gets its checksums and its name once it is complete."""
    unfinished = folder.with_name(f".{folder.name}")
    shutil.rmtree(unfinished, ignore_errors=True)  # left by a process that was killed
    unfinished.mkdir()
    yield unfinished
    write_checksums(unfinished)
    unfinished.rename(folder)


EPISODES_PER_PART = 10
"""Episodes per part: a second or two of work, so that little is lost by an interruption."""
NAMESPACE_FILE = "namespace_metadata.json"  # file by which Minari recognises a folder of data sets


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
    require("A data set of episodes", "data", "minari", "h5py", "pyarrow")
    check_places(settings)
    with alone_in(output, "makes data in"):
        sets = [_Order.of(settings, policy_set, output) for policy_set in settings.sets]
        missing = [one for one in sets if not one.kept()]
        jobs: dict[Path, PartJob] = {}
        for one in missing:
            open_parts(one.parts, one.made_of)
            jobs |= {path: partial(record, settings, group) for path, group in one.groups.items()}
        make_parts(jobs, read_part, workers=workers, ray=ray, progress=progress)
        for one in missing:
            _assemble_episodes(settings, one)
            remove_parts(one.parts)
        remove_if_empty(output / PARTS)
    made = []
    for one in sets:
        episodes, steps = (_metadata(one.folder)[name] for name in ("total_episodes", "total_steps"))
        size = sum(path.stat().st_size for path in one.folder.rglob("*") if path.is_file()) / 1e6
        made.append(Made(one.name, one.folder, episodes, steps, size, one not in missing))
    return made


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
            parts / f"{first:06d}.safetensors": plans[first : first + EPISODES_PER_PART]
            for first in range(0, len(plans), EPISODES_PER_PART)
        }
        table = settings.model_copy(update={"sets": (policy_set,)}).model_dump(mode="json")
        return cls(policy_set, name, output / name, parts, groups, identity("episodes", table))

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


def _assemble_episodes(settings: EpisodesSettings, one: _Order) -> None:
    make_folder(one.folder.parent)
    for above in (one.folder.parent, one.folder.parent.parent):  # as Minari makes them
        if not (above / NAMESPACE_FILE).is_file():
            (above / NAMESPACE_FILE).write_text("{}", encoding="utf-8")
        if above.name == NAMESPACE:
            break
    rows: list[tuple[Plan, dict[str, float]]] = []

    def episodes() -> Iterator[tuple[Plan, Episode]]:
        for path, plans in one.groups.items():
            for plan, episode in zip(plans, read_episodes(path, plans), strict=True):
                rows.append((plan, summary(episode)))
                table.add(plan, episode)
                yield plan, episode

    env = make(settings)
    layout = env.unwrapped.task.layout  # type: ignore[attr-defined]
    env.close()
    with _whole_folder(one.folder) as unfinished:
        with StepsTable(unfinished / STEPS) as table:
            words = description(settings, one.policy_set)
            write_minari(unfinished, settings, one.policy_set, episodes(), one.made_of, words)
        text = card_of_episodes(settings, one.policy_set, rows, layout, one.made_of)
        (unfinished / "card.md").write_text(text, encoding="utf-8")


def _metadata(folder: Path) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((folder / "data" / "metadata.json").read_text(encoding="utf-8"))
    return table
