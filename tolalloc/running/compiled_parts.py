"""Functions that cost machine code only where Python calls them: what compiled functions call becomes a part of those.

numba makes a library of every compiled function: it builds in copies of all that the function calls, optimises the
whole and emits machine code, although Python calls few of them. Here a function is compiled as one of two things, or as
both. As a part it is only lowered, for its callers to build in. As a whole, when Python calls it, all its parts are
optimised at once and machine code is emitted. A whole knows nothing of this; it is numba's own, and finds parts where
numba finds libraries.

All stands on names that numba does not promise to keep; `tolalloc.running.compiled` falls back on numba's own way
without them.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

from llvmlite.binding import parse_bitcode
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, compile_result
from numba.core.compiler_machinery import register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering


class _PartLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Code of a function and of all that it calls, to be built into callers' libraries."""

    def _optimize_final_module(self) -> None:
        """Leave it to the whole."""

    def _finalize_final_module(self) -> None:
        """Emit no machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True

    @classmethod
    def read(cls, codegen: Any, name: str, code: bytes) -> _PartLibrary:
        """Return a library from what is kept of it."""
        self = cls(codegen, name)
        self._final_module = parse_bitcode(code)
        self._finalize_final_module()
        return self


@register_pass(mutates_CFG=True, analysis_only=False)
class _LowerPart(NativeLowering):  # type: ignore[misc]
    """Lower a function into a library for its callers; the library stands where numba has a function to call."""

    _name = "tolalloc_lower_part"

    def run_pass(self, state: Any) -> bool:
        library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library, state.flags.no_compile = library, True
        super().run_pass(state)
        library.finalize()
        lowered = state.cr._replace(cfunc=library)
        state.targetctx.insert_user_function(library, lowered.fndesc, [library])
        state.cr = lowered
        return True


class _PartCompiler(Compiler):  # type: ignore[misc]
    """numba's own steps but for the lowering."""

    def define_pipelines(self) -> list[Any]:
        pipelines: list[Any] = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [(_LowerPart if step is NativeLowering else step, why) for step, why in pipeline.passes]
        return pipelines


class _Cache(FunctionCache):  # type: ignore[misc]
    """Files of what is compiled; what cannot be read, such as a file that was cut, is compiled again."""

    def load_overload(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # a damaged file raises what it likes
            self.flush()
            return None


class _KeptPart(CompileResultCacheImpl):  # type: ignore[misc]
    """How a part is written into a file and read from it."""

    def reduce(self, part: Any) -> Any:
        part.fndesc.typemap = part.fndesc.calltypes = None  # as numba does: large, and of no use to callers
        code = part.library._get_module_for_linking().as_bitcode()
        return part.library.name, code, part.fndesc, part.environment, part.signature

    def rebuild(self, context: Any, kept: Any) -> Any:
        name, code, description, environment, signature = kept
        library = _PartLibrary.read(context.codegen(), name, code)
        return compile_result(
            typing_context=context.typing_context,
            target_context=context,
            library=library,
            entry_point=library,
            fndesc=description,
            environment=environment,
            signature=signature,
            objectmode=False,
            lifted=(),
        )


class _PartCache(_Cache):
    _impl_class = _KeptPart


class _PartDispatcher(CPUDispatcher):  # type: ignore[misc]
    """A function as compiled functions call it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        options = options | {"nopython": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        super().__init__(function, targetoptions=options, pipeline_class=_PartCompiler)

    def enable_caching(self) -> None:
        self._cache = _PartCache(self.py_func)

    def add_overload(self, part: Any) -> None:
        self.overloads[tuple(part.signature.args)] = part  # and nothing for Python to call


class Whole(CPUDispatcher):  # type: ignore[misc]
    """A function as Python calls it; compiled functions get the part instead."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], before: Callable[[str], None]) -> None:
        super().__init__(function, targetoptions=options | {"nopython": True, "no_cfunc_wrapper": True})
        self.before = before  # is told the module of what is compiled next
        self.part = _PartDispatcher(function, options)

    def enable_caching(self) -> None:
        """Keep what is compiled."""
        self._cache = _Cache(self.py_func)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the type of a call from a compiled function."""
        return self.part.get_call_template(args, kws)

    def compile(self, signature: Any) -> Any:
        """Compile, or read what is kept, without looking for garbage, which takes a fifteenth of the time."""
        self.before(self.py_func.__module__)
        collected = gc.isenabled()
        gc.disable()
        try:
            return super().compile(signature)
        finally:
            if collected:
                gc.enable()

    def get_overload(self, signature: Any) -> Any:
        """Return what such a call is built from."""
        return self.part.get_overload(signature)
