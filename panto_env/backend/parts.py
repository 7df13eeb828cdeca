"""How kernels and their parts are compiled: parts only as far as it takes to put them in the place of calls.

Numba would optimise each function, turn it into machine code and wrap it for Python before it goes into its
caller, and so again at each of the levels that parts are nested in. A part is left as it was lowered instead;
the kernel that it ends in is optimised once, as a whole. The first run in an empty cache then takes two
thirds of the time: for a flexible line 7 to 25 s, by the processor. Half of it Python types and lowers some
two hundred parts, a third LLVM optimises the whole; its own lower levels save less than a tenth and give
slower kernels. Parts that were optimised by themselves would also be fused otherwise: the contact force, in
single precision, would change by some 1e-6.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


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


def refuse_calls(part: Any) -> None:
    """Let a part not be called from Python: it has no machine code."""

    def refuse(*_: Any, **__: Any) -> None:
        name = part.py_func.__name__
        raise TypeError(f"{name} is a part of kernels: call it in one, or python_function({name})")

    # Numba looks for the machine code among what it has inserted, and where there is none it compiles.
    part._insert = lambda *_: None
    part._compile_for_args = refuse


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
