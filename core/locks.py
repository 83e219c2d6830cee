"""Locks of open files: those of POSIX systems, or those of Windows.

A lock belongs to the open file, and goes with it however its process ends.
"""

import sys
import time
from typing import IO, Any

if sys.platform == "win32":
    import msvcrt

    RETRY = 0.05
    """How often to try again where a lock is waited for [s]."""

    def lock(file: IO[Any], *, shared: bool = False, wait: bool = False) -> None:
        """Take the lock of an open file; Windows has none that are shared.

        Raises
        ------
        BlockingIOError
            If another has it, and it is not waited for.
        """
        while True:
            file.seek(0)
            try:
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
                return
            except PermissionError as error:
                if not wait:
                    raise BlockingIOError(error.errno, "another has the lock") from None
            time.sleep(RETRY)

    def lock_record(file: IO[Any]) -> None:
        """Do nothing: SQLite locks records in its own way here, which all file systems know."""

else:
    import fcntl

    def lock(file: IO[Any], *, shared: bool = False, wait: bool = False) -> None:
        """Take the lock of an open file, which others can share if they ask for no more.

        Raises
        ------
        BlockingIOError
            If another has it, and it is not waited for.
        OSError
            If the file system has no locks.
        """
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(file, kind if wait else kind | fcntl.LOCK_NB)

    def lock_record(file: IO[Any]) -> None:
        """Take the lock of a file's content, as SQLite does; raise OSError if it cannot be had."""
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
