"""Kernels: compiled at their first call, by one process at a time, and cached on disk.

numba takes a second to import and a kernel seconds to compile, so that neither is done before a
kernel is called: commands that only read never do. Of several processes that need the same kernel
one compiles it and the others take it from the cache.

Without a lock numba's cache is not safe: it numbers a file of code by an index that it has read
before, so that of two processes that compile one kernel for different types each may leave the
other's code under its own type. That lock is held while code is read or written, and not while it
is compiled: who takes a kernel from the cache does not wait for who compiles another one.

A kernel is compiled by a process that does nothing else, and then taken from the cache. A process
that compiles a kernel itself holds several versions of the kernels that it calls, each rounded in
its own way, and runs others than a process that takes the code from the cache: the last bits of the
first run would differ from those of later ones.

numba takes a cached kernel for good as long as the file of the kernel is what it was. A kernel is
also made of the kernels that it calls and of the constants that it reads, wherever they come from:
here the files that its own file imports, and those that these import, count as well.
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
import threading
from collections.abc import Callable, Iterator, Mapping
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from types import CodeType, FunctionType
from typing import IO, Any, TypeVar, cast

from ..isolation import python_command

F = TypeVar("F", bound=Callable[..., Any])

IMPORT = re.compile(r"^\s*from (\.+)([\w.]*) import ", re.MULTILINE)
"""An import inside the package; the house rules know no other."""

LOCK = "compiling.lock"
"""The file beside cached kernels that a process holds while it compiles."""

INNER = "-inner"
"""What tells cached kernels for kernels from those for Python."""

_threads = threading.RLock()


class Kernel:
    """A function that is compiled when it is first called.

    Parameters
    ----------
    function
        What to compile.
    options
        Of `numba.njit`.
    names_of
        A module beside the function's own whose names it uses, too. It is imported when the
        function is compiled: what it is for numba to generate needs numba.
    """

    def __init__(
        self, function: Callable[..., object], options: Mapping[str, object], names_of: str = ""
    ) -> None:
        update_wrapper(self, function)
        self._names_of = names_of
        # Division by zero gives what it gives in NumPy: that compiles sooner than an exception.
        self.py_func = function
        self._options = {"error_model": "numpy", **options}
        self._ready: Callable[..., Any] | None = None

    # What nobody calls is not compiled: a third to a half of a small kernel is its wrappers.

    @cached_property
    def compiled(self) -> Any:
        """What numba makes of the function for Python to call."""
        return self._compile("", no_cfunc_wrapper=True)

    @cached_property
    def inner(self) -> Any:
        """What numba makes of the function for other kernels to call, by far the less code."""
        return self._compile(INNER, no_cfunc_wrapper=True, no_cpython_wrapper=True)

    @property
    def signatures(self) -> list[object]:
        """The types of arguments for which it has been compiled; nothing is compiled for this."""
        if "compiled" not in vars(self) or isinstance(self.compiled, FunctionType):
            return []
        return list(self.compiled.overloads)

    @property
    def _numba_type_(self) -> Any:
        """What numba takes this for in kernels that name it as an attribute of its module."""
        return self.compiled._numba_type_

    def _compile(self, suffix: str, **options: bool) -> Any:
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
        compiled = numba.njit(**self._options, **options)(copy)
        file = _cache_file(compiled)
        if file is not None:  # interpreted kernels, NUMBA_DISABLE_JIT=1, have none
            from .kernel_cache import CheckedCacheFile

            source = Path(function.__code__.co_filename)
            compiled._cache._cache_file = CheckedCacheFile(file, stamp(source))
        return compiled

    def __call__(self, *args: object) -> Any:
        """Call the compiled function."""
        if self._ready is not None:
            return self._ready(*args)
        with _threads:
            compiled = self.compiled
            file = _cache_file(compiled)
            if file is not None:
                from .kernel_cache import lock_beside

                types = tuple(map(compiled.typeof_pyval, args))
                if not _is_cached(compiled, types):
                    with lock_beside(file, LOCK):
                        self._compile_apart(compiled, types)
            result = compiled(*args)
            self._ready = compiled
        return result

    def _compile_apart(self, compiled: Any, types: tuple[object, ...]) -> None:
        """See to it that the cache has the function for arguments of these types, if it can be."""
        if not _is_cached(compiled, types):  # by who held the lock before
            with contextlib.suppress(OSError, pickle.PicklingError, AttributeError, TypeError):
                requests, answers = _child(os.getpid())
                place = self.py_func.__module__, self.py_func.__name__
                pickle.dump((sys.path, *place, pickle.dumps(types)), requests)
                requests.flush()
                answers.read(1)


@cache
def _child(parent: int) -> tuple[IO[bytes], IO[bytes]]:
    """Return where a process asks the one that compiles for it, and where that one answers.

    It ends when the process does.
    """
    child = subprocess.Popen(
        python_command(f"from {__name__} import serve; serve()"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    atexit.register(child.__exit__, None, None, None)
    assert child.stdin is not None  # it is a pipe
    assert child.stdout is not None
    return child.stdin, child.stdout


def serve() -> None:
    """Compile kernels into the cache as standard input asks for them, and answer with a byte each.

    What cannot be compiled here is left to who asked.
    """
    while True:
        try:
            sys.path[:], module, name, types = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        gc.disable()  # that takes a tenth of a compilation
        with contextlib.suppress(Exception):
            kernel = vars(importlib.import_module(module))[name]
            kernel.compiled.compile(pickle.loads(types))
        gc.enable()
        sys.stdout.buffer.write(b".")
        sys.stdout.buffer.flush()


def njit(*, names_of: str = "", **options: object) -> Callable[[F], F]:
    """Return a decorator like `numba.njit` that compiles at the first call, see `Kernel`."""

    def decorate(function: F) -> F:
        return cast(F, Kernel(function, options, names_of))

    return decorate


def interpreted(kernel: F) -> F:
    """Return the function that a kernel compiles: where it is called once it is not worth that."""
    return cast(F, kernel.py_func) if isinstance(kernel, Kernel) else kernel


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _cache_file(compiled: Any) -> Any:
    """Return numba's index of cached versions; interpreted and uncached functions have none."""
    return None if isinstance(compiled, FunctionType) else vars(compiled._cache).get("_cache_file")


def _is_cached(compiled: Any, types: tuple[object, ...]) -> bool:
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
    """Return the files that a file imports; of a package from which modules may come, all."""
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
