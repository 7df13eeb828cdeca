"""What pyproject.toml can't say: README for a hub, which has no other file of ours beside it."""

import re
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).resolve().parent
SOURCE = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]["Source"]
LOCAL = r"(?!https?://|#)"


def absolute(text: str) -> str:
    """The text with addresses of the published source where it has paths, of pictures and of links."""
    text = re.sub(rf"(!\[[^]]*\]\(){LOCAL}", rf"\g<1>{SOURCE}/raw/main/", text)
    return re.sub(rf"((?<!!)\[[^]]*\]\(){LOCAL}", rf"\g<1>{SOURCE}/blob/main/", text)


setup(
    long_description=absolute((HERE / "README.md").read_text(encoding="utf-8")),
    long_description_content_type="text/markdown",
)
