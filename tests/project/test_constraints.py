"""The versions that `make demo` installs."""

from importlib.metadata import distributions
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("python", ["3.11.0", "3.12.0", "3.13.0"])
def test_every_version_takes_the_first_releases_of_the_pythons_that_we_name(python):
    """One wanted 3.11.5: on Debian's 3.11.2 pip looked for another version for minutes, and failed."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    tested = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    tested = {canonicalize_name(name): version for name, version in tested.items()}
    wanted = {
        each.name: SpecifierSet(each.metadata["Requires-Python"] or "")
        for each in distributions()
        if tested.get(canonicalize_name(each.name)) == each.version
    }
    assert len(wanted) > 80
    assert not [f"{name} {versions}" for name, versions in wanted.items() if not versions.contains(python)]
