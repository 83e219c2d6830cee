"""Trust in code: code runs if a spec of the user has run it before, or --trust allows it.

A study keeps the files that its spec names, and runs them again when it is explained or continued;
it may also name modules of installed packages. Nothing from another person's study is run or
imported without permission, because that code has the reader's permissions. A digest inside
the study would protect no user. Code that runs from a user's own spec is therefore recorded, by a
SHA-256, in a list outside of all studies: ``$XDG_STATE_HOME/nested-agents/trusted``, by default
below ``~/.local/state``. Code that a study contains or names runs if it is in the list.

The list records the text of a file, and the name and location of a module (see `module_text`).
"""

import contextlib
import hashlib
import os
import sys
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

ENVIRONMENT_KEYS = ("id", "env_id")
"""Keys with the name of an environment; ``env_id`` is an option of old environments."""

LIBRARIES = ("gymnasium", "mpe2", "pettingzoo")
"""Packages with environments that every study may name, because the toolkit offers them."""

_noted: set[str] = set()
"""Digests of what this process trusts, also where no list can be written."""


def trusted_list() -> Path:
    """Return where the list is.

    Raises
    ------
    RuntimeError
        If there is no home folder.
    """
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "nested-agents" / "trusted"


def is_trusted(text: str) -> bool:
    """Tell whether a file of this text may be run, or a module of this `module_text` imported."""
    digest = sha256(text)
    return digest in _noted or _is_listed(digest)


def _is_listed(digest: str) -> bool:
    with contextlib.suppress(OSError, RuntimeError, ValueError):  # no list, or no home
        return digest in trusted_list().read_text(encoding="ascii").split()
    return False


def trust(text: str) -> bool:
    """Add a text to the trusted list; return False if it is trusted in this process only.

    This is so if the list cannot be written.
    """
    digest = sha256(text)
    _noted.add(digest)
    if _is_listed(digest):
        return True
    try:
        path = trusted_list()
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "a", encoding="ascii") as file:
            file.write(f"{digest}\n")
    except (OSError, RuntimeError):
        return False
    return True


def module_text(module: str) -> str:
    """Return what stands for a module in the list: its name, and where its package is.

    Nothing is imported for it.
    """
    return f"module {module} of {place_of(module.partition('.')[0])}"


def place_of(package: str) -> str | None:
    """Return the path of a top-level package or module; None if there is none."""
    known = sys.modules.get(package)
    spec = None if known is None else known.__spec__
    try:
        spec = spec or find_spec(package)
    except (ImportError, ValueError):
        return None
    if spec is None:
        return None
    folders = list(spec.submodule_search_locations or ())
    return spec.origin or (folders[0] if folders else None)


def module_named(text: str) -> str:
    """Return the module that a text names, ``"package.module:Name"``; empty if it names none.

    Everything before the first colon counts, also if it is no proper name of a module. References
    to files, ``"file.py:Name"``, name no module.

    Examples
    --------
    >>> module_named("arms.seven:Arm"), module_named("evil.:X"), module_named("arm.py:Arm")
    ('arms.seven', 'evil.', '')
    """
    module, colon, _ = text.partition(":")
    return module if colon and ".py:" not in text else ""


def is_module_name(text: str) -> bool:
    """Return whether a text is the full name of a module, such as ``arms.seven``."""
    return all(part.isidentifier() for part in text.split("."))


def texts_in(value: object, key: str = "") -> Iterator[tuple[str, str]]:
    """Yield the texts in settings, at any depth, each with its dotted key."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from texts_in(inner, f"{key}.{name}".lstrip("."))
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from texts_in(inner, key)
    elif isinstance(value, str):
        yield value, key


def modules_in(value: object) -> Iterator[tuple[str, str]]:
    """Yield the modules that settings name, at any depth, each with its dotted key.

    A kind names its module with a dot in it, so that ``"chain:reversed"`` names none. Modules of
    environments may have any name, and PettingZoo's stand without a colon; those of `LIBRARIES` are
    left out.

    Examples
    --------
    >>> list(modules_in({"kind": "arms.seven:Arm", "id": "games/chess", "of": "arm.py:Arm"}))
    [('arms.seven', 'kind'), ('games.chess', 'id')]
    """
    for text, key in texts_in(value):
        module = module_named(text)
        if key.rpartition(".")[2] in ENVIRONMENT_KEYS:
            path = text.replace("/", ".")
            if not module and is_module_name(path) and not text.endswith(".py"):
                module = path
            if module and module.partition(".")[0] not in LIBRARIES:
                yield module, key
        elif "." in module:
            yield module, key


def sha256(text: str) -> str:
    """Return the digest by which the list knows a text."""
    return hashlib.sha256(text.encode()).hexdigest()
