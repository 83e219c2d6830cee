"""What pytest leaves out and how it names modules whose docstrings have examples."""

import gc
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).parent
FOLDERS = ("core", "topologies", "scenarios", "studies")
NEEDED = {
    "mujoco": "plugins/swimmers/nested_agents_swimmers/*.py",
}
"""Modules that need an extra."""
collect_ignore_glob = [pattern for extra, pattern in NEEDED.items() if not find_spec(extra)]

os.environ.pop("NESTED_AGENTS_DEV", None)  # set by ./dev: commands would be printed with ./dev exec


def pytest_collect_file(file_path: Path) -> None:
    """Import modules of the four folders by their names in the package.

    pytest would name them by where they are, and import each a second time.
    """
    names = list(file_path.relative_to(ROOT).with_suffix("").parts)
    if file_path.suffix != ".py" or names[0] not in FOLDERS:
        return
    if names[-1] == "__init__":
        names.pop()
    for end in range(1, len(names) + 1):
        name = ".".join(names[:end])
        sys.modules[name] = import_module(f"nested_agents.{name}")


def pytest_collection_finish() -> None:
    """Keep what has been imported and collected out of every later garbage collection."""
    gc.freeze()
