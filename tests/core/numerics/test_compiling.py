"""Cached kernels are taken only as long as nothing has changed that they are made of."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from nested_agents.core.numerics.compiling import stamp

ROOT = Path(__file__).resolve().parents[3]
NJIT = "from nested_agents.core.numerics.compiling import njit\n"
CALLER = """from .inner.called import called


@njit(cache=True)
def caller(x):
    return called(x)
"""
CALLED = """from ..constants import FACTOR


@njit(cache=True)
def called(x):
    return FACTOR * x
"""
FILES = {
    "__init__.py": "",
    "caller.py": NJIT + CALLER,
    "inner/__init__.py": "",
    "inner/called.py": NJIT + CALLED,
    "constants.py": "FACTOR = 2\n",
    "other.py": "N = 1\n",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        path = tmp_path / "package" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return tmp_path / "package"


def called(package: Path) -> tuple[int, int]:
    """Return what a kernel says in a new process, and how often it was found in the cache."""
    code = (
        "from package.caller import caller\nprint(caller(3), sum(caller.stats.cache_hits.values()))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=package.parent, capture_output=True, text=True, check=True)
    value, hits = map(int, done.stdout.split())
    return value, hits


def test_an_edit_of_what_is_called_or_read_is_noticed(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    assert called(package) == (6, 0)
    (package / "other.py").write_text("N = 2\n")
    assert called(package) == (6, 1)
    (package / "inner" / "called.py").write_text(FILES["inner/called.py"].replace("* x", "+ x"))
    assert called(package) == (5, 0)
    (package / "constants.py").write_text("FACTOR = 7\n")
    assert called(package) == (10, 0)


def test_a_stamp_is_of_all_that_is_imported() -> None:
    kernels = ROOT / "nested_agents" / "core" / "rules" / "kernels"
    assert stamp(kernels / "dense.py") != stamp(kernels / "pairs.py")
    assert stamp(kernels / "dense.py") == stamp(kernels / "dense.py")


def test_all_kernels_are_compiled_so() -> None:
    for folder in ("core", "scenarios", "topologies", "studies"):
        for path in (ROOT / folder).rglob("*.py"):
            if path.name != "compiling.py":
                found = re.search(r"^\s*(from|import) numba\b.*", path.read_text(), re.MULTILINE)
                assert found is None, f"{path}: {found and found[0]}; see core/numerics"
