"""Commands and Python that documents show, found and parsed: `tests/project/test_documents.py` runs them."""

import contextlib
import io
import re
import shlex
import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import typer
from markdown_it import MarkdownIt
from packaging.requirements import Requirement

from panto_agents.ablation import load_ablation
from panto_agents.settings import load_training
from panto_baselines.benchmark.settings import load_benchmark
from panto_baselines.oracle.stored import oracle_settings
from panto_env.base.errors import InputError
from panto_env.control.settings import run_settings
from panto_env.policies import find_policy
from panto_env.studies import STUDIES

from .command import whole

ROOT = Path(__file__).parents[1]
GENERATED = ("_build", "generated")
"""Folders of docs/ that are not kept."""
SHELLS = ("", "sh", "bash", "shell", "console")
"""Languages of blocks that hold commands: a block without a language does, too."""
SETTINGS = ("simulate", "sweep", "benchmark", "tune", "oracle", "evaluate")
"""Commands whose options are settings of a run."""
UNFINISHED = ("MissingParameter", "BadOptionUsage", "NoArgsIsHelpError")
"""What the parser says of a command in a sentence that names an option, or itself, and not the rest."""


class Block(NamedTuple):
    """A block of code, or code within a sentence."""

    page: str
    line: int
    language: str | None  # None: within a sentence
    text: str


class Command(NamedTuple):
    """A command of a document."""

    page: str
    line: int
    whole: bool  # whether it stands in a block, and not within a sentence
    text: str  # without comment

    @property
    def words(self):
        return shlex.split(self.text)

    @property
    def place(self):
        return f"{self.page}:{self.line}: {self.text}"


@cache
def pages():
    """All documents, as paths from the project's folder."""
    documents = [path for path in (ROOT / "docs").rglob("*.md") if not set(GENERATED) & set(path.parts)]
    return sorted(
        str(path.relative_to(ROOT)) for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *documents]
    )


@cache
def blocks(page):
    """What a page has of code, in order. Sphinx's directives, ```{name}, are none."""
    found = []
    for token in MarkdownIt("commonmark").enable("table").parse((ROOT / page).read_text(encoding="utf-8")):
        line = (token.map or [0])[0] + 1
        if token.type == "fence" and not token.info.startswith("{"):
            found.append(Block(page, line + 1, token.info.strip(), token.content))
        for child in token.children or ():
            if child.type == "code_inline":
                found.append(Block(page, line, None, child.content))
    return found


@cache
def commands(page):
    """The commands of a page, in order: lines of its blocks, and `panto ...` within its sentences."""
    found = []
    for block in blocks(page):
        if block.language is None:
            if re.match(r"(panto|make|pip) ", block.text):
                found.append(Command(page, block.line, False, block.text))
            continue
        if block.language not in SHELLS:
            continue
        joined = block.text.replace("\\\n", " ")
        for k, line in enumerate(joined.splitlines()):
            text = re.sub(r"\s+#\s.*$", "", line).strip()
            if text and not text.startswith("#"):
                found.append(Command(page, block.line + k, True, re.sub(r"\s+", " ", text)))
    return found


def python(page):
    """The Python blocks of a page, in order."""
    return [block for block in blocks(page) if block.language == "python"]


@cache
def panto():
    """The command `panto`."""
    return whole()


def check(command):
    """Raise AssertionError where nobody could give this command: its parser is asked, and nothing run."""
    tool, *words = command.words
    checks = {"panto": _panto, "make": _make, "pip": _pip, ".venv/bin/pytest": _pytest, "python": _python}
    assert tool in checks, (
        f"{command.place}: a block without a language, or of a shell, holds commands of {', '.join(checks)}; "
        "name the language of any other (```text)"
    )
    checks[tool](command, words)


def targets():
    """Targets of the Makefile, with those that each asks for before."""
    found = re.findall(r"^([a-z]+):(.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    return {name: before.split() for name, before in found}


def _panto(command, words):
    words = words[: words.index(">")] if ">" in words else words
    group = panto()
    name = next((word for word in words if not word.startswith("-")), None)
    assert name is None or name in group.commands, f"{command.place}: there is no command {name}"
    one = group if name is None else group.commands[name]
    if words[1:] and words[1] in getattr(one, "commands", ()):  # a command of a command
        name, words, one = words[1], words[1:], one.commands[words[1]]
    known = {option for each in one.params for option in each.opts} | {"--help", "-h"}
    unknown = {word.partition("=")[0] for word in words if word.startswith("--")} - known
    assert not unknown, f"{command.place}: it has no option {', '.join(sorted(unknown))}"
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            context = one.make_context(name or "panto", words[1:] if name else words)
    except typer.Exit:  # --help and --version
        return
    except InputError as error:
        raise AssertionError(f"{command.place}: {error}") from error
    except Exception as error:  # the parser's; which package has its class depends on the version
        if not command.whole and type(error).__name__ in UNFINISHED:
            return
        raise AssertionError(f"{command.place}: {error}") from error
    try:
        _check_values(name, context.params)
    except InputError as error:
        raise AssertionError(f"{command.place}: {error}") from error


def _check_values(name, values):
    """Raise InputError where what a command is given by name or as a setting is not valid."""
    for key, load in (("train", load_training), ("benchmark", load_benchmark), ("ablation", load_ablation)):
        if name == key and values.get("config") is not None:
            load(values["config"])
    if name == "trainings":
        for config in values["configs"]:
            load_training(config)
    if name == "oracle":
        oracle_settings(values["config"], {}, {})
    if name == "reproduce" and values["name"] not in (*STUDIES, "all"):
        raise InputError(f"There is no study {values['name']}.")
    if name == "tune":
        find_policy(values["policy"])
    if name == "list" and values["name"] not in (None, "NAME"):
        panto().commands["list"].callback(**values)
    if name in SETTINGS:
        given = {key: values.get(key) for key in ("catenary", "pantograph", "actuator", "line_condition")}
        given |= {key: values.get(key) for key in ("sensors", "pantograph_scatter", "speed_drift")}
        if isinstance(given["pantograph"], list | tuple):  # each is checked by itself: distances may be swept
            for own in given.pop("pantograph"):
                run_settings({"pantograph": own} if ".toml" not in own else {})
        run_settings({key: value for key, value in given.items() if value and ".toml" not in str(value)})


def _make(command, words):
    for word in words:
        assert "=" in word or word in targets(), f"{command.place}: the Makefile has no target {word}"


def _pip(command, words):
    assert words[0] == "install", command.place
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for word in words[1:]:
        wanted = Requirement(f"panto-env{word[1:]}" if word.startswith(".") else word)
        assert wanted.name == "panto-env", f"{command.place}: {wanted.name} is not this project"
        unknown = wanted.extras - set(extras)
        assert not unknown, f"{command.place}: there is no extra {', '.join(sorted(unknown))}"


def _pytest(command, words):
    assert (ROOT / words[0]).is_file(), f"{command.place}: there is no {words[0]}"
    if "-k" in words:
        part = words[words.index("-k") + 1]
        tests = re.findall(r"^def (test_\w+)", (ROOT / words[0]).read_text(), re.MULTILINE)
        assert any(part in test for test in tests), f"{command.place}: no test is called so"


def _python(command, words):
    assert (ROOT / words[0]).is_file(), f"{command.place}: there is no {words[0]}"
