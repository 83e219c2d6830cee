"""Atomic files, and files of recordings."""

import errno
import hashlib
import io
import os
import stat
import sys
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from ..errors import SpecError

if TYPE_CHECKING:
    from numpy.typing import NDArray

Recording = dict[str, "NDArray[Any]"]
"""Arrays of one episode of T steps by name: those that the scenario's ``recorded`` names, each
``(T + 1, ...)``; ``reward`` ``(T,)``, or ``(T, n)`` if each agent has its own reward; those that
its ``constants_of_episode`` returns; and ``messages_fail`` ``(T + 1, n)`` if messages can fail, 1
while they do and 2 while an agent is absent."""

TEAM = "team"
"""Name of a trained team's arrays among the names of recorded episodes."""


Place = str | os.PathLike[str]
"""Path of a file."""


class NotRecordedError(SpecError):
    """An undamaged file of recordings holds none of this name."""


MAX_FILE_BYTES = 2**30
"""Maximum size of a file that is read as a whole."""


def check_file(path: Place) -> None:
    """Refuse a pipe, a socket, a device and a huge file, because reading would wait or never end.

    Raises
    ------
    OSError
        If it is one of these, or does not exist.
    """
    status = os.stat(path)
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise OSError(errno.EINVAL, "is a pipe, a socket or a device, not a file", str(path))
    if status.st_size > MAX_FILE_BYTES:
        raise OSError(errno.EFBIG, f"is larger than allowed, {MAX_FILE_BYTES} bytes", str(path))


def read_bytes(path: Place) -> bytes:
    """Return the content of a file.

    Raises
    ------
    OSError
        If it is refused by `check_file`, or cannot be read.
    """
    check_file(path)
    with open(path, "rb", buffering=0) as file:
        return file.read()


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8 without a byte-order mark.

    Raises
    ------
    OSError
        If it is refused by `check_file`, or cannot be read.
    UnicodeDecodeError
        If it is not UTF-8.
    """
    check_file(path)
    return path.read_text(encoding="utf-8-sig")


def write(path: Path, content: bytes) -> None:
    """Replace a file. If power fails, it holds either the old or the new content."""
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Write a file that replaces `path` when the context ends without an error.

    If several processes write at once, the last one wins.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        with open(temporary, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError) and error.filename in (None, str(temporary)):
            error.filename = str(path)  # the user does not know the temporary name
        raise
    if sys.platform != "win32":  # which cannot open folders
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def remove_incomplete(folder: Path) -> None:
    """Delete what killed processes have not finished writing to a folder that others do not use."""
    with suppress(OSError):
        for incomplete in folder.glob(".*.new"):
            incomplete.unlink()


def write_recordings(path: Path, recordings: Mapping[str, Recording]) -> str | None:
    """Write recordings by name to an ``.npz`` file and return the SHA-256 of its content.

    Without any arrays, write nothing and return None.
    """
    arrays = {f"{name}/{key}": a for name, r in recordings.items() for key, a in r.items()}
    if not arrays:
        return None
    import numpy as np  # slow to import, and commands that read rows do not need it

    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type]
    content = buffer.getvalue()
    write(path, content)
    return hashlib.sha256(content).hexdigest()


def read_checked(path: Place, digest: str | None) -> bytes:
    """Return the content of a file that has a SHA-256, unless that is unknown.

    Raises
    ------
    SpecError
        If the file is missing, is none, cannot be read, or has another content.
    """
    try:
        content = read_bytes(path)
    except FileNotFoundError:
        raise SpecError(f"{path}: is missing") from None
    except OSError as error:
        raise SpecError(f"{path}: {error.strerror or error}") from None
    if digest not in (None, hashlib.sha256(content).hexdigest()):
        raise SpecError(f"{path}: is damaged")
    return content


def read_recording(path: Path, name: str, digest: str | None = None) -> Recording:
    """Read one recording from a file that `write_recordings` wrote.

    Parameters
    ----------
    path
        Path of the file.
    name
        Name of the recording.
    digest
        Expected SHA-256 of the file; None: unknown.

    Raises
    ------
    SpecError
        If the file is missing or damaged.
    NotRecordedError
        If it holds no recording of this name.
    """
    import numpy as np

    prefix = f"{name}/"
    content = read_checked(path, digest)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            keys = [key for key in arrays.files if key.startswith(prefix)]
            recording = {key.removeprefix(prefix): arrays[key] for key in keys}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError):
        raise SpecError(f"{path}: is damaged") from None
    if not recording:
        raise NotRecordedError(f"{path}: holds no recording {name!r}")
    return recording
