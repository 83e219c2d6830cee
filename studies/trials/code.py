"""The installed code that computes results: an edit of it is noticed, and reported.

Every module on which a trial's numbers depend, of this package and of those that offer things to
it, has a digest of its text, to see at once whether it may have changed, and one of its syntax
tree, to see whether it has: comments and layout do not count.
"""

import hashlib
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

from ...core.plugins.sources import meaning
from ..store.reading import Reading

PACKAGE = Path(__file__).parents[2]
"""Where the package is installed."""
COMPUTING = (
    "core/**/*.py", "topologies/**/*.py", "scenarios/**/*.py", "scenarios/**/*.toml",
    "studies/trials/**/*.py", "studies/catalogue/**/*.py",
)  # fmt: skip
"""Modules that compute results, and what they are given."""
SILENT = ("checking", "pictures", "environments.py", "figure.py", "drawing.py")
"""Parts of them that do not."""
GROUPS = "nested_agents."
"""With what the names of entry-point groups begin under which packages offer things."""

Code = dict[str, tuple[str, str]]
"""By module, digests of its text and of its syntax tree."""


def modules() -> dict[str, str]:
    """Return the text of every module that computes results, by its path in its package."""
    texts = {}
    for pattern in COMPUTING:
        for path in sorted(PACKAGE.glob(pattern)):
            name = path.relative_to(PACKAGE).as_posix()
            if not set(name.split("/")) & set(SILENT):
                texts[name] = path.read_text(encoding="utf-8")
    for root in _offering():
        for path in sorted(root.rglob("*.py")) if root.is_dir() else [root]:
            texts[path.relative_to(root.parent).as_posix()] = path.read_text(encoding="utf-8")
    return texts


def _offering() -> Iterator[Path]:
    """Yield the folders, or files, of installed packages that offer things to studies."""
    from importlib.metadata import entry_points

    points = entry_points()
    groups = [group for group in points.groups if group.startswith(GROUPS)]
    modules = {p.module.partition(".")[0] for g in groups for p in points.select(group=g)}
    for name in sorted(modules - {__name__.partition(".")[0]}):
        try:
            spec = find_spec(name)
        except (ImportError, ValueError):
            continue  # what cannot be found is reported when it is asked for
        if spec is not None and spec.origin is not None and spec.origin.endswith(".py"):
            origin = Path(spec.origin)
            yield origin.parent if origin.name == "__init__.py" else origin


def present(known: Mapping[str, tuple[str, str]] | None = None) -> Code:
    """Return the digests of the installed code; modules whose text is `known` are not parsed."""
    digests, known = {}, known or {}
    for name, text in modules().items():
        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        is_same = name in known and known[name][0] == digest
        digests[name] = known[name] if is_same else (digest, meaning(text, name))
    return digests


def changed(known: Mapping[str, tuple[str, str]]) -> list[str]:
    """Return the modules that mean something else than they did, or are new or gone."""
    here = present(known)
    edited = [name for name in here if name in known and here[name][1] != known[name][1]]
    return sorted(known.keys() ^ here.keys()) + edited


def outdated(store: Reading) -> str | None:
    """Return why this code would not go on with a study, in one line; None if it would."""
    modules = changed(store.code())
    if not modules:
        return None
    more = f" and {len(modules) - 1} more have" if len(modules) > 1 else " has"
    return (
        f"{store.directory}: its results are of other code: {modules[0]}{more} changed "
        "since; --accept-code goes on with it"
    )
