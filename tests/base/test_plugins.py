from importlib.metadata import EntryPoint

import pytest

from panto_env import InputError
from panto_env.base import plugins


def test_what_this_package_brings_is_installed_in_the_order_of_names():
    assert {"passive", "p", "pd", "fb+ff"} <= set(plugins.installed(plugins.POLICIES))
    assert list(plugins.installed(plugins.COMMANDS)) == sorted(plugins.installed(plugins.COMMANDS))
    assert "safetensors" in plugins.installed(plugins.LOADERS)


def test_a_missing_package_is_named():
    point = EntryPoint("cleverest", "no_such_package.policies:Policy", plugins.POLICIES)
    with pytest.raises(InputError, match="'cleverest' needs a package that is not installed"):
        plugins.load(point)
