"""One process at a time in a folder."""

import pytest
from filelock import FileLock

from panto_env import InputError
from panto_env.base.files import alone_in


def test_a_folder_that_another_process_holds_is_refused_at_once(tmp_path):
    with FileLock(tmp_path / ".lock"), pytest.raises(InputError, match="Another process trains into"):  # noqa: SIM117
        with alone_in(tmp_path, "trains into"):
            pass
    with alone_in(tmp_path, "trains into"):  # now it is free
        assert (tmp_path / ".lock").exists()
