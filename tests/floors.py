"""The lower bounds of pyproject.toml as constraints for pip, one a line: `python -m tests.floors control`.

Those of the project's own dependencies, and of the extras that are named.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

from packaging.requirements import Requirement

PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


def floors(extras: Sequence[str] = ()) -> Iterator[str]:
    """Pins such as "numpy==2.0". Raises ValueError for a requirement without a lower bound."""
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]
    lists = [project["dependencies"], *(project["optional-dependencies"][extra] for extra in extras)]
    for requirement in (Requirement(text) for each in lists for text in each):
        lowest = [each.version for each in requirement.specifier if each.operator == ">="]
        if len(lowest) != 1:
            raise ValueError(f"{requirement} needs one lower bound, as name>=1.2")
        yield f"{requirement.name}=={lowest[0]}"


if __name__ == "__main__":
    print("\n".join(floors([extra for given in sys.argv[1:] for extra in given.split(",")])))
