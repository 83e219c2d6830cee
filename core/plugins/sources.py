"""Files of users: read once, kept as text, and run wherever a trial runs.

A spec names what a user wrote as ``"arm.py:Arm"``, relative to the spec. The text of the file is
kept with the study and travels to workers, so that nothing else is needed to continue, explain or
report the study elsewhere.

Names are resolved by the `Sources` that are *active*, see `Sources.active`; outside of any study
these are the files below the working directory. What came with somebody else's study is run only if
it is trusted, see `trust`; so are modules that it names, see `Sources.permit`.
"""

from __future__ import annotations

import contextlib
import linecache
import re
import sys
import traceback
from base64 import b64decode, b64encode
from binascii import Error as BinasciiError
from collections.abc import Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from pkgutil import resolve_name
from types import FunctionType, ModuleType
from typing import Any

from ..isolation import same_folder
from .compiled import compiled_name
from .printing import printable
from .syntax import imported
from .trust import is_trusted, module_text, place_of, sha256, texts_in, trust

ZIPPED = b"PK"
"""First bytes of a zip file."""
FOLDER = "sources"
"""Folder of copies in the directory of a study."""
MOST_BYTES = 1_000_000
"""Maximum size of a file [bytes]."""
TEAMS = ".npz"
"""Suffix of files with the state of a team; kept as text in base 64."""
GRAPHS = (".graphml", ".json", ".toml")
"""Suffixes of files that hold a hierarchy."""


Checkpoints = tuple[Path, float, str]
"""Folder of the checkpoints from which killed trials resume, interval between checkpoints [s], and
digest of the code and libraries; with another digest, a trial starts from the beginning."""


class Sources:
    """Files of users by their names in a spec.

    Parameters
    ----------
    folder
        Folder of relative names. By default, only `texts` are known.
    texts
        Known files by name.
    study
        Directory of a study with copies that replace missing files. Its copies come before those of
        `folder`.
    brought_by
        The study or file of another person that names files and modules. These run only if they are
        trusted, see `is_trusted`.

    Attributes
    ----------
    checkpoints
        Checkpoints of trials; None for no checkpoints.

    Examples
    --------
    >>> sources = Sources(texts={"arm.py": "LINKS = 3  # links"})
    >>> sources.load("arm.py:LINKS")
    3
    """

    def __init__(
        self,
        folder: Path | None = None,
        texts: Mapping[str, str] | None = None,
        study: Path | None = None,
        brought_by: str | None = None,
    ) -> None:
        self.folder = folder
        self.checkpoints: Checkpoints | None = None
        self._texts = dict(texts or {})
        self._studies = [place for place in (study, folder) if place is not None]
        self._brought = dict.fromkeys(self._texts, brought_by) if brought_by else {}
        self._brought_by = brought_by
        self._was_sent = False
        self._modules: set[str] = set()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sources) and self._texts == other._texts

    def __hash__(self) -> int:
        return hash(tuple(sorted(self._texts)))

    def __getstate__(self) -> dict[str, Any]:
        # Of what was sent to a worker all that is known is that its sender has run it.
        own = {"_was_sent": True, "checkpoints": self.checkpoints}
        return {**vars(Sources(None, self._texts)), **own}

    @property
    def texts(self) -> dict[str, str]:
        """Files that have been read so far, by name."""
        return dict(self._texts)

    @property
    def runs_foreign_code(self) -> bool:
        """Whether Python files or modules of users have been read so far."""
        return bool(self._modules) or any(name.endswith(".py") for name in self._texts)

    def offered_by(self, module: str) -> None:
        """Record the use of an entry point of an installed package."""
        self._modules.add(module)

    def only(self, names: set[str]) -> Sources:
        """Return a copy with only these names."""
        sources = Sources(None, {name: self.text(name) for name in sorted(names)})
        sources._brought = {name: by for name, by in self._brought.items() if name in names}
        sources._brought_by = self._brought_by
        sources._modules = set(self._modules)
        return sources

    def text(self, name: str) -> str:
        """Return the text of a file.

        Raises
        ------
        ValueError
            If there is no such file, or it is no text.
        """
        if name not in self._texts:
            if self._brought_by is not None:
                self._brought[name] = self._brought_by
            self._texts[name] = self._read(name)
        return self._texts[name]

    def digest(self, name: str) -> str:
        """Return a short hash of the text of a file.

        Raises
        ------
        ValueError
            If there is no such file.
        """
        return sha256(self.text(name))[:16]

    def load(self, reference: str) -> Any:
        """Return what ``"file.py:Name"`` names; the file is run once.

        Raises
        ------
        ValueError
            If there is no such file or name, the file raises when it is run, or it may not be run.
        """
        path, name = split(reference)
        module = self._module(path)
        try:
            return resolve_name(f"{module.__name__}:{name}")
        except AttributeError:
            own = [
                n
                for n, thing in vars(module).items()
                if isinstance(thing, type | FunctionType) and thing.__module__ == module.__name__
            ]
            known = ", ".join(own) or "nothing"
            raise ValueError(f"{path} has no {name!r}, it has: {known}") from None

    def content(self, name: str) -> bytes:
        """Return the bytes of a saved team.

        Raises
        ------
        ValueError
            If there is no such file, or it is not a saved team.
        """
        content = b""
        with contextlib.suppress(BinasciiError):
            content = b64decode(self.text(name), validate=True)
        if not content.startswith(ZIPPED):
            raise ValueError(f"{name}: is not a saved team (.npz)")
        return content

    def permit(self, module: str) -> None:
        """Refuse a module that only somebody else's study names, unless it is trusted.

        Raises
        ------
        ValueError
            If it may not be imported; one line.
        """
        self._modules.add(module)
        text = module_text(module)
        if self._brought_by is not None and not is_trusted(text):
            raise ValueError(
                f"{module}: named by {self._brought_by}; no spec of yours has imported it. "
                "Imported code has all your permissions; --trust imports it"
            )
        if not self._was_sent:
            trust(text)

    @contextlib.contextmanager
    def active(self) -> Iterator[None]:
        """Resolve names by these files for as long as the context lasts.

        Code of users that runs meanwhile may change the current folder; the end restores it.
        """
        token = _ACTIVE.set(self)
        try:
            with same_folder():
                yield
        finally:
            _ACTIVE.reset(token)

    def _read(self, name: str) -> str:
        if self.folder is None:
            raise ValueError(f"{name}: is not among the files kept with the study")
        path = self.folder / name
        if not path.exists():
            for study in self._studies:
                if (copy := study / FOLDER / kept_name(name)).exists():
                    path = copy
                    self._brought[name] = str(study)
                    break
        if path.exists() and not path.is_file():
            raise ValueError(f"{name}: is not a regular file")
        try:
            if path.stat().st_size > MOST_BYTES:
                raise ValueError(f"{name}: is larger than allowed, {MOST_BYTES} bytes")
            content = path.read_bytes()
            if name.endswith(TEAMS) and content.startswith(ZIPPED):
                return b64encode(content).decode("ascii")
            text = content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
        except OSError as error:
            raise ValueError(f"{name}: {error.strerror or error}") from None
        except UnicodeDecodeError:
            raise ValueError(f"{name}: is not UTF-8 text") from None
        for other in imported(text) - {"nested_agents"} if name.endswith(".py") else ():
            local = [path.parent / f"{other}.py", path.parent / other / "__init__.py"]
            if any(map(Path.exists, local)) and place_of(other) in (None, *map(str, local)):
                raise ValueError(
                    f"{name}: imports {other} from its folder, but a study keeps single files: put "
                    "both in one file, or install the shared part as a package"
                )
        return text

    def _module(self, name: str) -> ModuleType:
        text = self.text(name)
        key = f"_nested_agents_{sha256(name + chr(0) + text)[:16]}"
        if key in sys.modules:
            return sys.modules[key]
        if name in self._brought and not is_trusted(text):
            raise ValueError(
                f"{name}: came with {self._brought[name]}; no spec of yours has run it. "
                "It would have all your permissions; --trust runs it"
            )
        if not self._was_sent:
            trust(text)
        module = ModuleType(key)
        path = None if self.folder is None else self.folder / name
        module.__file__ = str(path.resolve()) if path is not None and path.exists() else name
        _FILES[key] = name
        file = compiled_name(module.__file__, text)
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        sys.modules[key] = module  # dataclasses look their own module up
        try:
            with same_folder():
                exec(compile(text, file, "exec"), module.__dict__)
        except (Exception, SystemExit) as error:
            del sys.modules[key]
            raise ValueError(f"{name} cannot be run: {format_error(error)}") from None
        return module


_ACTIVE: ContextVar[Sources | None] = ContextVar("sources", default=None)
_FILES: dict[str, str] = {}
"""Names of users' files by those of the modules that were made from them."""


def file_of_module(module: str) -> str | None:
    """Return the name of the user's file from which a module was made; None for other modules."""
    return _FILES.get(module)


def active() -> Sources:
    """Return the sources by which names are resolved now."""
    return _ACTIVE.get() or Sources(Path())


def is_reference(text: object) -> bool:
    """Tell whether a text names something in a Python file.

    Examples
    --------
    >>> is_reference("arm.py:Arm"), is_reference("chain:reversed")
    (True, False)
    """
    return isinstance(text, str) and ".py:" in text


def is_file(text: object) -> bool:
    """Tell whether a text names a file that holds a hierarchy."""
    return isinstance(text, str) and text.lower().endswith(GRAPHS)


def mentions(value: object) -> Iterator[tuple[str, str]]:
    """Yield the files that settings mention, at any depth, each with the dotted key that does.

    Examples
    --------
    >>> list(mentions({"kind": "arm.py:Arm", "graphs": ["teams.json"]}))
    [('arm.py', 'kind'), ('teams.json', 'graphs')]
    """
    for text, key in texts_in(value):
        if is_reference(text):
            yield split(text)[0], key
        elif is_file(text) or text.endswith(TEAMS):
            yield text, key


def files_in(value: object) -> set[str]:
    """Return the names of all files that settings mention, at any depth."""
    return {name for name, _ in mentions(value)}


def split(reference: str) -> tuple[str, str]:
    """Split ``"path/to/file.py:name"``.

    Examples
    --------
    >>> split("ring.py:ring")
    ('ring.py', 'ring')
    """
    path, colon, name = reference.rpartition(":")
    good = colon and path.endswith(".py") and all(part.isidentifier() for part in name.split("."))
    if not good:
        raise ValueError(f"{reference!r} must be written path/to/file.py:name")
    return path, name


def kept_name(name: str) -> str:
    """Return the name of a study's copy of a file; those of different files differ.

    Examples
    --------
    >>> kept_name("../arms/arm.py"), kept_name("arms__arm.py")
    ('..__arms__arm.py', 'arms%5F%5Farm.py')
    """
    quoted = re.sub(r"[%\\]|_(?=[_/])|(?<=[_/])_", lambda match: f"%{ord(match[0]):02X}", name)
    flat = quoted.replace("/", "__")
    # File systems take names of up to 255 bytes.
    return flat if len(flat.encode()) <= 200 else f"{sha256(name)}{flat[-30:]}"


def format_error(error: BaseException) -> str:
    r"""Return what an exception says, in one line.

    Examples
    --------
    >>> format_error(ValueError("two\nlines"))
    'ValueError: two lines'
    """
    return f"{type(error).__name__}: {message(error)}"


def place(error: BaseException) -> str:
    """Return the last line of a user's file in a traceback, or an empty text."""
    place = ""
    for frame, line in traceback.walk_tb(error.__traceback__):
        if file := file_of_module(frame.f_globals.get("__name__", "")):
            place = f" in line {line} of {file}"
    return place


def message(error: BaseException) -> str:
    """Return an exception's message in one line; empty if it has none."""
    with contextlib.suppress(Exception):
        return printable(" ".join(str(error).split()))
    return ""
