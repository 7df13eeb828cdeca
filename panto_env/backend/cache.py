"""The cache folder of compiled kernels, named by a hash of what they are made of.

Numba's cache notices an edit in a kernel's own file but not in another file that the kernel calls. So all
functions and constants that kernels name are followed (``kernel_sources``), and nothing else counts: not the
rest of their files, and neither docstrings, comments and annotations nor the words of errors. The folder's
content is executed, so it is used only if it belongs to this user and no other can write to it.
"""

from __future__ import annotations

import ast
import atexit
import hashlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numba

from ..base.checksums import checksum, read_checked, write_checked
from ..base.errors import InputError

DECORATORS = (
    *("kernel", "inlined", "called", "operation", "implements", "in_python", "intrinsic", "overload"),
    *("entry", "entries"),  # of ``control.entries``
)
"""Names of the decorators of functions that Numba compiles."""
COMPILER = ("compile",)
"""Files of ``backend`` that say how kernels are compiled."""
MARK = re.compile(rf"^\s*@(?:{'|'.join(DECORATORS)})\b", re.MULTILINE)

Place = tuple[str, str]
"""A module, and a name at its top level."""


class _Module(NamedTuple):
    defined: dict[str, list[ast.stmt]]  # statements by the name that they bind
    imported: dict[str, Place]  # where imported names come from; ("x.y", "") is a module
    roots: list[str]  # names of functions that Numba compiles


def kernel_sources(package: Path) -> list[tuple[Place, str]]:
    """Everything that kernels of a package are made of: its place, and its syntax tree.

    package: its folder. All statements of the files that set the compiler up count too.
    """
    compilers = {f"{package.name}.backend.{each}" for each in COMPILER}
    files = {_module_name(path, package): path for path in package.rglob("*.py")}
    marked = [each for each, path in files.items() if MARK.search(path.read_text(encoding="utf-8"))]
    parsed = cache(lambda module: _parse(files[module], module, files))
    waiting: list[Place] = [(module, root) for module in marked for root in parsed(module).roots]
    waiting += [(module, each) for module in compilers & files.keys() for each in parsed(module).defined]
    found: dict[Place, str] = {}
    while waiting:
        place = waiting.pop()
        module, own = place
        if place in found or module not in files:
            continue
        tree = parsed(module)
        if own in tree.imported and own not in tree.defined:
            waiting.append(tree.imported[own])
            continue
        statements: list[ast.stmt] = [_Bare().visit(each) for each in tree.defined.get(own, ())]
        found[place] = "\n".join(map(ast.dump, statements))
        for statement in statements:
            waiting += _named(statement, module, tree)
    return sorted(found.items())


def _module_name(path: Path, package: Path) -> str:
    parts = path.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


def _parse(path: Path, module: str, files: dict[str, Path]) -> _Module:
    home = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    tree = _Module({}, {}, [])
    for statement in _statements(ast.parse(path.read_text(encoding="utf-8")).body):
        if isinstance(statement, ast.ImportFrom):
            parents = home[: len(home) + 1 - statement.level] if statement.level else []
            source = ".".join([*parents, *(statement.module or "").split(".")]).strip(".")
            for alias in statement.names:
                within = f"{source}.{alias.name}"
                place = (within, "") if within in files else (source, alias.name)
                tree.imported[alias.asname or alias.name] = place
            continue
        for name in _bound(statement):
            tree.defined.setdefault(name, []).append(statement)
        if isinstance(statement, ast.FunctionDef) and _compiled(statement):
            tree.roots.append(statement.name)
    return tree


def _statements(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements at the top level, and in its conditions."""
    for statement in body:
        yield statement
        if isinstance(statement, ast.If | ast.Try):
            yield from _statements([*statement.body, *statement.orelse])


def _bound(statement: ast.stmt) -> Iterator[str]:
    """Names that a statement binds, or that it calls something with: ``overload(one)(other)``."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Assign | ast.AnnAssign | ast.AugAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        yield from (each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))
    elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        yield from (each.id for each in ast.walk(statement) if isinstance(each, ast.Name))


def _compiled(function: ast.FunctionDef) -> bool:
    called = (each.func if isinstance(each, ast.Call) else each for each in function.decorator_list)
    return any((getattr(each, "id", None) or getattr(each, "attr", "")) in DECORATORS for each in called)


def _named(statement: ast.stmt, module: str, tree: _Module) -> Iterator[Place]:
    """Places of what a statement names."""
    for each in ast.walk(statement):
        if isinstance(each, ast.Name):
            yield module, each.id
        elif isinstance(each, ast.Attribute) and isinstance(each.value, ast.Name):
            source, name = tree.imported.get(each.value.id, ("", "x"))
            if not name:  # an attribute of a module
                yield source, each.attr


class _Bare(ast.NodeTransformer):
    """Leaves out what no kernel depends on."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        return ast.Raise()

    def visit_arg(self, node: ast.arg) -> ast.AST:
        return ast.arg(node.arg)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        targets = [self.visit(each) for each in (node.target, node.value) if each is not None]
        return ast.AnnAssign(targets[0], ast.Constant(None), targets[1] if targets[1:] else None, node.simple)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        # Kernels have named tuples and enumerations: their fields count, methods are Python's.
        node.body = [each for each in node.body if not isinstance(each, ast.FunctionDef)]
        return self.generic_visit(node)


PACKAGE = Path(__file__).resolve().parents[1]
HASH = re.compile("[0-9a-f]{16}")


@cache
def source_hash() -> str:
    """Hash of all source files of the package, and of the versions of the compilers."""
    files = sorted(PACKAGE.rglob("*.py"))
    return _hash(part for path in files for part in (str(path.relative_to(PACKAGE)), path.read_bytes()))


@cache
def kernel_hash() -> str:
    """Hash of what the package's kernels are made of, and of the versions of the compilers."""
    return _hash(each for (module, name), tree in kernel_sources(PACKAGE) for each in (module, name, tree))


def _hash(parts: Iterable[str | bytes]) -> str:
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    if numba.config.BOUNDSCHECK:
        digest.update(b" with bounds checked")
    for part in parts:
        digest.update((part.encode() if isinstance(part, str) else part) + b"\0")
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path | None:
    """Folder of the compiled kernels, made on first use; None where nothing can be written.

    ``PANTO_CACHE_DIR`` overrides its place. If that cannot be used, it is in the temporary folder; if another
    user has put something under its name there, it is a new one only for this process.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    own = _own_folder(Path(os.environ.get("PANTO_CACHE_DIR") or Path(home) / "panto_env"))
    if own is not None:
        return own
    process = os.getpid()
    try:
        common = Path(tempfile.gettempdir()) / f"panto_env-{_user()}"
        own = _own_folder(common)
        if own is not None and _private(common):
            return own
        alone = Path(tempfile.mkdtemp(prefix="panto_env-"))
    except OSError:
        return None

    def remove() -> None:
        if os.getpid() == process:  # not at the end of its forked children
            shutil.rmtree(alone, ignore_errors=True)

    atexit.register(remove)
    return alone


def _own_folder(parent: Path) -> Path | None:
    """The folder of these kernels in another one; None where it cannot be made, or is not private."""
    hashes = _private_folder(parent, "hashes")
    return hashes and _private_folder(parent, _kept_hash(hashes / source_hash()))


def _private_folder(parent: Path, name: str) -> Path | None:
    folder = parent / name
    with suppress(OSError):
        parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        return folder if _private(folder) and os.access(folder, os.W_OK) else None
    return None


def _kept_hash(file: Path) -> str:
    """``kernel_hash``, which takes a quarter of a second, from a file of these sources, or written to it."""
    with suppress(OSError, UnicodeDecodeError):
        if HASH.fullmatch(found := file.read_text(encoding="ascii")):
            return found
    with suppress(OSError):
        file.write_text(kernel_hash(), encoding="ascii")
    return kernel_hash()


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _private(folder: Path) -> bool:
    """Whether a folder is not a link, belongs to this user, and cannot be written to by others."""
    if not hasattr(os, "getuid"):
        return True  # on Windows a user's folders are private
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return stat.S_ISDIR(found.st_mode) and found.st_uid == _user() and not found.st_mode & others


def cached(folder: str, made_of: Any, compute: Callable[[], Any]) -> Any:
    """Result of ``compute`` for what it is made of, both plain data; from the disk where it is there already.

    It lies in a folder beside the compiled kernels; without one nothing is cached.
    """
    beside = cache_folder()
    if beside is None:
        return compute()
    key = checksum(made_of)
    file = beside / folder / f"{key}.json"
    with suppress(InputError):  # the file does not exist, or is damaged
        found = read_checked(file)
        if found["made_of"] == key:
            return found["value"]
    value = compute()
    with suppress(InputError, OSError):  # no room: the next process computes it again
        file.parent.mkdir(exist_ok=True)
        write_checked(file, {"made_of": key, "value": value})
    return value
