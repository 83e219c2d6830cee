"""Locks of open files: those of POSIX systems, or those of Windows.

A lock belongs to the open file and is released when its process ends.
"""

import sys
import time
from typing import IO, Any

if sys.platform == "win32":
    import msvcrt

    RETRY = 0.05
    """Polling interval while waiting for a lock [s]."""

    def lock(file: IO[Any], *, shared: bool = False, wait: bool = False) -> None:
        """Acquire an exclusive lock; Windows has no shared locks.

        Raises
        ------
        BlockingIOError
            If another process holds the lock and `wait` is false.
        """
        while True:
            file.seek(0)
            try:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
                return
            except PermissionError as error:
                if not wait:
                    raise BlockingIOError(error.errno, "another process holds the lock") from None
            time.sleep(RETRY)

    def lock_record(file: IO[Any]) -> None:
        """Do nothing, because SQLite uses its own record locks on Windows."""

else:
    import fcntl

    def lock(file: IO[Any], *, shared: bool = False, wait: bool = False) -> None:
        """Acquire a shared or exclusive lock of an open file.

        Raises
        ------
        BlockingIOError
            If another process holds the lock and `wait` is false.
        OSError
            If the file system has no locks.
        """
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(file, kind if wait else kind | fcntl.LOCK_NB)

    def lock_record(file: IO[Any]) -> None:
        """Acquire a record lock, as SQLite does; raise OSError if this fails."""
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
