"""SHA-256 of each file of a data set, in a list that `sha256sum --check` can read."""

from __future__ import annotations

from pathlib import Path

from panto_env.base.checksums import sha256_of
from panto_env.base.errors import InputError
from panto_env.base.files import check_path, write_whole

LIST = "SHA256SUMS"


def write_checksums(folder: Path) -> None:
    """Write the checksums of all files of a folder except hidden ones."""
    lines = [f"{sha256_of(folder / name)}  {name}\n" for name in _files(folder)]
    with write_whole(folder / LIST) as temporary:
        temporary.write_text("".join(lines), encoding="utf-8", newline="")


def verify(path: Path) -> list[tuple[Path, int]]:
    """Verify all data sets in or below ``path``: their folders, each with its number of files.

    Raises InputError, naming the file, if one is missing, differs or is not listed, if there is no list, and
    for an impossible path.
    """
    check_path(path)
    lists = sorted(path.rglob(LIST))
    if not lists:
        raise InputError(f"There is no {LIST} in or below {path}; give the folder of a data set.")
    return [(each.parent, _verify(each.parent)) for each in lists]


def _verify(folder: Path) -> int:
    listed = {}
    try:
        lines = (folder / LIST).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{folder / LIST} could not be read, or is damaged; make or download the data set anew."
        ) from error
    for line in lines:
        checksum, _, name = line.partition("  ")
        listed[name] = checksum
    found = _files(folder)
    for name, checksum in listed.items():
        if name not in found:
            raise InputError(f"{folder / name} is missing; make or download the data set anew.")
        if sha256_of(folder / name) != checksum:
            raise InputError(
                f"{folder / name} does not match {LIST}: it was damaged or changed; make or download the "
                "data set anew."
            )
    extra = next((name for name in found if name not in listed), None)
    if extra is not None:
        raise InputError(f"{folder / extra} is not in {LIST}; move it elsewhere, it is not part of the data.")
    return len(listed)


def _files(folder: Path) -> list[str]:
    """Relative paths of a folder's files, sorted."""
    paths = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return sorted(
        path.as_posix()
        for path in paths
        if path.name != LIST and not any(p.startswith(".") for p in path.parts)
    )
