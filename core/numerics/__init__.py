"""Numerical basis: arrays, random numbers, compiled kernels and deferred imports."""

from .arrays import (
    SAME,
    AnyArray,
    BoolArray,
    FloatArray,
    IntArray,
    greatest,
    quadrature,
    wrap,
    wrap_one,
)
from .compiler import INNER, LOCK, Kernel, compile_ahead, njit, serve, stamp, working_seconds
from .libraries import Deferred, nx, optimize, pd, special, stats
from .random import set_words, stream_of, words_of

__all__ = [
    "INNER",
    "LOCK",
    "SAME",
    "AnyArray",
    "BoolArray",
    "Deferred",
    "FloatArray",
    "IntArray",
    "Kernel",
    "compile_ahead",
    "greatest",
    "njit",
    "nx",
    "optimize",
    "pd",
    "quadrature",
    "serve",
    "set_words",
    "special",
    "stamp",
    "stats",
    "stream_of",
    "words_of",
    "working_seconds",
    "wrap",
    "wrap_one",
]
