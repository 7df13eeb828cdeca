"""A sentence or two on what a policy is, from its name in a result; no code of a user's is run."""

from __future__ import annotations

import inspect
from pathlib import Path

from panto_env.base import plugins
from panto_env.base.errors import InputError
from panto_env.policies import maker_of

from ..benchmark.settings import BLIND, TAPE, control_of, policy_of

CONTROLS = {
    BLIND: "A control: {}, given its first observation at every step.",
    TAPE: "A control: the actions that {} took on another line, under another seed, played back.",
}


def what_is(policy: str) -> str:
    """First paragraph of an installed policy's docstring; for any other policy, what its name says."""
    control = control_of(policy)
    if control:
        return CONTROLS[control].format(policy_of(policy))
    name = policy.partition(":")[0]
    if name in plugins.installed(plugins.POLICIES):
        try:
            text = inspect.getdoc(maker_of(name)) or "It has no description."
        except InputError as error:  # a package that it needs is missing
            return str(error)
        return " ".join(text.partition("\n\n")[0].split())
    if name.endswith(".py"):
        return "A class in a Python file of the user's, which is not read for this page."
    if Path(policy).suffix[1:] in plugins.installed(plugins.LOADERS):
        return "A model from a file, which is not read for this page."
    return "It is not installed where this page was made."
