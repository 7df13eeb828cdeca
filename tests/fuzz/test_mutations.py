"""Damaged files end well: thousands in the proofs, more in `make fuzz`."""

import json
import sys

import pytest

from panto_env.backend import JIT

pytest.importorskip("resource", reason="cases are forked, as only Unix can")
pytestmark = [
    pytest.mark.skipif(not JIT, reason="plain Python takes too long"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="cases are forked"),
]


def check(count, folder):
    from .mutations import BAD, tried

    told = []
    ends = tried(count, folder, told.append)
    print(ends)
    assert not told, "\n".join(told)
    assert set(ends) == {"TOML", "CSV", "Parquet", "JSON", "model"}
    for kind, counts in ends.items():
        assert BAD not in counts
        assert counts["refused"] > 0.3 * counts.total(), kind  # else it is the damage that is none


@pytest.mark.slow
def test_thousands(tmp_path):
    check(3000, tmp_path)


def test_none_of_a_file_with_a_checksum_goes_unnoticed(tmp_path, capsys):
    from .mutations import run_cases
    from .subjects import subjects

    (tmp_path / "files").mkdir()
    for name, subject in subjects(tmp_path / "files").items():
        if subject.checked:
            run_cases(subject, range(36), tmp_path)
            told = capsys.readouterr().out
            assert '"bad"' not in told, f"{name}: {told}"
            assert json.loads(told.splitlines()[-1])["ends"]["refused"] > 10


def test_each_damage_is_one():
    """None leaves every file as it is, and what one does is decided by its seed."""
    import numpy as np

    from .mutations import MUTATIONS

    data = b'kind = "line"\nmass = 1.25\nnames = ["a", "b"]\n' * 3
    for mutation in MUTATIONS:
        once, again = ([mutation(data, np.random.default_rng(seed)) for seed in range(20)] for _ in range(2))
        assert once == again
        assert sum(each != data for each in once) > 10, mutation.__name__


def test_silent_changes_and_rude_refusals_are_told(tmp_path):
    from panto_env import InputError

    from .mutations import judged
    from .subjects import Subject

    def rude(path):
        raise InputError("line 1\nline 2")

    path = tmp_path / "file"
    path.write_text("2")
    read = lambda path: path.read_text()  # noqa: E731
    assert judged(Subject("JSON", path, read, checked=True), path, "'1'") == "BAD: changed in silence"
    assert judged(Subject("TOML", path, read), path, "'1'") == "valid otherwise"
    assert judged(Subject("TOML", path, read), path, "'2'") == "unchanged"
    assert judged(Subject("TOML", path, rude), path, "'1'").startswith("BAD: not one sentence")
