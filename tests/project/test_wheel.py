"""What is installed elsewhere: built of the packed sources, with all files, typed for those who use it."""

import email
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from importlib.metadata import distributions
from pathlib import Path

import pytest
import yaml
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

import panto_env

from ..known_kernels import BEGIN, BUILDING, USUAL, build_wheel

ROOT = Path(panto_env.__file__).parents[1]
FOLDERS = {"agents": "panto_agents", "baselines": "panto_baselines", "configs": "panto_configs"}
"""Folders whose name in the wheel is another."""
USER = """
import gymnasium
import panto_env
from panto_env import Trajectory, simulate

run: Trajectory = simulate("periodic-stiffness", "three-mass", 200.0, distance=600.0)
deviation: float = run.summary("all").std
wrong: int = run.summary("all").std
env = gymnasium.make("panto_env:PantographStiffness-v0")
env.reset(seed=0)
print(f"{deviation:.3f}", panto_env.__file__)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel, built from the packed sources, one for all processes that test it."""
    shared = tmp_path_factory.getbasetemp()
    shared = shared.parent if "PYTEST_XDIST_WORKER" in os.environ else shared
    folder = shared / "dist"
    with BUILDING:
        if not list(folder.glob("*.whl")):
            built = run([sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT])
            assert built.returncode == 0, built.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory):
    return installed(wheel, tmp_path_factory.mktemp("elsewhere"))


def installed(wheel, folder):
    """An interpreter that has the wheel, and what it stands on from here, but not this checkout."""
    venv.create(folder, with_pip=False, symlinks=True)
    interpreter = folder / "bin" / "python"
    command = [sys.executable, "-m", "pip", "--python", interpreter, "install", "-q", "--no-deps", wheel]
    subprocess.run(command, check=True, capture_output=True)
    (own,) = (folder / "lib").glob("python*/site-packages")
    (own / "below.pth").write_text(sysconfig.get_path("purelib"))
    return interpreter


def run(command, **options):
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


@pytest.mark.slow
def test_every_file_of_the_packages_is_in_it(wheel):
    listed = run(["git", "ls-files", "panto_env", *FOLDERS], cwd=ROOT)
    if listed.returncode != 0:
        pytest.skip("this is no checkout")
    names = (name.partition("/") for name in listed.stdout.split())
    wanted = {f"{FOLDERS.get(first, first)}/{rest}" for first, _, rest in names}
    inside = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert inside == wanted


FIRST = """
for settings in ({}, {"actuator": "realistic", "sensors": "realistic"}):
    make("Pantograph-v0", **settings)
"""


@pytest.mark.slow
def test_one_with_kernels_compiles_nothing_for_the_usual_environment(tmp_path):
    """Of one alone, for each takes half a minute to compile."""
    build_wheel(tmp_path / "dist", USUAL[:1])
    (path,) = (tmp_path / "dist").glob("*.whl")
    python = installed(path, tmp_path / "elsewhere")
    kept = tmp_path / "kept"
    ran = run([python, "-c", BEGIN + FIRST], cwd=tmp_path, env=os.environ | {"PANTO_CACHE_DIR": str(kept)})
    assert ran.returncode == 0, ran.stderr
    assert not list(kept.rglob("*.nbc"))


@pytest.mark.slow
def test_it_works_without_the_checkout_and_finds_what_it_comes_with(python, tmp_path):
    ran = run([python, "-c", USER.replace("wrong: int", "wrong")], cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    deviation, place = ran.stdout.split()
    assert float(deviation) > 0
    assert str(python.parents[1]) in place
    panto = python.parent / "panto"
    wanted = {
        ("--version",): panto_env.__version__,
        ("list", "en50318-2002"): "20000",
        ("list", "agent-known-line"): "agent-known-line",
        ("oracle", "--stored"): "300",
    }
    for arguments, words in wanted.items():
        shown = run([panto, *arguments], cwd=tmp_path, env=os.environ | {"COLUMNS": "200"})
        assert shown.returncode == 0, shown.stderr
        assert words in shown.stdout


@pytest.mark.slow
def test_it_is_typed_for_those_who_use_it(python, tmp_path):
    """A mistake is found in code that only imports it, so its types are seen, not taken for Any."""
    (tmp_path / "user.py").write_text(USER)
    options = ["--python-executable", python, "--cache-dir", tmp_path / "cache", "--strict"]
    found = run([sys.executable, "-m", "mypy", *options, tmp_path / "user.py"], cwd=tmp_path)
    errors = [line for line in found.stdout.splitlines() if "error:" in line]
    assert len(errors) == 1, found.stdout
    assert 'expression has type "float", variable has type "int"' in errors[0]


@pytest.mark.parametrize("python", ["3.11.0", "3.12.0", "3.13.0"])
def test_every_tested_version_takes_the_first_releases_of_the_pythons_that_we_name(python):
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


def test_the_citation_names_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == panto_env.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {panto_env.__version__} ({citation['date-released']})" in changelog


def test_what_is_published_names_authors_and_addresses_that_a_release_fills_in(tmp_path):
    """Each address begins with a placeholder until `make urls` replaces it, in each file."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert [each["name"] for each in project["authors"]] == [each["name"] for each in citation["authors"]]
    assert {"Homepage", "Source", "Issues", "Changelog"} <= set(project["urls"])
    addresses = [*project["urls"].values(), citation["url"], citation["repository-code"]]
    if not all(address.startswith("https://example.org/panto-env") for address in addresses):
        assert not any("example.org" in address for address in addresses)
        return
    notebooks = [f"examples/{path.name}" for path in (ROOT / "examples").glob("*.ipynb")]
    filled_in = ("pyproject.toml", "CITATION.cff", *notebooks)
    (tmp_path / "examples").mkdir()
    for name in ("Makefile", *filled_in):
        shutil.copy(ROOT / name, tmp_path / name)
    own = "https://forge.invalid/us/panto-env"
    assert run(["make", "urls"], cwd=tmp_path).returncode != 0
    done = run(["make", "urls", f"URL={own}"], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for name in filled_in:
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert own in text
        assert "example.org" not in text
        assert "Placeholders" not in text
    filled = tomllib.loads((tmp_path / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    assert filled["Issues"] == f"{own}/issues"


@pytest.mark.slow
def test_the_wheel_says_for_whom_it_is_and_what_it_needs(wheel):
    with zipfile.ZipFile(wheel) as packed:
        (name,) = (each for each in packed.namelist() if each.endswith(".dist-info/METADATA"))
        told = email.message_from_bytes(packed.read(name))
    assert told["Author"] == "The panto-env authors"
    classifiers = told.get_all("Classifier")
    assert "Typing :: Typed" in classifiers
    minimum = told["Requires-Python"].removeprefix(">=")
    assert f"Programming Language :: Python :: {minimum}" in classifiers
    assert [each.partition(", ")[0] for each in told.get_all("Project-URL")]
    source = dict(each.split(", ") for each in told.get_all("Project-URL"))["Source"]
    assert told["Description-Content-Type"] == "text/markdown"
    links = re.findall(r"\]\((.+?)\)", told.get_payload())  # a hub has no files beside it
    assert f"{source}/raw/main/docs/films/passive-and-agent.gif" in links
    assert f"{source}/blob/main/LICENSE" in links
    assert [link for link in links if not link.startswith("https://")] == []


@pytest.mark.slow
def test_the_packed_sources_hold_what_the_checkout_does(wheel):
    listed = run(["git", "ls-files"], cwd=ROOT)
    if listed.returncode != 0:
        pytest.skip("this is no checkout")
    (packed,) = wheel.parent.glob("*.tar.gz")
    with tarfile.open(packed) as sources:
        inside = {name.partition("/")[2] for name in sources.getnames()}
    assert set(listed.stdout.split()) <= inside
