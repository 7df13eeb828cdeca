"""A mutant: a place in the source, what stands there, and what is put there to see whether a test fails."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Mutant:
    """One change of one file."""

    area: str  # name of the list that it stands in
    path: str  # of the file, from the root of the checkout
    breaks: str  # what is wrong with it
    before: str  # as in the file, where it occurs once
    after: str
    tests: tuple[str, ...]  # under tests/, the one that should notice first
    harmless: str = ""  # why no figure that is printed changes, for a mutant that no test notices
    kernels: bool = True  # whether kernels have to be compiled anew: not where the file has none
    plain: bool = False  # whether its tests run without compilation, the sooner where they take few steps

    def occurrences(self, root: Path) -> int:
        """How often the text is found in a checkout; it should be once."""
        file = root / self.path
        return file.read_text(encoding="utf-8").count(self.before) if file.is_file() else 0

    def apply(self, root: Path) -> str:
        """Change the file in a checkout, and return its text as it was."""
        file = root / self.path
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace(self.before, self.after), encoding="utf-8")
        return text

    def undo(self, root: Path, text: str) -> None:
        """Put the text back that ``apply`` returned."""
        (root / self.path).write_text(text, encoding="utf-8")


def load_mutants(folder: Path = FOLDER) -> list[Mutant]:
    """Mutants of all lists in a folder. Raises ValueError, naming the list, where one is not valid.

    A list is a TOML file of tables [[file]] with ``path``, ``tests`` and maybe ``kernels = false`` or
    ``plain = true``; each has tables [[file.mutant]] with ``breaks``, ``before``, ``after``, and maybe
    ``tests``, ``harmless`` or ``plain``.
    """
    mutants = []
    for path in sorted(folder.glob("*.toml")):
        for file in tomllib.loads(path.read_text(encoding="utf-8"))["file"]:
            common = {key: value for key, value in file.items() if key != "mutant"}
            for table in file["mutant"]:
                mutants.append(_mutant(path.stem, common | table))
    return mutants


def _mutant(area: str, table: dict[str, object]) -> Mutant:
    names = {field.name for field in fields(Mutant)} - {"area"}
    required = names - {"harmless", "kernels", "plain"}
    if not required <= table.keys() <= names or table["before"] == table["after"]:
        raise ValueError(f"{area}.toml: {table.get('breaks')!r} is not a mutant: {sorted(table)}")
    tests = table["tests"]
    assert isinstance(tests, list)
    return Mutant(area=area, **table | {"tests": tuple(f"tests/{test}" for test in tests)})  # type: ignore[arg-type]
