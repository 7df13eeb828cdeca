"""CONTRIBUTING.md has the rooms of the import contract; parameters go as docs/kernels.md shows."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]


def layers():
    table = tomllib.loads((ROOT / "pyproject.toml").read_text())
    (contract,) = [each for each in table["tool"]["importlinter"]["contracts"] if each["type"] == "layers"]
    return contract["layers"]


def test_rooms_are_those_of_the_import_contract():
    rooms = re.findall(
        r"^\| `(panto_\w+(?:\.\w+)?)` \|", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE
    )
    assert rooms == layers()


def test_forms_for_a_mistake_can_be_shown_and_ask_for_the_version():
    """GitHub drops a form without a word where a part has no label, or two have one id."""
    forms = {path.stem: yaml.safe_load(path.read_text()) for path in (ROOT / ".github").rglob("*.yml")}
    assert forms.pop("config") == {"blank_issues_enabled": True}
    assert set(forms) == {"bug", "wrong-figures"}
    for form in forms.values():
        assert form["name"]
        assert form["description"]
        parts = form["body"]
        assert all(part["attributes"]["label"] and part["type"] in ("input", "textarea") for part in parts)
        assert len({part["id"] for part in parts}) == len(parts)
        required = {part["id"] for part in parts if part.get("validations", {}).get("required")}
        assert {"command", "version"} <= required
        (version,) = (part for part in parts if part["id"] == "version")
        assert "`panto --version`" in version["attributes"]["description"]


def test_every_room_is_in_the_contract():
    places = [path for path in (ROOT / "panto_env").iterdir() if not path.name.startswith("__")]
    rooms = {f"panto_env.{path.stem}" for path in places if path.suffix == ".py" or path.is_dir()}
    assert rooms == {layer for layer in layers() if layer.startswith("panto_env.")}


@cache
def imported(file):
    """Files of the package that a file imports, but for types, by names relative to ``panto_env``."""
    package, found = ROOT / "panto_env", set()
    tree = ast.parse((package / file).read_text())
    types = {
        part
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for part in node.body
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level and node not in types:
            folder = (package / file).parents[node.level - 1].joinpath(*(node.module or "").split("."))
            places = [folder.with_suffix(".py"), *(folder / f"{name.name}.py" for name in node.names)]
            found |= {place.relative_to(package).as_posix() for place in places if place.is_file()}
    return found


def reached(file):
    """All files that a file imports, directly or not."""
    found, new = set(), {file}
    while new:
        found |= new
        new = set().union(*map(imported, new)) - found
    return found - {file}


@pytest.mark.longer
def test_five_parameters_go_down_through_the_house_and_through_no_file_twice():
    text = (ROOT / "docs/kernels.md").read_text()
    walks = re.findall(r"^- \*\*[\w' ]+\*\*: (`\w+/(?:.|\n(?! *[-\n]))+)", text, re.MULTILINE)
    assert len(walks) == 5
    for walk in walks:
        stops = re.findall(r"`([\w/]+\.py)`\s+\(`(\w+)`\)", walk)
        files = [file for file, _ in stops]
        assert len(files) == len(set(files)) == walk.count("→") + 1 >= 5
        for k, (file, name) in enumerate(stops):
            assert re.search(rf"\b{name}\b", (ROOT / "panto_env" / file).read_text()), (file, name)
            assert not reached(file) & set(files[:k]), file
