"""The numbers of searches, tuning, policies, judging and data sets: stored results depend on them.

No test of minutes would notice a slightly different one. Whoever changes one makes the results anew that
depend on it, and says so here:

python -m tests.baselines.test_constants   # writes constants.txt anew
"""

import ast
import importlib
import pkgutil
from pathlib import Path

import panto_baselines

STORED = Path(__file__).with_name("constants.txt")
NUMBERS = (int, float, range)
PLAIN = (*NUMBERS, str)


def leaves(value):
    """All values in dictionaries and tuples, and in those in them."""
    if isinstance(value, dict):
        value = (*value, *value.values())
    if isinstance(value, tuple | list):
        return [leaf for each in value for leaf in leaves(each)]
    return [value]


def are_numbers(value):
    """Whether a value is made of words and numbers, with one number at least."""
    found = leaves(value)
    return all(isinstance(leaf, PLAIN) for leaf in found) and any(isinstance(leaf, NUMBERS) for leaf in found)


def names(text):
    """Names that a module's own assignments give, from its source."""
    for statement in ast.parse(text).body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            yield from (
                node.id
                for node in ast.walk(statement)
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            )


def constants():
    """One line per module: the constants that it defines itself, as far as they are numbers."""
    told = {}
    for found in pkgutil.walk_packages(panto_baselines.__path__, "panto_baselines."):
        module = importlib.import_module(found.name)
        own = {*names(Path(module.__file__).read_text(encoding="utf-8"))} & {*vars(module)}
        told[found.name] = {
            name: vars(module)[name]
            for name in sorted(own)
            if name.isupper() and are_numbers(vars(module)[name])
        }
    return "".join(f"{name}: {given}\n" for name, given in sorted(told.items()) if given)


def test_constants_are_those_that_are_stored():
    assert constants() == STORED.read_text(encoding="utf-8")


def test_a_constant_is_found_and_an_imported_one_is_its_owner_s():
    lines = dict(line.split(": ", 1) for line in constants().splitlines())
    assert "'HARMONICS': 14" in lines["panto_baselines.oracle.search"]
    assert "'max_iter': 10000" in lines["panto_baselines.oracle.solver"]
    assert "'TRAINING'" not in lines["panto_baselines.tuning.tune"]


if __name__ == "__main__":
    STORED.write_text(constants(), encoding="utf-8")
