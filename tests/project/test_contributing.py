"""The rooms in CONTRIBUTING.md are those of the import contract, in its order."""

import re
import tomllib
from pathlib import Path

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


def test_every_room_is_in_the_contract():
    places = [path for path in (ROOT / "panto_env").iterdir() if not path.name.startswith("__")]
    rooms = {f"panto_env.{path.stem}" for path in places if path.suffix == ".py" or path.is_dir()}
    assert rooms == {layer for layer in layers() if layer.startswith("panto_env.")}
