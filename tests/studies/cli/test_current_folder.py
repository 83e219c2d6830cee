"""Nothing in the current folder is imported by a command or its children."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).with_name("nested-agents")
OTHERS = {"conftest", "nested_agents", "sitecustomize", "usercustomize"}
TRAP = """
with open({mark!r}, "a") as file:
    file.write(__name__ + " ")
raise ImportError("a trap")
"""
SPEC = """
seeds = 1
episodes = 2
steps = 3
evaluation = 1
topology = "mine.py:ring"
learner.kind = "frozen"
scenario.kind = "line-up"
"""
MINE = """
import random

import numpy as np


def ring(agents, groups):
    return list(zip(agents, agents[1:]))
"""
COMPILE = """
import numpy as np
from nested_agents.core.values.updates import _value

_value(np.zeros(1), np.zeros(1, dtype=int), np.zeros(1))
assert _value.compiled.stats.cache_hits  # another process has compiled it
"""
SPAWN = """
from multiprocessing import get_context
from nested_agents.core.isolation import safe_path

if __name__ == "__main__":
    with safe_path():
        process = get_context("spawn").Process(target=print)
        process.start()
    process.join()
    assert process.exitcode == 0
"""


def trap_names() -> set[str]:
    """The names of all modules that a process here may import."""
    names = {*sys.stdlib_module_names, *packages_distributions(), *OTHERS}
    return {n for n in names if n.isidentifier()} - {*sys.builtin_module_names, "__main__"}


@pytest.fixture
def traps(tmp_path: Path) -> Path:
    """A folder in which every file that is imported does harm."""
    folder = tmp_path / "traps"
    for package in ("", "pandas"):
        (folder / package).mkdir()
    text = TRAP.format(mark=str(tmp_path / "sprung"))
    for name in trap_names() - {"pandas"}:
        (folder / f"{name}.py").write_text(text)
    (folder / "pandas" / "__init__.py").write_text(text)
    for name in ("pyproject.toml", "setup.cfg", ".env"):
        (folder / name).write_text("[[[\n")
    return folder


def run_here(folder: Path, *line: str, **environment: str) -> None:
    """Run a command in a folder, and see that it succeeds and no trap is sprung."""
    done = subprocess.run(
        line,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    sprung = folder.with_name("sprung")
    assert not sprung.exists(), (line, sprung.read_text())
    assert done.returncode == 0, (line, done.stderr)
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_no_process_imports_or_reads_anything_of_the_current_folder(traps: Path) -> None:
    (traps / "study.toml").write_text(SPEC)
    (traps / "mine.py").write_text(MINE)
    run_here(traps, str(COMMAND), "run", "study.toml", "--out", ".", "--jobs", "1")
    lines = (
        ("report", "."),
        ("explain", "."),
        ("plan", "study.toml"),
        ("run", "study.toml", "--out", "other", "--backend", "dask", "--jobs", "1"),
    )
    with ThreadPoolExecutor(2) as pool:
        for each in [pool.submit(run_here, traps, str(COMMAND), *line) for line in lines]:
            each.result()


@pytest.mark.parametrize("script", [COMPILE, SPAWN])
def test_no_process_of_a_script_elsewhere_does(traps: Path, script: str) -> None:
    path = traps.with_name("script.py")
    path.write_text(script)
    run_here(traps, sys.executable, str(path), NUMBA_CACHE_DIR=str(traps.with_name("kernels")))


def test_the_package_run_by_name_does_not_either(traps: Path) -> None:
    (traps / "nested_agents.py").unlink()
    for name in trap_names() - {"click", "numpy", "pandas", "pydantic", "random"}:
        (traps / f"{name}.py").unlink(missing_ok=True)  # runpy imports much before it
    run_here(traps, sys.executable, "-m", "nested_agents", "presets")
