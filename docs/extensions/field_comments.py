"""Docstrings as the reference shows them.

The comment behind a field in the source is its description: unit, shape, meaning. Dataclasses and named
tuples of this project say `time: Array  # (n,): s`; Sphinx sees values, not comments.
"""

import ast
import inspect
import io
import tokenize
from functools import cache

from sphinx.application import Sphinx


@cache
def comments_of_fields(owner: type) -> dict[str, str]:
    """Comment of each annotated field of a class, by name."""
    try:
        source = inspect.cleandoc("\n" + inspect.getsource(owner))
    except (OSError, TypeError):
        return {}
    found = {
        token.start[0]: token.string.lstrip("# ").strip()
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    (definition,) = ast.parse(source).body
    assert isinstance(definition, ast.ClassDef)
    return {
        statement.target.id: found[statement.end_lineno]
        for statement in definition.body
        if isinstance(statement, ast.AnnAssign)
        and isinstance(statement.target, ast.Name)
        and statement.end_lineno in found
    }


IN_MARKDOWN = {"panto_env.envs.PantographEnv"}
"""Classes whose docstring is a page of its own, as Gymnasium's are; only its first line is shown."""


def add_fields(app: Sphinx, what: str, name: str, owner: object, options: object, lines: list[str]) -> None:
    """Append the fields of a class to its description."""
    if name in IN_MARKDOWN:
        lines[1:] = ["", "All of it stands on the pages of the environments."]
    if what == "class" and isinstance(owner, type):
        comments = {
            k: v for base in reversed(owner.__mro__[:-1]) for k, v in comments_of_fields(base).items()
        }
        lines += [""] * bool(comments)
        lines += [
            f":ivar {field}: {comment.replace('|', chr(92) + '|')}" for field, comment in comments.items()
        ]


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("autodoc-process-docstring", add_fields)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
