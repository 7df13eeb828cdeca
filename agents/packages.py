"""Check for the packages of the extra 'agents' before any of them is imported."""

from __future__ import annotations

from importlib.util import find_spec

from panto_env.base.errors import InputError, listed

PACKAGES = ("torch", "stable_baselines3", "tensorboard")


def check_packages() -> None:
    """Raise InputError, naming them, if packages that a training needs are not installed."""
    missing = [name for name in PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(
            f"Training needs {listed(missing)} not installed; install panto-env with its "
            "extra: pip install 'panto-env[agents]'."
        )
