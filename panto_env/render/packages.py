"""Check for the packages of the extra 'render', before any of them is imported."""

from __future__ import annotations

from importlib.util import find_spec

from ..base.errors import InputError, listed

IN_WORDS = {"cv2": "OpenCV", "pygame": "pygame", "imageio_ffmpeg": "imageio-ffmpeg"}


def check_packages(*names: str) -> None:
    """Raise InputError where packages that a picture or a film needs are not installed."""
    missing = [IN_WORDS[name] for name in names if find_spec(name) is None]
    if missing:
        raise InputError(
            f"Pictures and films need {listed(missing)} not installed; install panto-env with its "
            "extra: pip install 'panto-env[render]'."
        )
