"""Compiled kernels: compiled on first call, by one process at a time, and cached on disk.

Importing numba takes a second and compiling a kernel takes seconds. Both happen only when a kernel
is called, so that commands that only read results stay fast. If several processes need the same
kernel, one compiles it and the others load it from the cache.

The cache needs a lock. numba names a file of code by an index that it has read earlier, so that two
processes that compile one kernel for different types may store their code under each other's types.
The lock is held while code is read or written, but not during compilation.

A separate process compiles kernels, and the calling process loads them from the cache. A process
that compiled kernels itself would hold several versions of inner kernels with different rounding,
so that the first run would differ from later runs in the last bits. Kernels that take long to
compile and are likely to be called are compiled ahead, each by its own process, on another core.

numba considers a cached kernel valid if the kernel's own file has not changed. Kernels also depend
on inner kernels and constants of other modules, so that here all imported files count as well.
"""

import atexit
import contextlib
import gc
import hashlib
import importlib
import os
import pickle
import re
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from stat import S_IMODE
from time import perf_counter
from types import CodeType, FunctionType
from typing import IO, Any, TypeAlias, TypeVar, cast

from ..isolation import python_command

Function: TypeAlias = Callable[..., Any]
Dispatcher: TypeAlias = Any
"""Numba's compiled function or its cache index, which numba does not annotate."""
F = TypeVar("F", bound=Function)

IMPORT = re.compile(r"^\s*from (\.+)([\w.]*) import ", re.MULTILINE)
"""Relative import, the only kind of import within the package."""

LOCK = "compiling.lock"
"""End of the names of lock files in the cache folder: a process holds one while it compiles."""

CANNOT_ASK = OSError, pickle.PicklingError, AttributeError, TypeError
"""Errors after which this process compiles a kernel itself."""

INNER = "-inner"
"""Suffix of the names of cached kernels that only kernels call."""

_threads = threading.RLock()
_preparation = {"seconds": 0.0}
"""Time that this process has spent on compiling and loading kernels [s]."""


def working_seconds() -> float:
    """Return a clock [s] that stops while kernels are compiled or loaded.

    Otherwise the first trial of a process would seem to take longer than the others.
    """
    return perf_counter() - _preparation["seconds"]


class Kernel:
    """A function that is compiled when it is first called.

    Parameters
    ----------
    function
        Function to compile.
    options
        Options of `numba.njit`.
    names_of
        Module of the same package with further global names of the function. It is imported at
        compilation, because generating its functions requires numba.
    """

    def __init__(
        self, function: Callable[..., object], options: Mapping[str, object], names_of: str = ""
    ) -> None:
        update_wrapper(self, function)
        self._names_of = names_of
        # Division by zero follows NumPy, which compiles faster than an exception.
        self.py_func = function
        self._options = {"error_model": "numpy", **options}
        self._ready: Function | None = None
        self._is_asked = False
        self._ahead: subprocess.Popen[bytes] | None = None

    # Unused wrappers are not compiled; they take up to half of the time for a small kernel.

    @cached_property
    def compiled(self) -> Dispatcher:
        """Compiled function with a wrapper for Python."""
        return self._compile("", no_cfunc_wrapper=True)

    @cached_property
    def inner(self) -> Dispatcher:
        """Compiled function without wrappers, for calls by other kernels."""
        return self._compile(INNER, no_cfunc_wrapper=True, no_cpython_wrapper=True)

    @property
    def signatures(self) -> list[object]:
        """Argument types for which the kernel has been compiled so far."""
        if "compiled" not in vars(self) or isinstance(self.compiled, FunctionType):
            return []
        return list(self.compiled.overloads)

    @property
    def _numba_type_(self) -> object:
        """Numba type, for kernels that call this kernel as an attribute of its module."""
        return self.compiled._numba_type_

    def _compile(self, suffix: str, **options: bool) -> Dispatcher:
        import numba

        function = self.py_func
        kernels = {
            name: thing.inner
            for name in set(_names(function.__code__))
            if isinstance(thing := function.__globals__.get(name), Kernel)
        }
        generated: Mapping[str, object] = {}
        if self._names_of:
            package = function.__module__.rpartition(".")[0]
            generated = vars(importlib.import_module(f"{package}.{self._names_of}"))
        copy = FunctionType(
            function.__code__,
            {**generated, **function.__globals__, **kernels},
            function.__name__,
            function.__defaults__,
            function.__closure__,
        )
        copy.__module__ = function.__module__
        copy.__qualname__ = function.__qualname__ + suffix
        compile_lazily = numba.njit(**self._options, **options)
        try:
            compiled = compile_lazily(copy)
        except RuntimeError:  # neither the folder of the package nor that of the user is writable
            numba.config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"] = _temporary_folder()
            compiled = compile_lazily(copy)
        file = _cache_file(compiled)
        if file is not None:  # interpreted kernels, NUMBA_DISABLE_JIT=1, have none
            from .kernel_cache import CheckedCacheFile

            source = Path(function.__code__.co_filename)
            compiled._cache._cache_file = CheckedCacheFile(file, stamp(source))
        return compiled

    def __call__(self, *args: object) -> Any:
        """Call the compiled function."""
        if self._ready is None:
            with _threads:
                begin = perf_counter()
                self._ready = self._prepared(args)
                _preparation["seconds"] += perf_counter() - begin
        return self._ready(*args)

    def ahead(self, *args: object) -> None:
        """Begin to compile for the types of some arguments, unless the cache has such a version.

        A later call waits for this.
        """
        if self._is_asked or os.cpu_count() == 1:
            return
        self._is_asked = True
        if _cache_file(self.compiled) is None:
            return
        types = tuple(map(self.compiled.typeof_pyval, args))
        if not _is_cached(self.compiled, types):
            with contextlib.suppress(*CANNOT_ASK):
                child = _start_child()
                self._ahead = child
                self._ask(child, types)
                _pipe(child.stdin).close()

    def _prepared(self, args: tuple[object, ...]) -> Function:
        """Return the function, compiled or loaded for the types of some arguments."""
        compiled = self.compiled
        file = _cache_file(compiled)
        if file is None:
            return cast(Function, compiled)
        if self._ahead is not None:
            self._ahead.wait()
        types = tuple(map(compiled.typeof_pyval, args))
        if not _is_cached(compiled, types):
            with contextlib.suppress(*CANNOT_ASK):
                child = _child(os.getpid())
                self._ask(child, types)
                _pipe(child.stdout).read(1)
        compiled.compile(types)
        return cast(Function, compiled)

    def _ask(self, child: subprocess.Popen[bytes], types: tuple[object, ...]) -> None:
        """Ask a child process to compile the function for some types."""
        place = self.py_func.__module__, self.py_func.__name__
        requests = _pipe(child.stdin)
        pickle.dump((sys.path, *place, pickle.dumps(types)), requests)
        requests.flush()

    def compile_once(self, types: tuple[object, ...]) -> None:
        """Compile the function for some types, or wait while another process does so."""
        from .kernel_cache import lock_beside

        with lock_beside(_cache_file(self.compiled), f"{self.py_func.__name__}-{LOCK}"):
            if not _is_cached(self.compiled, types):
                self.compiled.compile(types)


def _temporary_folder() -> str:
    """Return a folder for temporary kernels, to which only this user can write.

    All processes of the user share it, because each of them would compile for a minute.
    """
    folder = Path(tempfile.gettempdir(), f"nested-agents-{os.getuid()}")
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    status = folder.lstat()
    is_own = status.st_uid == os.getuid() and S_IMODE(status.st_mode) == 0o700
    return str(folder) if is_own else tempfile.mkdtemp(prefix=f"{folder.name}-")


@cache
def _child(parent: int) -> subprocess.Popen[bytes]:
    """Return the process that compiles kernels when they are first called."""
    return _start_child()


def _pipe(stream: IO[bytes] | None) -> IO[bytes]:
    """Return the standard input or output of a child process."""
    assert stream is not None
    return stream


def _start_child() -> subprocess.Popen[bytes]:
    """Start a process that compiles what its standard input requests, and ends with this one."""
    child = subprocess.Popen(
        python_command(f"from {__name__} import serve; serve()"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    atexit.register(child.kill)
    return child


def serve() -> None:
    """Compile the kernels that standard input requests, and answer each request with one byte.

    Errors are ignored: the requesting process then compiles the kernel itself.
    """
    while True:
        try:
            sys.path[:], module, name, types = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        gc.disable()  # collecting garbage takes a tenth of the time
        with contextlib.suppress(Exception):
            kernel = vars(importlib.import_module(module))[name]
            kernel.compile_once(pickle.loads(types))
        gc.enable()
        sys.stdout.buffer.write(b".")
        sys.stdout.buffer.flush()


def njit(*, names_of: str = "", **options: object) -> Callable[[F], F]:
    """Return a decorator like `numba.njit` that compiles on first call, see `Kernel`."""

    def decorate(function: F) -> F:
        return cast(F, Kernel(function, options, names_of))

    return decorate


def compile_ahead(kernel: Function, *args: object) -> None:
    """Begin to compile a kernel for the types of some arguments, see `Kernel.ahead`."""
    if isinstance(kernel, Kernel):
        kernel.ahead(*args)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _cache_file(compiled: Dispatcher) -> Dispatcher:
    """Return numba's cache index, or None for interpreted and uncached functions."""
    return None if isinstance(compiled, FunctionType) else vars(compiled._cache).get("_cache_file")


def _is_cached(compiled: Dispatcher, types: tuple[object, ...]) -> bool:
    """Return whether the cache has an undamaged function for arguments of these types."""
    key = compiled._cache._index_key(types, compiled.targetctx.codegen())
    return bool(compiled._cache._cache_file.is_sound(key))


def stamp(path: Path) -> str:
    """Return a digest of a file and of all files that it imports, directly or not."""
    paths = {path}
    left = [path]
    while left:
        new = _imported(left.pop()) - paths
        paths |= new
        left += new
    texts = "".join(_text(each) + "\0" for each in sorted(paths))
    return hashlib.sha256(texts.encode()).hexdigest()


@cache
def _imported(path: Path) -> set[Path]:
    """Return the files that a file imports; for a package, all of its modules."""
    files: set[Path] = set()
    for dots, name in IMPORT.findall(_text(path)):
        place = path.parents[len(dots) - 1].joinpath(*filter(None, name.split(".")))
        if place.is_dir():
            files.update(place.glob("*.py"))
        elif (module := place.with_suffix(".py")).exists():
            files.add(module)
    return files


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
