"""Random streams that follow from a seed and a key, and states of generators as arrays."""

import numpy as np

from .arrays import FloatArray, IntArray


def stream_of(seed: int | np.random.SeedSequence, *keys: int) -> np.random.Generator:
    """Return the random stream of some keys, independent of other streams of the seed.

    Examples
    --------
    >>> one, same, other = (stream_of(7, key) for key in (0, 0, 1))
    >>> float(one.random()) == float(same.random()) != float(other.random())
    True
    """
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    child = np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, *keys))
    return np.random.default_rng(child)


def words_of(rng: np.random.Generator) -> IntArray:
    """Return the state of a PCG64 generator as six integers, see `set_words`."""
    state = rng.bit_generator.state
    numbers = state["state"]["state"], state["state"]["inc"]
    words = [number >> shift & (2**64 - 1) for number in numbers for shift in (64, 0)]
    return np.array([*words, state["has_uint32"], state["uinteger"]], dtype=np.uint64)


def set_words(rng: np.random.Generator, words: IntArray | FloatArray) -> None:
    """Set the state of a generator to the result of `words_of`."""
    high, low, high_step, low_step, has_half, half = map(int, words)
    rng.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": high << 64 | low, "inc": high_step << 64 | low_step},
        "has_uint32": has_half,
        "uinteger": half,
    }
