"""How kernels and their parts are compiled: parts only as far as it takes to put them in the place of calls.

Numba would optimise each function, turn it into machine code and wrap it for Python before it goes into its
caller, and so again at each of the levels that parts are nested in. A part is left as it was lowered instead;
the kernel that it ends in is optimised once, as a whole. The first run in an empty cache then takes two
thirds of the time: for a flexible line 7 to 25 s, by the processor. Half of it Python types and lowers some
two hundred parts, a third LLVM optimises the whole; its own lower levels save less than a tenth and give
slower kernels. Parts that were optimised by themselves would also be fused otherwise: the contact force, in
single precision, would change by some 1e-6.

The source of an operation is selected when a kernel is compiled for a type, so that it is inlined and the
kernel can be cached on disk (with a function passed as an argument it could not).
"""

from __future__ import annotations

import inspect
from collections import namedtuple
from collections.abc import Callable
from enum import IntEnum
from functools import wraps
from types import FunctionType
from typing import Any, TypeVar

import numba
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.extending import intrinsic
from numba.core.typed_passes import NativeLowering
from numba.extending import overload

from .cache import cache_folder
from .kept_kernels import KeptKernels


def _library(state: Any) -> Any:
    """A library of code for the function that is compiled, whose functions are not optimised one by one."""
    library = state.targetctx.codegen().create_library(state.func_id.func_qualname)
    library.enable_object_caching()  # as Numba does with one that it makes itself
    layout = library._codegen._data_layout
    library._optimize_functions = lambda module: setattr(module, "data_layout", layout)
    library.needs = {}  # parts that it calls, and what these need
    return library


def _link(library: Any, other: Any, add: Any) -> None:
    """Link what a part needs into the kernel only, once: else each part would hold copies of all it needs.

    The part comes before what it needs, for LLVM leaves out functions that nothing has asked for yet.
    """
    for each in (other, *getattr(other, "needs", ())):
        if each not in library.needs:
            library.needs[each] = None
            add(each)


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):  # type: ignore[misc]
    """Lowering with one optimisation: Numba's first one is for references to be counted, which kernels have
    none of.
    """

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = library = _library(state)
        add = library.add_linking_library
        library.add_linking_library = lambda other: _link(library, other, add)

        def optimise() -> None:
            made = library._codegen._module_pass_manager()
            passes, *builder = made if isinstance(made, tuple) else (made,)  # before Numba 0.62: no builder
            passes.run(library._final_module, *builder)

        library._optimize_final_module = optimise
        done: bool = super().run_pass(state)
        return done


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):  # type: ignore[misc]
    """Lowering without machine code."""

    _name = "part_lowering"

    def library(self, state: Any) -> Any:
        """A library that is neither optimised nor turned into machine code."""
        library = _library(state)
        library.add_linking_library = lambda other: _link(library, other, type(library)._ensure_finalized)
        library._optimize_final_module = lambda: None
        library._finalize_final_module = lambda: setattr(library, "_finalized", True)
        return library

    def run_pass(self, state: Any) -> bool:
        state.library = library = self.library(state)
        state.flags.no_compile = True
        done: bool = super().run_pass(state)
        lowered = state["cr"]
        key = _NoCode().__sizeof__  # any built-in function will do, that no other part has
        state.targetctx.insert_user_function(key, lowered.fndesc, [library])
        state["cr"] = lowered._replace(cfunc=key)
        return done


@register_pass(mutates_CFG=True, analysis_only=False)
class _CalledLowering(_PartLowering):
    """Lowering of a part that stays a function of its own: LLVM would inline it where it is called once."""

    _name = "called_lowering"

    def library(self, state: Any) -> Any:
        library = super().library(state)
        add = library.add_ir_module

        def add_marked(module: Any) -> None:
            for function in module.functions:
                if not function.is_declaration:
                    function.attributes.add("noinline")
            add(module)

        library.add_ir_module = add_marked
        return library


class _NoCode:
    """What stands for the machine code of a part, which it has not."""


def _compiler(lowering: Any) -> Any:
    """Numba's compiler with another lowering."""

    class Compiler(CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
            passes.passes = [
                (lowering if each is NativeLowering else each, text) for each, text in passes.passes
            ]
            passes.finalize()
            return [passes]

    return Compiler


KERNEL_OPTIONS: dict[str, Any] = {"no_cfunc_wrapper": True, "pipeline_class": _compiler(_KernelLowering)}
PART_OPTIONS: dict[str, Any] = {
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": _compiler(_PartLowering),
}
NOT_INLINED: dict[str, Any] = {"forceinline": False, "pipeline_class": _compiler(_CalledLowering)}
"""What a part that is called has in the place of some of these."""


F = TypeVar("F", bound=Callable[..., Any])
E = TypeVar("E", bound=IntEnum)

JIT = not numba.config.DISABLE_JIT
"""Whether kernels are compiled. With ``NUMBA_DISABLE_JIT=1`` the same source runs as plain Python, some
hundred times slower, for debuggers and for coverage."""

# "contract" lets multiply and add fuse; it leaves the order of operations alone. Kernels allocate
# nothing, so without Numba's run-time they need not count references to the arrays they are given.
OPTIONS: dict[str, Any] = {"fastmath": {"contract"}, "error_model": "numpy", "_nrt": False}
INLINED = OPTIONS | PART_OPTIONS
"""Options of functions that kernels call: a call would cost as much as most of these functions take."""


def kernel(function: F) -> F:
    """Compile ``function`` with Numba on its first call; keep the result on disk.

    A kernel runs without Python's lock, so that threads can share the lanes of a batch.
    """
    previous, folder = numba.config.CACHE_DIR, cache_folder()
    numba.config.CACHE_DIR = str(folder or "")  # read by Numba's cache when it is made
    try:
        compiled: Any = numba.njit(nogil=True, **KERNEL_OPTIONS, **OPTIONS)(function)
        if JIT and folder is not None:
            compiled._cache = KeptKernels(function)
    finally:
        numba.config.CACHE_DIR = previous
    return compiled  # type: ignore[no-any-return]


def inlined(function: F) -> F:
    """Compile a function that kernels call, and inline it at each call."""
    return _part(function, INLINED)


def called(function: F) -> F:
    """Compile a function that kernels call, as a function of its own.

    For large parts that most runs do not reach: a call costs them nothing, and the kernel, which is optimised
    as a whole, takes a quarter less time to compile.
    """
    return _part(function, INLINED | NOT_INLINED)


def _part(function: F, options: dict[str, Any]) -> F:
    """A part of kernels, which cannot be called from Python: it has no machine code."""
    part: Any = numba.njit(**options)(function)

    def refuse(*_: Any, **__: Any) -> None:
        name = function.__name__
        raise TypeError(f"{name} is a part of kernels: call it in one, or python_function({name})")

    if JIT:
        # Numba looks for the machine code among what it has inserted, and where there is none it compiles.
        part._insert = lambda *_: None
        part._compile_for_args = refuse
    return part  # type: ignore[no-any-return]


def in_python(plain: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Decorator of the compiled form of a function, an intrinsic of Numba; ``plain``: its Python form."""
    return lambda compiled: intrinsic(compiled) if JIT else plain


def python_function(compiled: Callable[..., Any]) -> Callable[..., Any]:
    """The Python function behind a compiled one, for a call from Python with arrays or numbers."""
    source: Callable[..., Any] = getattr(compiled, "py_func", compiled)
    return source


def constants(names: type[E]) -> type[E]:
    """The members of an enum as plain integers under the same names, for use in kernels.

    Numba before 0.68, and its GPU compiler even now, refuse a member of an enum as an index of an array.
    """
    numbers: Any = namedtuple("numbers", [member.name for member in names])  # type: ignore[misc]
    members: Any = numbers(*(int(member) for member in names))
    return members  # type: ignore[no-any-return]


def operation(declaration: F) -> F:
    """An operation that each type of its first argument, a class of named tuples, can implement.

    ``declaration`` has the arguments and the docstring; its body is the default for types without a source
    of their own. ``implements`` adds the source of a type.
    """
    sources: dict[type, Callable[..., Any]] = {}
    # Numba requires that the signatures of all sources are the same, without types.
    default = FunctionType(declaration.__code__, declaration.__globals__, declaration.__name__)

    @wraps(declaration)
    def chosen(*arguments: Any) -> Any:
        return sources.get(type(arguments[0]), default)(*arguments)

    chosen.sources = sources  # type: ignore[attr-defined]
    if JIT:

        def choose(*types: Any) -> Any:
            return sources.get(getattr(types[0], "instance_class", None), default)  # type: ignore[arg-type]

        choose.__signature__ = inspect.signature(default)  # type: ignore[attr-defined]
        overload(chosen, jit_options=INLINED)(choose)
    return chosen  # type: ignore[return-value]


def implements(of: Callable[..., Any], kind: type) -> Callable[[F], F]:
    """Decorator of the source of operation ``of`` for named tuples of class ``kind``.

    Raises TypeError where the arguments are not those of the operation.
    """

    def register(source: F) -> F:
        required, given = (list(inspect.signature(each).parameters) for each in (of, source))
        if required != given:
            raise TypeError(f"{of.__name__} takes {', '.join(required)}, but its source {', '.join(given)}.")
        of.sources[kind] = source  # type: ignore[attr-defined]
        return source

    return register
