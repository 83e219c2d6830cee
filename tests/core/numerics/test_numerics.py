"""Cached kernels are taken only as long as nothing has changed that they are made of."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from nested_agents.core import locks
from nested_agents.core.numerics import LOCK, Kernel, compiler, stamp, working_seconds

ROOT = Path(__file__).resolve().parents[3]
NJIT = "from nested_agents.core.numerics import njit\n"
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


def called(package: Path) -> tuple[int, int, bool]:
    """Return what a kernel says in a new process, its cache hits, and whether it was compiled."""
    code = (
        "from package.caller import caller\n"
        "print(caller(3), sum(caller.compiled.stats.cache_hits.values()))"
    )
    command = [sys.executable, "-c", code]
    before = {path: path.stat().st_mtime_ns for path in package.rglob("*.nb?")}
    done = subprocess.run(command, cwd=package.parent, capture_output=True, text=True, check=True)
    after = {path: path.stat().st_mtime_ns for path in package.rglob("*.nb?")}
    value, hits = map(int, done.stdout.split())
    return value, hits, before != after


def test_an_edit_of_what_is_called_or_read_is_noticed(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    assert called(package) == (6, 1, True)  # by a process that only compiles
    (package / "other.py").write_text("N = 2\n")
    assert called(package) == (6, 1, False)
    (package / "inner" / "called.py").write_text(FILES["inner/called.py"].replace("* x", "+ x"))
    assert called(package) == (5, 1, True)
    (package / "constants.py").write_text("FACTOR = 7\n")
    assert called(package) == (10, 1, True)


def test_kernels_are_compiled_where_no_folder_can_be_written(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary, file = package.parent / "temporary", package / "constants.py"
    temporary.mkdir()
    for folder in (package, package / "inner"):
        (folder / "__pycache__").touch()  # a file, so that no folder can have this name
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(file))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("TMPDIR", str(temporary))
    shared = temporary / f"nested-agents-{os.getuid()}"
    shared.mkdir(mode=0o777)
    shared.chmod(0o777)  # everybody could write code there
    assert called(package)[:2] == (6, 1)  # by a process that only compiles, as elsewhere
    assert not [*shared.iterdir()]
    shared.rmdir()
    assert called(package)[:2] == (6, 1)
    assert [*shared.iterdir()]


def test_a_class_that_is_renamed_spoils_no_cache(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    for name in ("Model", "Renamed"):
        text = f"from typing import NamedTuple\n\n\nclass {name}(NamedTuple):\n    n: int\n"
        (package / "model.py").write_text(text)
        caller = "@njit(cache=True)\ndef caller(model):\n    return model.n\n"
        (package / "caller.py").write_text(f"{NJIT}from .model import {name}\n\n\n{caller}")
        code = f"from package.caller import {name}, caller; print(caller({name}(3)))"
        command = [sys.executable, "-c", code]
        assert subprocess.check_output(command, cwd=package.parent, text=True) == "3\n"


def test_who_takes_a_kernel_from_the_cache_waits_for_no_compilation(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    assert called(package) == (6, 1, True)
    held = [path.open("w") for path in package.rglob(f"*{LOCK}")]
    assert held
    for file in held:
        locks.lock(file)
    assert called(package) == (6, 1, False)
    for file in held:
        file.close()


def test_kernels_for_several_types_are_compiled_at_once(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    values = {"3": "6", "1.5": "3.0", "2j": "4j", "True": "2"}

    def asking(*values: str) -> subprocess.Popen[str]:
        calls = "".join(f"print(caller({value}))\n" for value in values)
        code = f"from package.caller import caller\n{calls}"
        command = [sys.executable, "-c", code]
        return subprocess.Popen(command, cwd=package.parent, stdout=subprocess.PIPE, text=True)

    begun = [asking(value) for value in values]
    assert [process.communicate()[0].strip() for process in begun] == [*values.values()]
    from_cache = asking(*values).communicate()[0]
    assert from_cache.split() == [*values.values()]


def test_a_kernel_that_is_compiled_ahead_is_loaded_by_its_call(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    code = (
        "import os; os.cpu_count = lambda: {cores}\n"
        "from nested_agents.core.numerics import compile_ahead, compiler\n"
        "from package.caller import caller\n"
        "started, start = [], compiler._start_child\n"
        "compiler._start_child = lambda: started.append(start()) or started[-1]\n"
        "compile_ahead(caller, 2)\n"
        "compile_ahead(caller, 2)\n"
        "print(len(started), caller(3), len(started), caller.compiled.stats.cache_hits.total())"
    )

    def asking(cores: int) -> str:
        command = [sys.executable, "-c", code.format(cores=cores)]
        return subprocess.check_output(command, cwd=package.parent, text=True).strip()

    assert asking(2) == "1 6 1 1"
    assert asking(2) == "0 6 0 1"  # from the cache
    (package / "constants.py").write_text("FACTOR = 4\n")
    assert asking(1) == "0 12 1 1"  # not ahead on a single core


def test_the_clock_of_durations_stops_during_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]

    def prepared(kernel: Kernel, args: tuple[object, ...]) -> object:
        now[0] += 5.0
        return kernel.py_func

    def run() -> str:
        now[0] += 1.0
        return "result"

    monkeypatch.setattr(compiler, "perf_counter", lambda: now[0])
    monkeypatch.setattr(Kernel, "_prepared", prepared)
    kernel = Kernel(run, {})
    begin = working_seconds()
    assert [kernel(), kernel()] == ["result", "result"]
    assert (now[0], working_seconds() - begin) == (7.0, 2.0)


def test_what_cannot_be_compiled_apart_is_compiled_all_the_same(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    code = (
        "import sys\nfrom package.inner.called import called\nsys.executable = '/nowhere'\n"
        "print(called(3))"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=package.parent, capture_output=True, text=True)
    assert (done.stdout, done.returncode) == ("6\n", 0), done.stderr


PUSH = """
import os, sys
import numba
import numpy as np
from nested_agents.scenarios.box_pushing.prediction.predictors import push_model
from nested_agents.scenarios.box_pushing.prediction.push import push
from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.scenarios.box_pushing.world.robots import ROBOTS

rng = np.random.default_rng(0)
model = push_model("push", [ROBOTS["e-puck"]] * 2, BOXES["square"])
poses, twists = rng.normal(size=(2, 3)) * [0.15, 0.15, 9], rng.normal(size=(2, 9, 3)) * 0.1
choices, box = rng.integers(9, size=(2, 777)), np.array([0.01, 0.02, 0.3])
for run in range(2):
    if not os.fork():
        results = push(poses, box, twists, choices, 1.5, model)
        print("".join(np.asarray(result).tobytes().hex() for result in results))
        sys.exit()
    assert os.wait()[1] == 0
"""
"""Two forks of a process that has loaded no kernel yet, one after the other."""


@pytest.mark.slow
def test_the_run_that_compiles_has_the_bits_of_later_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    command = [sys.executable, "-c", PUSH]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    first, later = done.stdout.splitlines()
    assert first == later != b""


def test_a_stamp_is_of_all_that_is_imported() -> None:
    kernels = ROOT / "core" / "values"
    assert stamp(kernels / "triangular.py") != stamp(kernels / "updates.py")
    assert stamp(kernels / "triangular.py") == stamp(kernels / "triangular.py")


def test_all_kernels_are_compiled_so() -> None:
    for folder in ("core", "scenarios", "topologies", "studies"):
        for path in (ROOT / folder).rglob("*.py"):
            # What numba generates code by is imported when a kernel is compiled.
            if path.name not in ("compiler.py", "kernel_cache.py", "memory.py"):
                found = re.search(r"^\s*(from|import) numba\b.*", path.read_text(), re.MULTILINE)
                assert found is None, f"{path}: {found and found[0]}; see core/numerics"


@pytest.mark.parametrize(
    ("ending", "damage"),
    [(".nbi", "truncated"), (".nbi", "garbage"), (".nbc", "truncated"), (".nbc", "flipped")],
)
def test_a_damaged_cached_kernel_is_compiled_again(
    ending: str, damage: str, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    assert called(package) == (6, 1, True)
    for path in package.rglob(f"*{ending}"):
        content = bytearray(path.read_bytes())
        if damage == "flipped":  # what could be a constant in machine code
            content[len(content) // 2] ^= 1
        part = {"truncated": content[:-7], "garbage": b"\x80" * 99}
        path.write_bytes(part.get(damage, content))
    assert called(package) == (6, 1, True)
    assert called(package) == (6, 1, False)
