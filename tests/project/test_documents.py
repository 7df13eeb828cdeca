"""What documents show is what works: their Python is run, their commands are run, shortened or parsed."""

import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from panto_env.catalog import load_pantograph
from panto_env.identification import FREQUENCY_SWEEP, add_noise, clean_record, parameters_of, write_record

from ..command import panto as run_panto
from ..documents import ROOT, check, commands, pages, panto, python, targets
from ..marks import some_at_once

MINUTES = "takes minutes"
SHELL = "<>|&;$*?`"
"""What makes a command line one for a shell."""


class Rule(NamedTuple):
    """How a command is tested that is not run as it stands."""

    begins: str  # what the command begins with; of several rules the longest one counts
    why: str
    with_options: str | None = None  # run with these, too; None: parsed, and not run


RULES = (
    Rule("panto app", "serves its page until it is stopped; tests/app/ has a browser look at it"),
    Rule("panto benchmark", "all speeds and seeds", "--speed 300 --seeds 1 --workers 1"),
    Rule("panto benchmark passive pd runs", "all seeds", "--seeds 1 --workers 1"),
    Rule("panto benchmark passive pd:washout=1 fb+ff", "all seeds", "--seeds 1 --workers 1"),
    Rule("panto benchmark ppo-0", "wants five trainings of a minute each, which README's snippet makes"),
    Rule("panto returns", "20 episodes of each policy", "--episodes 2"),
    Rule("panto dataset episodes dataset-known-line", "a thousand", "--episodes 1 --workers 1"),
    Rule("panto dataset episodes dataset-unknown-lines", "600", "--episodes 1 --workers 1"),
    Rule("panto dataset designs", MINUTES, "--count 8 --workers 1"),
    Rule("panto dataset verify data", "of what the three before made", ""),
    Rule("panto evaluate", "all speeds", "--speed 300"),
    Rule("panto family", "a pass for each of many seeds", "--seeds 2"),
    Rule("panto film", "hundreds of frames", "--seconds 0.1 --size 320 240"),
    Rule("panto film passive runs/demo", "wants an agent of `make demo`, which is run by hand"),
    Rule("panto drift", "of two fits, which take minutes; tests/fitting/test_drift.py has made-up ones"),
    Rule("panto diagnose month3-220.csv", "of a fit; tests/diagnosis/test_measured_passes.py has one"),
    Rule("panto fit", f"{MINUTES}; tests/fitting/test_commands.py has short ones"),
    Rule("panto simulate --catenary found.toml", "of a fit; tests/fitting/test_fitted_line.py has one"),
    Rule("panto compare month1-220.csv", "of a fitted line's run; tests/records/test_compare.py has others"),
    Rule(
        "panto design",
        f"a search {MINUTES}, of a file that the page shows; tests/studies/test_design.py has short ones",
    ),
    Rule("panto line runs/droppers", "of that search; tests/studies/test_design.py has short ones"),
    Rule("panto permissible-speed runs/droppers", "of that search"),
    Rule("panto permissible-speed", "hundreds of passes", "--speeds 200:220:20 --seeds 1 --workers 1"),
    Rule("panto oracle", f"a search {MINUTES}; tests/baselines/test_oracle.py has short ones"),
    Rule("panto oracle --stored", "as it stands", ""),
    Rule("panto reproduce", f"a study {MINUTES}; each has a test file of its own"),
    Rule("panto reproduce paper3-parameters", "ten seconds", ""),
    Rule("panto speed --json", f"{MINUTES}, and means nothing on a busy machine"),
    Rule("panto train agent-ppo", MINUTES, "--steps 1000"),
    Rule("panto train agent-ppo-gpu", "wants a GPU; tests/agents/test_device_ppo.py has a short one without"),
    Rule("panto speed --device cuda", "wants a GPU, and means nothing on a busy machine"),
    Rule("panto train agent-clone", "clones a million steps first; tests/agents/test_agents.py clones fewer"),
    Rule("panto train agent-residual", f"{MINUTES}; tests/agents/test_agents.py has a short one"),
    Rule("panto train ppo --output runs/ppo", "what follows needs its model", "--steps 1000"),
    Rule("panto trainings", "six trainings of minutes, or a cluster; tests/cluster/ has short ones"),
    Rule("panto submission check", "all speeds", "--config benchmark/without-position --seeds 1 --workers 1"),
    Rule("panto sweep catenary.mean_stiffness=2000:6000:17", "527 passes", ""),
    Rule("panto tune", MINUTES, "--speed 300 --seeds 1 --passes 2 --workers 1 --output gains-$$.toml"),
)
"""The only exceptions; whatever has none is run as it stands."""
BY_HAND = re.findall(
    r"\w+",
    "accuracy bounds benchmark coverage demo docs films fuzz libraries lint notebook nonsense studies ptx "
    "ray rllib wheel same urls mutants",
)
"""Targets of the Makefile that CI does not run: they take long, or tests run parts of them."""
SHORTENED = {
    "README.md": {
        "num_envs=32": "num_envs=2",
        "n_steps=512, batch_size=4096": "n_steps=64, batch_size=64",
        "learn(500_000)": "learn(100)",
    },
    "docs/how-to.md": {
        "num_envs=32": "num_envs=2",
        '"n_steps": 512, "batch_size": 4096': '"n_steps": 16, "batch_size": 32',
        "learn(200_000": "learn(32",
        "n_eval_episodes=32": "n_eval_episodes=1",
        "n_trials=20": "n_trials=2",
    },
}
"""Text in the Python of a page, and what runs instead."""
EPISODE = "panto dataset episodes dataset-known-line --only fitted-fb-ff --episodes 1 --workers 1"
PREPARED = {"docs/datasets.md": EPISODE}
"""What the Python of a page takes for granted, made beforehand."""
CONTROLLER = "from panto_baselines.policies.feedback import ProportionalDerivative as Mine\n"


def rule_of(command):
    fitting = [rule for rule in RULES if f"{command.text} ".startswith(rule.begins)]
    return max(fitting, key=lambda rule: len(rule.begins), default=None)


def shown(tool=""):
    return [command for page in pages() for command in commands(page) if command.text.startswith(tool)]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with what documents take for granted: results, a record of a rig, a controller."""
    for name in ("benchmark", "speed"):
        shutil.copytree(ROOT / "docs" / name, tmp_path / "docs" / name)
    shutil.copytree(ROOT / "examples" / "submission", tmp_path / "my-policy")
    (tmp_path / "docs" / "figures").mkdir()
    for name in (
        "masts.csv",
        "overlap.toml",
        "curve-masts.csv",
        "standard.toml",
        "droppers.toml",
    ):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    truth = parameters_of(load_pantograph("identified-2dof"))
    write_record(
        add_noise(clean_record(FREQUENCY_SWEEP, truth), np.random.default_rng(0)), tmp_path / "rig.csv"
    )
    (tmp_path / "my_controller.py").write_text(CONTROLLER)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    return tmp_path


def with_options(text, options):
    """A command with other options, in the place of its own ones of these names: none may be given twice."""
    for option, values in re.findall(r"(--[a-z-]+)((?: (?!--)\S+)*)", options):
        text = re.sub(rf" {option}{r'(?: [^ ]+)' * len(values.split())}(?= |$)", "", text)
    return f"{text} {options}"


def run(page, folder):
    """Run the commands of a page in order."""
    for command in commands(page):
        rule = rule_of(command)
        if not (command.whole and command.words[0] == "panto") or (rule and rule.with_options is None):
            continue
        line = with_options(command.text, rule.with_options) if rule else command.text
        if set(line) & set(SHELL):
            done = subprocess.run(["bash", "-c", line], cwd=folder, capture_output=True, text=True)
        else:
            done = run_panto(*shlex.split(line)[1:], cwd=folder)
        assert done.returncode == 0, f"{command.place}\nwas run as {line}\n{done.stdout}{done.stderr}"


@pytest.mark.slow
@pytest.mark.parametrize("page", pages())
def test_every_command_can_be_given(page):
    for command in commands(page):
        check(command)


@pytest.mark.slow
@pytest.mark.parametrize("page", pages())
def test_commands_of_a_page_run(page, folder):
    run(page, folder)


WITH_PYTHON = [page for page in pages() if "```python" in (ROOT / page).read_text(encoding="utf-8")]
LONG = ("docs/datasets.md", "docs/films.md", "docs/gpu.md")


@pytest.mark.slow
@pytest.mark.parametrize("page", some_at_once(WITH_PYTHON, set(WITH_PYTHON) - set(LONG)))
def test_python_of_a_page_runs(page, folder, capsys):
    names = {"__name__": page}
    if page in PREPARED:
        subprocess.run(PREPARED[page].split(), cwd=folder, check=True, capture_output=True)
    for block in python(page):
        text = block.text
        for long, short in SHORTENED.get(page, {}).items():
            text = text.replace(long, short)
        if page == "README.md":  # who copies one block has only that one
            names = {"__name__": page}
        exec(compile("\n" * (block.line - 1) + text, ROOT / page, "exec"), names)
        printed = capsys.readouterr().out
        if page == "README.md" and "\nprint(" in text:  # what it prints stands at the block's end
            assert printed
            assert text.endswith("".join(f"# {line}\n" for line in printed.splitlines()))


def test_the_first_page_is_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 100
    assert len(text.split()) <= 900


@pytest.mark.longer
def test_no_exception_is_left_of_a_document_that_has_changed():
    used = {rule_of(command) for command in shown() if command.whole}
    assert [rule.begins for rule in RULES if rule not in used] == []
    for page, changes in SHORTENED.items():
        text = "".join(block.text for block in python(page))
        assert [long for long in changes if long not in text] == []


def test_targets_that_documents_name_are_run_by_ci_or_by_hand():
    ci = set(re.findall(r"^make (\w+)", (ROOT / ".ci" / "run").read_text(), re.MULTILINE))
    named = {word for each in shown("make ") for word in each.words[1:] if "=" not in word}
    assert named <= ci | set(BY_HAND)
    assert not set(BY_HAND) & ci
    assert set(BY_HAND) <= set(targets())


def test_studies_in_tests_that_documents_run_can_be_loaded():
    told = [ROOT / "Makefile", *(ROOT / page for page in pages())]
    modules = {name for each in told for name in re.findall(r"-m (tests\.[\w.]+\w)", each.read_text())}
    assert "tests.before.speed" in modules
    for module in sorted(modules):
        importlib.import_module(module)


def test_every_command_has_its_row():
    section = (ROOT / "docs" / "commands.md").read_text()
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    assert sorted(name.strip(" `") for row in rows for name in row.split(",")) == sorted(panto().commands)
    without = {name for name, command in panto().commands.items() if not takes_json(command)}
    told = re.search(r"All but (.*?) take `--json`", " ".join(section.split()))[1]
    assert sorted(re.findall(r"`(\w+)`", told)) == sorted(without)


def takes_json(command):
    """Whether it does, or each of its own commands."""
    if hasattr(command, "commands"):
        return any(takes_json(own) for own in command.commands.values())
    return any("--json" in parameter.opts for parameter in command.params)


PROMISED = re.findall(r"`(tests/\S+?)::(\w+)`", (ROOT / "docs" / "promises.md").read_text(encoding="utf-8"))


def test_what_is_promised_has_its_test():
    assert len(PROMISED) > 20
    for file, name in PROMISED:
        text = (ROOT / file).read_text(encoding="utf-8")
        assert re.search(rf"^\s*def {name}\(", text, re.MULTILINE), (file, name)
