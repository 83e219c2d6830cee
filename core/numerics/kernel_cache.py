"""Numba's cache of compiled kernels, with a checksum in each file.

A damaged file counts as missing, so that its kernel is compiled again. Numba itself would end in a
traceback on a truncated file, and run machine code with flipped bits.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import IO, Any

from numba.core.caching import IndexDataCacheFile

from .. import locks

LOCK = "cache.lock"
"""Lock file in the cache folder that a process holds while it reads or writes a kernel."""

DIGEST_BYTES = 32
"""Size of the checksum at the start of a file."""


class CheckedCacheFile(IndexDataCacheFile):
    """Index of the cached versions of one kernel; used by one process at a time.

    Parameters
    ----------
    file
        Numba's own index of the kernel.
    stamp
        Digest of the code that the kernel is compiled from.
    """

    def __init__(self, file: IndexDataCacheFile, stamp: str) -> None:
        for name, value in vars(file).items():
            setattr(self, name, value)
        self._version = (file._version, stamp)

    def load(self, key: object) -> Any:
        """Return the cached data of a key, or None if it is missing or damaged."""
        with lock_beside(self, LOCK):
            return super().load(key)

    def save(self, key: object, data: object) -> None:
        """Cache data under a key."""
        with lock_beside(self, LOCK):
            super().save(key, data)

    def is_sound(self, key: object) -> bool:
        """Return whether there is undamaged data under a key."""
        name = self._load_index().get(key)
        return name is not None and self._read(self._data_path(name)) is not None

    def _load_index(self) -> dict[object, str]:
        content = self._read(self._index_path)
        if content is None:
            return {}
        stream = BytesIO(content)
        # The rest of another version may name classes that no longer exist.
        if pickle.load(stream) != self._version:
            return {}
        stamp, overloads = pickle.loads(stream.read())
        return overloads if stamp == self._source_stamp else {}

    def _load_data(self, name: str) -> object:
        content = self._read(self._data_path(name))
        return None if content is None else pickle.loads(content)

    @staticmethod
    def _read(path: str) -> bytes | None:
        """Return the content of a file without its checksum; None if it is missing or damaged."""
        with suppress(OSError):
            content = Path(path).read_bytes()
            if hashlib.sha256(content[DIGEST_BYTES:]).digest() == content[:DIGEST_BYTES]:
                return content[DIGEST_BYTES:]
        return None

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[IO[bytes]]:
        content = BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(hashlib.sha256(content.getvalue()).digest())
            file.write(content.getvalue())


@contextmanager
def lock_beside(file: IndexDataCacheFile, name: str) -> Iterator[None]:
    """Hold a lock in the cache folder, or none if the folder cannot be written."""
    stream: IO[str] | None = None
    try:
        with suppress(OSError):
            folder = Path(file._cache_path)
            folder.mkdir(parents=True, exist_ok=True)
            stream = (folder / name).open("w")
            locks.lock(stream, wait=True)
        yield
    finally:
        if stream is not None:
            stream.close()
