"""A kernel: what Python calls becomes machine code, with all it calls inside, and nothing else does.

numba optimises, translates and keeps on disk every function that compiled code calls, and optimises it again inside
each of its callers: with helpers of helpers most of the work is done several times.  A `Kernel` that another one calls
is only lowered to LLVM's language.  The one that Python calls is linked with all of them, optimised and translated,
once.  Where Python calls a helper too, that one is compiled for it.
"""

from __future__ import annotations

import gc
import logging
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from numba import _dynfunc, config, types
from numba.core import sigutils
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.environment import lookup_environment
from numba.core.registry import CPUDispatcher

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# Which kernel is compiled; on a terminal `ovines.io.run_log` shows it by this logger's name.
COMPILING = logging.getLogger("ovines.compiling")
ENVIRONMENT = "_ZN08NumbaEnv"  # how numba's names of a function's environment begin

# What is taken over below without numba's promise; a numba without it compiles in its own way.
INTERNALS = (
    "_optimize_functions",
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
    "_get_module_for_linking",
)
SUPPORTED = all(hasattr(JITCodeLibrary, name) for name in INTERNALS)


_OBJECTS_BETWEEN_COLLECTIONS = 200_000
# How far LLVM optimises a function that is lowered, and the whole that is linked of them.  At 3 and 3, numba's own,
# compiling takes a tenth longer, for the same numbers at the same speed; at 0 for a function, the whole loses what is
# gained.
_FUNCTION_LEVEL, _WHOLE_LEVEL = 1, 2


class Guard:
    """Who is asked before a kernel is compiled or loaded; this one lets one process at a time do it, so that what
    several of them need is compiled once.
    """

    @contextmanager
    def alone(self, kernel: Kernel) -> Iterator[None]:
        """Entered while the kernel is loaded or compiled: here another process is waited for."""
        with _locked(kernel):
            yield

    def begins(self, kernel: Kernel) -> None:
        """The kernel is not on the disk: it is compiled now."""
        COMPILING.info("compiling, once per machine and version: %s.%s", kernel.__module__, kernel.__qualname__)


@contextmanager
def _locked(kernel: Kernel) -> Iterator[None]:
    """Held by the process that compiles the kernel; where no file can be locked, each compiles for itself."""
    file = None
    if fcntl is not None and kernel.index is not None:
        with suppress(OSError):
            Path(kernel.index).parent.mkdir(parents=True, exist_ok=True)
            file = open(f"{kernel.index}.lock", "ab")  # noqa: SIM115  # closed below
            fcntl.flock(file, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if file is not None:
            file.close()  # and the lock with it


@contextmanager
def _optimising(level: int) -> Iterator[None]:
    """LLVM optimises so far, or less where NUMBA_OPT asks for less; under numba's lock."""
    usual = config.OPT
    config.OPT = type(usual)(min(level, int(usual)))
    try:
        yield
    finally:
        config.OPT = usual


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]  # numba brings no types
    """Lowered code; what it calls is linked in, and the whole translated, where a pointer to it is asked for."""

    lowered: Any = None  # its own module, once more modules are linked in
    closed = False  # whether they are
    translated = False

    def finalize(self) -> None:
        """Nothing can be added any more; nothing is linked yet."""
        self._raise_if_finalized()
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Address of the machine code; 0 where the library has no such function."""
        self._ensure_finalized()
        if not self.translated:
            self._translate()
        return super().get_pointer_to_function(name)

    def _get_module_for_linking(self) -> Any:
        """With all it calls: a library of numba's own asks for no more."""
        self._ensure_finalized()
        self._close()
        return super()._get_module_for_linking()

    def _finalize_final_module(self) -> None:
        self.closed = self.translated = True  # also where it comes from the disk
        super()._finalize_final_module()

    def _optimize_functions(self, module: Any) -> None:
        with _optimising(_FUNCTION_LEVEL):
            super()._optimize_functions(module)

    def _optimize_final_module(self) -> None:
        with _optimising(_WHOLE_LEVEL):
            super()._optimize_final_module()

    def _translate(self) -> None:
        self._codegen._check_llvm_bugs()
        self._close()
        self._optimize_final_module()
        self._final_module.verify()
        self._dynamic_globals.clear()  # found again, with those of what is linked in
        self._finalize_final_module()
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name) if variable.name.startswith(ENVIRONMENT) else None
            if environment is not None:  # of functions that are translated nowhere else
                self._codegen.set_env(variable.name, environment)

    def _close(self) -> None:
        """Link what it calls, each once, callers first: LLVM takes of a module what is wanted by then."""
        if self.closed:
            return
        order: list[Any] = []
        seen = {self}

        def visit(library: Any) -> None:
            for called in library._linking_libraries:
                if called not in seen:
                    seen.add(called)
                    visit(called)
            order.append(library)

        visit(self)
        self._alone()
        for library in reversed(order[:-1]):
            module = library._alone() if isinstance(library, LinkedLibrary) else library._get_module_for_linking()
            self._final_module.link_in(module, preserve=True)
        self.closed = True

    def _alone(self) -> Any:
        if self.lowered is None:
            self.lowered = super()._get_module_for_linking()
            if not self.closed:
                self._shared_module = None  # made anew when closed
        return self.lowered


class KernelFlags(Flags):  # type: ignore[misc]
    """How a function is compiled.  numba compiles its own functions anew for whoever asks with other flags, and asks
    tens of thousands of times: only what their code depends on counts.
    """

    __slots__ = ()
    decisive = tuple(
        name
        for name in Flags.options
        if name
        not in {
            "release_gil",
            "no_cpython_wrapper",
            "no_cfunc_wrapper",
            "enable_pyobject",
            "enable_looplift",
            "enable_pyobject_looplift",
        }
    )

    def _key(self) -> tuple[Any, ...]:
        given = self._values.get
        return tuple([given(name) for name in self.decisive])

    def __hash__(self) -> int:
        return hash(self.error_model)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KernelFlags) and self._key() == other._key()


def _inside(compiler: Any, flags: Any) -> Any:
    """numba's own functions inside kernels need no entry either."""
    flags = KernelFlags(flags)
    flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    return flags


class KernelCompiler(_FunctionCompiler):  # type: ignore[misc]
    """The outermost kernel gets an entry for Python; those inside are lowered."""

    kernel: Kernel  # what it compiles
    depth = 0  # of kernels being compiled inside one another; changed under numba's lock

    def compile(self, args: Any, return_type: Any) -> Any:
        """numba's result for the types ``args``."""
        if KernelCompiler.depth > 1:
            return super().compile(args, return_type)
        Kernel.guard.begins(self.kernel)
        result = super().compile(args, return_type)
        context = result.target_context
        result.library.get_pointer_to_function(result.fndesc.llvm_func_name)  # translates it
        entry = context.get_executable(result.library, result.fndesc, result.environment)
        context.insert_user_function(entry, result.fndesc, [result.library])
        return result._replace(entry_point=entry)

    def _customize_flags(self, flags: Any) -> Any:
        flags = KernelFlags(flags)
        flags.no_cpython_wrapper = KernelCompiler.depth > 1
        flags.no_cfunc_wrapper = True  # nobody hands a kernel over as a C function
        return flags


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """numba's dispatcher, with its helpers inside (see the module)."""

    guard = Guard()

    def __init__(
        self, py_func: Any, locals: Any = None, targetoptions: Any = None, pipeline_class: Any = Compiler
    ) -> None:
        super().__init__(py_func, locals, targetoptions, pipeline_class)
        self._compiler = KernelCompiler(py_func, self.targetdescr, targetoptions or {}, locals or {}, pipeline_class)
        self._compiler.kernel = self

    @property
    def index(self) -> str | None:
        """File that lists what the disk has of this kernel; None where nothing can be kept."""
        return getattr(getattr(self._cache, "_cache_file", None), "_index_path", None)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """How a kernel calls this one: a constant is an argument like any other and makes no version of its own."""
        plain = {name: types.unliteral(kind) for name, kind in dict(kws).items()}
        return super().get_call_template(tuple(map(types.unliteral, args)), plain)

    def compile(self, sig: Any) -> Any:
        """Compile for the types ``sig`` or load it from the disk; inside another kernel's compilation only lower it."""
        with global_compiler_lock, self._deeper() as outermost:
            asked = tuple(sigutils.normalize_signature(sig)[0])
            known = self.overloads.get(asked)
            # Optimised twice, sums that may be reordered would depend on what was compiled before: inside a kernel
            # stands what was lowered in this process, never what came from the disk.
            if known is not None and not (known.library.translated if outermost else _was_lowered(known)):
                del self.overloads[asked]
            cache: Any = self._cache  # type: ignore[has-type]
            self._cache = cache if outermost else NullCache()
            fetched = outermost and asked not in self.overloads
            try:
                with (
                    Kernel.guard.alone(self) if fetched else nullcontext(),
                    _rare_collections() if fetched else nullcontext(),
                ):
                    return super().compile(sig)
            finally:
                self._cache = cache

    def add_overload(self, cres: Any) -> None:
        """What is only lowered is there for kernels; Python never calls it."""
        if cres.library.translated:
            super().add_overload(cres)
        else:
            self.overloads[tuple(cres.signature.args)] = cres

    @contextmanager
    def _deeper(self) -> Iterator[bool]:
        """Whether this kernel is the outermost; numba's own functions that kernels call are lowered as they are."""
        codegen, context = self.targetctx.codegen(), self.targetctx
        KernelCompiler.depth += 1
        try:
            if KernelCompiler.depth > 1:
                yield False
                return
            translate = context.get_executable

            def executable(library: Any, fndesc: Any, env: Any) -> Any:
                if library.translated:
                    return translate(library, fndesc, env)
                name = fndesc.qualname.split(".")[-1]
                return _dynfunc.make_function(fndesc.lookup_module(), name, "only lowered", 0, env, (library,))

            codegen._library_class, context.get_executable = LinkedLibrary, executable
            usual, _FunctionCompiler._customize_flags = _FunctionCompiler._customize_flags, _inside
            resolved, types.Function.get_call_type = types.Function.get_call_type, _remembered
            try:
                yield True
            finally:
                types.Function.get_call_type = resolved
                _FunctionCompiler._customize_flags = usual
                del codegen._library_class, context.get_executable
        finally:
            KernelCompiler.depth -= 1


_resolve = types.Function.get_call_type


def _remembered(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """What a call of numba's own ``function`` with arguments of these types gives: asked once, where numba tries all
    its templates for each sum and each element of an array anew (a fifth of the time of compiling).
    """
    known = function.__dict__.setdefault("_remembered", {})
    asked = tuple(args), tuple(sorted(kws.items()))
    if asked not in known:
        known[asked] = _resolve(function, context, args, kws)
    return known[asked]


@contextmanager
def _rare_collections() -> Iterator[None]:
    """Nearly all that compiling makes stays: looking for what does not took a tenth of the time."""
    usual = gc.get_threshold()
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


def _was_lowered(result: Any) -> bool:
    return not result.library.translated or result.library.lowered is not None
