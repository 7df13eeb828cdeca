"""Packages that only an extra of this project brings: those that are missing are named in one sentence."""

from importlib.util import find_spec

from .errors import InputError, listed

NAMES = {"cv2": "opencv", "sklearn": "scikit-learn"}
"""Packages whose modules are called otherwise."""


def require(what: str, extra: str, *modules: str, otherwise: str = "") -> None:
    """Raise InputError, with the command that installs them, where modules of an extra are not installed.

    what: needs them, such as "Training"; otherwise: another way out, as a clause. Nothing is imported.
    """
    missing = [NAMES.get(name, name.replace("_", "-")) for name in modules if find_spec(name) is None]
    if missing:
        ways = f"pip install 'panto-env[{extra}]'{otherwise and f'; {otherwise}'}"
        raise InputError(f"{what} needs {listed(missing)} not installed: {ways}.")
