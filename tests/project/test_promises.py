"""What docs/promises.md promises has a test of that name."""

import re

import pytest

from ..pages import DOCS

NAMED = re.findall(r"`(tests/\S+?)::(\w+)`", (DOCS / "promises.md").read_text(encoding="utf-8"))


def test_there_are_some():
    assert len(NAMED) > 20


@pytest.mark.parametrize(("file", "name"), NAMED)
def test_a_promise_has_its_test(file, name):
    text = (DOCS.parent / file).read_text(encoding="utf-8")
    assert re.search(rf"^\s*def {name}\(", text, re.MULTILINE)
