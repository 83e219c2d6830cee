"""Streams of random numbers that follow from one seed and are independent of each other."""

import numpy as np


def stream_of(seed: int | np.random.SeedSequence, key: int) -> np.random.Generator:
    """Return the stream of a seed that has a key, whatever else is drawn from that seed.

    Examples
    --------
    >>> one, same, other = (stream_of(7, key) for key in (0, 0, 1))
    >>> float(one.random()) == float(same.random()) != float(other.random())
    True
    """
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    child = np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, key))
    return np.random.default_rng(child)
