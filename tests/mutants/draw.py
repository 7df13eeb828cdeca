"""Mutants drawn by seed: Cosmic Ray's operators, one mutant per place in the source."""

from __future__ import annotations

import ast
import difflib
import random
import re
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ARITHMETIC, BITS = {"Add", "Sub", "Mul", "Div", "FloorDiv", "Mod", "Pow"}, {"BitOr", "BitAnd"}
ORDER, IDENTITY = {"Eq", "NotEq", "Lt", "LtE", "Gt", "GtE"}, {"Is", "IsNot"}
SPARED = re.compile(
    r"@(cache|lru_cache|cached_property|dataclass|kernel|inlined|override|overload)\b|strict=True"
)
"""Lines with decorators that change nothing that is computed, or with what only a bug would break."""


class Mutant(NamedTuple):
    """One change of a source file."""

    path: Path
    line: int
    lines: range  # that run where it does
    operator: str
    before: str  # the whole file
    after: str

    def diff(self, root: Path) -> str:
        """File, line and operator, and the lines that differ."""
        changed = difflib.unified_diff(self.before.splitlines(), self.after.splitlines(), lineterm="", n=0)
        lines = [line for line in changed if not line.startswith(("---", "+++", "@@"))]
        return "\n    ".join([f"{self.path.relative_to(root)}:{self.line} {self.operator}", *lines])


def _sensible(name: str) -> bool:
    """Whether an operator's mutants are worth a run: not those that end with a TypeError at once."""
    kind, *names = name.split("/")[1].split("_")
    if kind == "ReplaceBinaryOperator":
        return set(names) <= ARITHMETIC or set(names) <= BITS
    if kind == "ReplaceComparisonOperator":
        return set(names) <= ORDER or set(names) <= IDENTITY
    return kind not in ("VariableInserter", "VariableReplacer")  # these need names of variables


OPERATORS = {name: get_operator(name)() for name in operator_names() if _sensible(name)}


def draw(paths: list[Path], count: int, seed: int) -> list[Mutant]:
    """Mutants of these files, each file as likely as it is long, each place in it as likely as another."""
    rng, drawn = random.Random(seed), {}
    sizes = [path.stat().st_size for path in paths]
    for _ in range(10 * count):
        if len(drawn) == count:
            break
        path = rng.choices(paths, sizes)[0]
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        places = _places(source, tree)
        if places:
            place = rng.choice(sorted(places))
            name, occurrence = rng.choice(places[place])
            try:
                after = mutate_code(source, OPERATORS[name], occurrence)
            except AttributeError:  # Cosmic Ray cannot replace an exception with a dotted name
                continue
            mutant = Mutant(path, place[0], _statement(tree, place[0]), name.split("/")[1], source, after)
            if _is_python(after):
                drawn.setdefault((path, place), mutant)
    return list(drawn.values())


def _places(source: str, tree: ast.Module) -> dict[tuple[int, int], list[tuple[str, int]]]:
    """Operators, and which of their occurrences, by line and column; without what has no behaviour."""
    words, found, nodes = _without_behaviour(tree), {}, list(ast_nodes(get_ast(source)))
    for name, operator in OPERATORS.items():
        positions = (pair for node in nodes for pair in operator.mutation_positions(node))
        for occurrence, (start, _) in enumerate(positions):
            line = source.splitlines()[start[0] - 1]
            if not any(first <= start < last for first, last in words) and not SPARED.search(line):
                found.setdefault(start, []).append((name, occurrence))
    return found


def _without_behaviour(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """From where to where annotations, errors' texts and what is said to a type checker stand."""
    nodes: list[ast.AST | None] = []
    for node in ast.walk(tree):
        nodes += [getattr(node, "annotation", None), getattr(node, "returns", None)]
        ranges = isinstance(node, ast.Subscript) and getattr(node.value, "id", "") == "Annotated"
        nodes += [node] if ranges or isinstance(node, ast.Raise | ast.Assert) else []
    return [
        ((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0))
        for node in nodes
        if node is not None
    ]


def _is_python(source: str) -> bool:
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


def _statement(tree: ast.Module, line: int) -> range:
    """Lines of the smallest statement about a line, without the body of a compound one.

    All lines of the file where it runs on import: which test comes first then says nothing.
    """
    around = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    functions = [node for node in around if isinstance(node, ast.FunctionDef)]
    if not any(node.body[0].lineno <= line <= (node.end_lineno or 0) for node in functions):
        return range(1, 1 + max((node.end_lineno or 0 for node in around), default=0))
    smallest = range(line, line + 1)
    for node in sorted(around, key=lambda node: (node.lineno, -(node.end_lineno or 0))):
        body = getattr(node, "body", None)
        last = body[0].lineno if body else (node.end_lineno or 0) + 1
        if node.lineno <= line < max(last, node.lineno + 1):
            smallest = range(node.lineno, max(last, node.lineno + 1))
    return smallest
