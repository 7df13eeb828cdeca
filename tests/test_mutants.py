"""The lists of mutants keep up with the source, and the runner tells what is noticed from what is not."""

import re
from collections import Counter

import pytest

from .mutants.mutant import Mutant, load_mutants
from .mutants.report import Verdict
from .mutants.workbench import ROOT

MUTANTS = load_mutants()


@pytest.mark.parametrize("path", sorted({mutant.path for mutant in MUTANTS}))
def test_each_text_is_found_once_in_its_file(path):
    """Where a source is changed, its mutants have to be changed with it: `python -m tests.mutants --list`."""
    counts = {mutant.breaks: mutant.occurrences(ROOT) for mutant in MUTANTS if mutant.path == path}
    assert counts == dict.fromkeys(counts, 1)


def test_each_mutant_is_valid_python():
    for mutant in MUTANTS:
        text = (ROOT / mutant.path).read_text(encoding="utf-8").replace(mutant.before, mutant.after)
        compile(text, f"{mutant.path}, {mutant.breaks}", "exec")


def test_each_mutant_is_described_once_and_names_tests_that_exist():
    described = Counter((mutant.path, mutant.breaks) for mutant in MUTANTS)
    assert described.most_common(1)[0][1] == 1
    for test in {test for mutant in MUTANTS for test in mutant.tests}:
        path, _, name = test.partition("[")[0].partition("::")
        assert (ROOT / path).is_file(), test
        assert not name or re.search(rf"def {name}\b", (ROOT / path).read_text()), test


def test_a_list_with_a_mistake_is_refused(tmp_path):
    text = '[[file]]\npath = "a"\ntests = ["b"]\n[[file.mutant]]\nbreaks = "c"\nbefore = "d"\n'
    (tmp_path / "x.toml").write_text(text + 'after = "e"\n')
    assert load_mutants(tmp_path)[0].tests == ("tests/b",)
    for mistake in ('after = "d"\n', 'after = "e"\nwhy = "f"\n', ""):
        (tmp_path / "x.toml").write_text(text + mistake)
        with pytest.raises(ValueError, match=r"x.toml: 'c' is not a mutant"):
            load_mutants(tmp_path)


def test_a_mutant_is_made_and_undone(tmp_path):
    file = tmp_path / "code.py"
    file.write_text("a = 1\nb = 2\n")
    mutant = Mutant("list", "code.py", "one is two", "a = 1", "a = 2", ())
    text = mutant.apply(tmp_path)
    assert file.read_text() == "a = 2\nb = 2\n"
    assert mutant.occurrences(tmp_path) == 0
    mutant.undo(tmp_path, text)
    assert mutant.occurrences(tmp_path) == 1


@pytest.mark.parametrize(
    ("noticed_by", "harmless", "at_fault"),
    [
        ("tests/t.py::t", "", False),
        ("", "", True),
        ("", "a reason", False),
        ("tests/t.py::t", "a reason", True),
    ],
)
def test_a_survivor_needs_an_argument_and_nothing_else_has_one(noticed_by, harmless, at_fault):
    mutant = Mutant("list", "code.py", "one is two", "1", "2", (), harmless)
    assert bool(Verdict(mutant, noticed_by, True, 1.0).fault) == at_fault
