"""What compiled kernels are kept by: all that they are made of, and nothing else."""

import importlib
import inspect
import pkgutil
import shutil
from enum import Enum
from types import CodeType, ModuleType

import numba.extending
import pytest

import panto_env
from panto_env import backend
from panto_env.backend import JIT, compile
from panto_env.backend.cache import DECORATORS, PACKAGE, kernel_sources
from panto_env.control import entries


@pytest.fixture(scope="module")
def sources():
    return dict(kernel_sources(PACKAGE))


def modules():
    """All modules that can be imported here."""
    for found in pkgutil.walk_packages(panto_env.__path__, "panto_env."):
        try:
            yield importlib.import_module(found.name)
        except ImportError:  # of an extra that is not installed
            continue


def names_in(code):
    """Names that a function and those within it may look up in its module."""
    yield from code.co_names
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from names_in(inner)


def function_of(value):
    """The Python function of what Numba compiles; None for anything else."""
    function = getattr(value, "py_func", None) or getattr(value, "_defn", None)
    return function if function is not None and hasattr(function, "__code__") else None


@pytest.mark.longer
@pytest.mark.skipif(not JIT, reason="nothing is compiled")
def test_all_that_kernels_name_counts(sources):
    """From each compiled function on, by what its name means in the running program."""
    waiting = [value for module in modules() for value in vars(module).values() if function_of(value)]
    waiting += [
        source for module in modules() for value in vars(module).values() for source in sources_of(value)
    ]
    assert len(waiting) > 150
    seen = set()
    while waiting:
        value = waiting.pop()
        function = function_of(value) or value
        if id(function) in seen or not (function.__module__ or "").startswith("panto_env"):
            continue
        seen.add(id(function))
        assert (function.__module__, function.__name__) in sources, function
        for name in names_in(function.__code__):
            used = function.__globals__.get(name)
            if used is None or isinstance(used, ModuleType | type):
                continue
            if function_of(used) or sources_of(used):
                waiting += [used, *sources_of(used)]
            elif isinstance(used, int | float | str | tuple | Enum) and not callable(used):
                assert sources.get((function.__module__, name)) or defined_elsewhere(function, name, sources)
    assert len(seen) > 150


def sources_of(value):
    """The functions of an operation."""
    return list(value.sources.values()) if isinstance(getattr(value, "sources", None), dict) else []


def defined_elsewhere(function, name, sources):
    """Whether a name that a module imports is among the sources of another one."""
    value = function.__globals__[name]
    return any(
        own == name and getattr(importlib.import_module(module), own, None) is value
        for module, own in sources
    )


CHANGES = {
    "a docstring": ("plant/pantograph/step.py", '"""Mean contact', '"""Of course: mean contact', False),
    "a comment": ("plant/step.py", "\n\n\n", "\n\n\n# of course\n", False),
    "a message": ("control/settings.py", "InputError(", 'InputError("Of course: " + ', False),
    "a file that no kernel names": ("control/settings.py", "class ", "OF_COURSE = 1\n\n\nclass ", False),
    "an operation": ("plant/pantograph/step.py", " * ", " / ", True),
    "an entry of observations": (
        "control/entries.py",
        "return now[NOW.SPEED]",
        "return 2 * now[NOW.SPEED]",
        True,
    ),
    "a number": ("plant/state.py", "HEIGHT = 3.0", "HEIGHT = 4.0", True),
    "an option of the compiler": ("backend/compile.py", '"error_model": "numpy"', '"error_model": "x"', True),
    "a field of a table": (
        "plant/catenary/three_span.py",
        "(NamedTuple):",
        "(NamedTuple):\n    x: int",
        True,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_only_what_kernels_are_made_of_counts(change, sources, tmp_path):
    file, before, after, counts = CHANGES[change]
    copy = tmp_path / "panto_env"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("*.toml", "__pycache__"))
    text = (copy / file).read_text(encoding="utf-8")
    assert before in text
    (copy / file).write_text(text.replace(before, after), encoding="utf-8")
    assert (dict(kernel_sources(copy)) != sources) is counts


def text_of(value):
    return inspect.getsource(value) if inspect.isfunction(value) else ""


def test_decorators_are_those_of_the_backend():
    """A new one is added to the list, or its functions would not count."""
    homes = backend, compile, numba.extending, entries
    given = [getattr(each, name, None) for name in DECORATORS for each in homes]
    assert sum(map(callable, given)) >= len(DECORATORS)
    made = {name for name, value in vars(compile).items() if callable(value) and "njit(" in text_of(value)}
    assert made == {"kernel", "_part"}
