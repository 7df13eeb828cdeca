"""Names of the catalogue that earlier commits do not have, and what they had instead."""

from panto_env.catalog import available

EARLIER = {"own-two-mass": "dsa350", "own-motor-head": "atr95"}


def pantograph_named(name: str) -> str:
    """A pantograph's name in the commit that runs."""
    return name if name in available("pantograph") else EARLIER[name]
