"""From a small subset of Python to C99: functions of a description, with its constants and its state.

What is understood: assignments to local numbers and to elements of arrays, if, while, for over range, return,
arithmetic, comparisons, ``and``, ``or``, calls of ``math``, min, max, abs, int, float and of other functions
of the subset. A parameter annotated ``Constants`` is the table of constants, ``State`` the state,
``Readings`` and ``Forces`` arrays of double; others are int, or double. A branch that constants alone decide
is decided here.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

import numpy as np

from panto_env.backend.compile import python_function

INT, SINGLE, DOUBLE, LITERAL, VOID = "int", "float", "double", "literal", "void"
"""Types in C; a literal takes the type of what it meets, as in NumPy."""
RANK = {INT: 0, LITERAL: 1, SINGLE: 2, DOUBLE: 3}
ANNOTATED = {"int": INT, "Whole": INT, "float": DOUBLE, "Number": DOUBLE, "Single": SINGLE, "None": VOID}
ARRAYS = {"Readings": "const double *", "Forces": "double *"}
OPERATORS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.Mod: "%",
    ast.BitAnd: "&", ast.And: "&&", ast.Or: "||", ast.USub: "-", ast.Not: "!",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
MATH = ("tanh", "exp", "expm1", "sqrt", "floor")

Function = Callable[..., Any]
Expression = tuple[str, str]  # C, and its type


class Translation:
    """C of functions and of all that they call, for one table of constants and one state."""

    def __init__(self, constants: Mapping[str, Any], state: Mapping[str, Any], state_type: str) -> None:
        """constants, state: numbers and NumPy arrays by name; state_type: name of the struct in C."""
        self.constants, self.state, self.state_type = constants, state, state_type
        self.functions: dict[str, str] = {}  # C by name, callees before callers
        self.declarations: list[str] = []  # of the functions
        self.used: dict[str, Any] = {}  # constants that are read, with the tables of modules
        self.kept: set[str] = set()  # entries of the state that are used
        self._returns: dict[str, str] = {}

    def add(self, function: Function) -> str:
        """Translate a function, after those that it calls; the type that it returns.

        Raises ValueError, naming function and line, for anything outside the subset.
        """
        function = python_function(function)
        name = function.__name__
        if name not in self._returns:
            self._returns[name] = _Body(self, function).write()
        return self._returns[name]

    def constant_tables(self) -> str:
        """Definitions of the constants that the functions read, whole numbers first."""
        whole = [
            f"    {name} = {int(value)}"
            for name, value in self.used.items()
            if np.ndim(value) == 0 and type_of(value) == INT
        ]
        lines = ["enum {\n" + ",\n".join(whole) + "\n};"] if whole else []
        for name, value in self.used.items():
            kind = type_of(value)
            if np.ndim(value) or kind != INT:
                lines.append(
                    f"static const {kind} {name}{_sizes(value)} = {_initial(np.asarray(value), kind)};"
                )
        return "\n".join(lines)

    def state_fields(self) -> str:
        """Fields of the state's struct, those that the functions use."""
        entries = ((name, np.asarray(value)) for name, value in self.state.items() if name in self.kept)
        return "\n".join(f"    {type_of(value)} {name}{_sizes(value)};" for name, value in entries)


def _initial(array: Any, kind: str) -> str:
    """Initialiser of a number, or of an array with the braces of its dimensions."""
    if array.ndim == 0:
        return literal(array[()], kind)
    if array.ndim > 1:
        return "{" + ",\n".join(_initial(row, kind) for row in array) + "}"
    numbers = textwrap.wrap(", ".join(literal(each, kind) for each in array), 104)
    return "{\n    " + "\n    ".join(numbers) + "}"


def type_of(value: Any) -> str:
    """Type in C of a number or of an array's elements."""
    kind = np.asarray(value).dtype
    if kind.kind in "iub":
        return INT
    return SINGLE if kind == np.float32 else DOUBLE


def literal(value: Any, kind: str) -> str:
    """A number in C, exactly."""
    if kind == INT:
        return str(int(value))
    if not math.isfinite(value):
        huge = "HUGE_VALF" if kind == SINGLE else "HUGE_VAL"  # INFINITY is a float
        return huge if value > 0 else f"-{huge}"
    return f"{np.float32(value)}f" if kind == SINGLE else repr(float(value))


def _sizes(array: Any) -> str:
    return "".join(f"[{size}]" for size in np.shape(array))


class _Body:
    """The translation of one function."""

    def __init__(self, whole: Translation, function: Function) -> None:
        self._whole, self._function, self._scope = whole, function, function.__globals__
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self._tree, self._lines, self._depth = tree, [], 0  # type: ignore[var-annotated]
        self._local: dict[str, str] = {}  # types of numbers in sight
        self._tables: dict[str, str] = {}  # parameters that are not numbers, by name
        self._result: str | None = ANNOTATED.get(ast.unparse(tree.returns)) if tree.returns else None

    def write(self) -> str:
        """Append the C to the whole; the type that the function returns."""
        taken, name, tables = [], self._tree.name, {"State": f"{self._whole.state_type} *"} | ARRAYS
        for each in self._tree.args.args:
            kind = ast.unparse(each.annotation) if each.annotation else "float"
            if kind == "Constants" or kind in tables:
                self._tables[each.arg] = kind
            else:
                self._local[each.arg] = ANNOTATED[kind]
            if kind != "Constants":
                taken.append(f"{tables.get(kind) or f'{ANNOTATED[kind]} '}{each.arg}")
        documented = ast.get_docstring(self._tree)
        self._block(self._tree.body[1:] if documented else self._tree.body)
        kind, body = self._result or VOID, "\n".join(self._lines)
        unused = [each.arg for each in self._tree.args.args if self._tables.get(each.arg) != "Constants"]
        unused = [name for name in unused if not re.search(rf"\b{name}\b", body)]
        self._lines += [f"    (void){name};" for name in unused]
        head = f"static {kind} {name}({', '.join(taken) or 'void'})"
        comment = " ".join((documented or "").partition("\n\n")[0].split())
        above = "".join(f" * {line}\n" for line in textwrap.wrap(comment, 100))
        text = [f"/*\n{above} */" if above else "", head, "{", *self._lines, "}"]
        self._whole.declarations.append(f"{head};")
        self._whole.functions[name] = "\n".join(filter(None, text))
        return kind

    def _refuse(self, node: ast.AST) -> NoReturn:
        raise ValueError(f"{self._tree.name} has what cannot be translated to C: {ast.unparse(node)}")

    def _put(self, line: str) -> None:
        self._lines.append("    " * self._depth + line)

    def _block(self, body: list[ast.stmt], **counters: str) -> None:
        before, self._local = self._local, self._local | counters
        self._depth += 1
        for statement in body:
            self._statement(statement)
        self._depth -= 1
        self._local = before

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=[target], value=value):
                self._assign(target, *self._expression(value))
            case ast.AugAssign(target=target, op=operator, value=value):
                self._assign(target, *self._binary(self._expression(target), operator, value, node))
            case ast.If(test=test, body=body, orelse=otherwise):
                self._if(test, body, otherwise)
            case ast.While(test=test, body=body, orelse=[]):
                self._put(f"while ({self._bare(self._expression(test)[0])}) {{")
                self._block(body)
                self._put("}")
            case ast.For(
                target=ast.Name(id=k), iter=ast.Call(func=ast.Name(id="range"), args=bounds), body=body
            ):
                self._for(k, bounds, body)
            case ast.Return(value=value) if value is not None:
                text, kind = self._expression(value)
                if self._result is None:
                    self._result = DOUBLE if kind == LITERAL else kind
                self._put(f"return {self._bare(text)};")
            case ast.Expr(value=ast.Call() as call):
                self._put(f"{self._expression(call)[0]};")
            case _:
                self._refuse(node)

    def _assign(self, target: ast.expr, text: str, kind: str) -> None:
        text = self._bare(text)
        if not isinstance(target, ast.Name):
            place, own = self._expression(target)
            self._put(f"{place} = {f'({own})({text})' if {own, kind} == {SINGLE, DOUBLE} else text};")
        elif target.id in self._local:
            self._put(f"{target.id} = {text};")
        else:
            own = self._local[target.id] = DOUBLE if kind == LITERAL else kind
            self._put(f"{own} {target.id} = {text};")

    def _if(self, test: ast.expr, body: list[ast.stmt], otherwise: list[ast.stmt]) -> None:
        known = self._known(test)
        if known is not None:  # no block of its own: it stands for the statement
            for statement in body if known else otherwise:
                self._statement(statement)
            return
        self._put(f"if ({self._bare(self._expression(test)[0])}) {{")
        self._block(body)
        if otherwise:
            self._put("} else {")
            self._block(otherwise)
        self._put("}")

    def _known(self, test: ast.expr) -> bool | None:
        """Value of a condition that constants alone decide; None for any other."""
        if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.And):
            parts = [self._known(each) for each in test.values]
            return False if False in parts else None if None in parts else True
        names = {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
        tables = {name for name in names if self._tables.get(name) == "Constants"}
        if not tables or any(isinstance(node, ast.Subscript | ast.Call) for node in ast.walk(test)):
            return None
        if any(name in self._local or name in self._tables for name in names - tables):
            return None
        constants = {name: type("Table", (), dict(self._whole.constants)) for name in tables}
        return bool(eval(ast.unparse(test), dict(self._scope), constants))

    def _for(self, k: str, bounds: list[ast.expr], body: list[ast.stmt]) -> None:
        texts = [self._expression(each)[0] for each in bounds]
        first, end, *step = ["0", *texts] if len(texts) == 1 else texts
        if step and step != ["-1"]:
            self._refuse(bounds[2])
        last, go_on = (f"{k} > {end}", f"{k}--") if step else (f"{k} < {end}", f"{k}++")
        self._put(f"for (int {k} = {self._bare(first)}; {last}; {go_on}) {{")
        self._block(body, **{k: INT})
        self._put("}")

    def _bare(self, text: str) -> str:
        """An expression without brackets around all of it."""
        if not text.startswith("("):
            return text
        depth = 0
        for place, letter in enumerate(text):
            depth += (letter == "(") - (letter == ")")
            if depth == 0:
                return text[1:-1] if place == len(text) - 1 else text
        return text

    def _expression(self, node: ast.expr) -> Expression:
        match node:
            case ast.Constant(value=bool() | str() | None):
                self._refuse(node)
            case ast.Constant(value=value):
                return (str(value), INT) if isinstance(value, int) else (repr(value), LITERAL)
            case ast.Name(id=name) if name in self._local:
                return name, self._local[name]
            case ast.Name(id=name) if name in self._tables:  # passed on to another function
                return name, VOID
            case ast.Name(id=name) if isinstance(self._scope.get(name), int | float):
                value = self._scope[name]
                return (str(value), INT) if isinstance(value, int) else (literal(value, DOUBLE), LITERAL)
            case ast.Attribute(value=ast.Name(id=table), attr=name) if table in self._tables:
                return self._entry(table, name, node)
            case ast.Attribute(value=ast.Name(id="math"), attr="inf"):
                return literal(math.inf, DOUBLE), LITERAL
            case ast.Subscript(value=array, slice=place):
                return self._element(array, place)
            case ast.BinOp(left=left, op=operator, right=right):
                return self._binary(self._expression(left), operator, right, node)
            case ast.UnaryOp(op=operator, operand=operand) if type(operator) in OPERATORS:
                text, kind = self._expression(operand)
                return f"{OPERATORS[type(operator)]}{text}", kind
            case ast.BoolOp(op=operator, values=values):
                texts = [self._expression(each)[0] for each in values]
                return f"({f' {OPERATORS[type(operator)]} '.join(texts)})", INT
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                one, other, _ = self._joined(self._expression(left), self._expression(right))
                return f"({one} {OPERATORS[type(operator)]} {other})", INT
            case ast.Call(func=function, args=arguments, keywords=[]):
                tables = [name for name, kind in self._tables.items() if kind == "Constants"]
                passed = [each for each in arguments if ast.unparse(each) not in tables]
                return self._call(function, [self._expression(each) for each in passed])
        self._refuse(node)

    def _entry(self, table: str, name: str, node: ast.expr) -> Expression:
        """An entry of the constants or of the state."""
        constant = self._tables[table] == "Constants"
        entries = self._whole.constants if constant else self._whole.state
        if name not in entries:
            self._refuse(node)
        if constant:
            self._whole.used[f"c_{name}"] = entries[name]
            return f"c_{name}", type_of(entries[name])
        self._whole.kept.add(name)
        return f"{table}->{name}", type_of(entries[name])

    def _element(self, array: ast.expr, place: ast.expr) -> Expression:
        places = place.elts if isinstance(place, ast.Tuple) else [place]
        indices = "".join(f"[{self._bare(self._expression(each)[0])}]" for each in places)
        if isinstance(array, ast.Name) and self._tables.get(array.id) in ARRAYS:
            return f"{array.id}{indices}", DOUBLE
        if isinstance(array, ast.Name) and isinstance(self._scope.get(array.id), tuple):
            self._whole.used[array.id] = np.array(self._scope[array.id])
            return f"{array.id}{indices}", type_of(self._scope[array.id])
        text, kind = self._expression(array)
        return f"{text}{indices}", kind

    def _joined(self, one: Expression, other: Expression) -> tuple[str, str, str]:
        """Two operands and the type of both: a literal beside a float is one too."""
        kind = max(one[1], other[1], key=RANK.__getitem__)
        texts = [
            f"{text}f" if (own, kind) == (LITERAL, SINGLE) and text[-1].isdigit() else text
            for text, own in (one, other)
        ]
        return texts[0], texts[1], kind

    def _binary(self, left: Expression, operator: ast.operator, right: ast.expr, node: ast.AST) -> Expression:
        if type(operator) not in OPERATORS:
            self._refuse(node)
        one, other, kind = self._joined(left, self._expression(right))
        if isinstance(operator, ast.Div) and kind == INT:
            return f"((double){one} / {other})", DOUBLE
        return f"({one} {OPERATORS[type(operator)]} {other})", kind

    def _call(self, function: ast.expr, given: list[Expression]) -> Expression:
        texts = [self._bare(text) for text, _ in given]
        match function:
            case ast.Attribute(value=ast.Name(id="math"), attr="isfinite"):
                return f"isfinite({texts[0]})", INT
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in MATH:
                single = given[0][1] == SINGLE
                return f"{name}{'f' if single else ''}({texts[0]})", SINGLE if single else DOUBLE
            case ast.Name(id="min" | "max" as name):
                one, other, kind = self._joined(*given)
                if kind == INT:
                    return f"({one} {'<' if name == 'min' else '>'} {other} ? {one} : {other})", INT
                call = f"f{name}{'f' if kind == SINGLE else ''}({self._bare(one)}, {self._bare(other)})"
                return call, DOUBLE if kind == LITERAL else kind
            case ast.Name(id="abs"):
                return f"fabs{'f' if given[0][1] == SINGLE else ''}({texts[0]})", given[0][1]
            case ast.Name(id="int" | "float" as name):
                kind = INT if name == "int" else DOUBLE
                return f"({kind}){given[0][0]}", kind
            case ast.Name(id=name) if callable(self._scope.get(name)):
                return f"{name}({', '.join(texts)})", self._whole.add(self._scope[name])
        self._refuse(function)
