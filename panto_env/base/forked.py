"""What a forked process makes anew, since of its parent's threads it has but the one that forked."""

from __future__ import annotations

import os
import weakref
from typing import Protocol


class Renewable(Protocol):
    """What knows threads of its process."""

    def renew(self) -> None:
        """Begin anew, without them."""


_ALL: weakref.WeakSet[Renewable] = weakref.WeakSet()


def renew_in_forked(each: Renewable) -> None:
    """See to it that this is renewed in each process that is forked from here on, while it is held."""
    _ALL.add(each)


def _renew_all() -> None:
    for each in list(_ALL):
        each.renew()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_all)
