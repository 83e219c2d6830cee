"""Locks of POSIX systems, and, as far as a stand-in shows it, that Windows can be without them."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from nested_agents.core import locks

WITHOUT = """
import builtins, importlib, pkgutil, sys
from types import ModuleType

windows = ModuleType("msvcrt")
windows.LK_NBLCK = 2
windows.locking = lambda descriptor, kind, count: None
sys.modules["msvcrt"] = windows
usual = builtins.__import__

def refuse(name, globals=None, *rest, **named):
    asker = (globals or {}).get("__name__") or ""
    if name in ("fcntl", "resource", "pwd", "grp", "termios") and asker.startswith("nested_agents"):
        raise ModuleNotFoundError(f"{asker} imports {name}", name=name)
    return usual(name, globals, *rest, **named)

builtins.__import__ = refuse
source = open(sys.argv[1]).read()
stand_in = ModuleType("nested_agents.core.locks")
sys.platform = "win32"  # for one module: what others do with the word is their affair
exec(source, vars(stand_in))
sys.platform = "linux"
del sys.modules["msvcrt"]
sys.modules[stand_in.__name__] = stand_in
import nested_agents
count = 0
for part in ("core", "topologies", "scenarios", "studies"):
    folder = importlib.import_module("nested_agents." + part).__path__
    for module in pkgutil.walk_packages(folder, "nested_agents." + part + "."):
        try:
            importlib.import_module(module.name)
        except Exception as error:  # an extra is not installed
            if "nested_agents" in str(error):
                raise
        count += 1
print(count)
"""


def test_a_lock_is_one_process_s_or_shared(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with path.open("w") as one, path.open("w") as other:
        locks.lock(one)
        with pytest.raises(BlockingIOError):
            locks.lock(other)
        with pytest.raises(BlockingIOError):
            locks.lock(other, shared=True)
    with path.open("w") as one, path.open("w") as other:  # it has gone with its file
        locks.lock(one, shared=True)
        locks.lock(other, shared=True, wait=True)


def windows(monkeypatch: pytest.MonkeyPatch) -> tuple[ModuleType, set[int]]:
    """Return the module as Windows has it, and the descriptors that a stand-in has locked."""
    taken: set[int] = set()

    def locking(descriptor: int, kind: int, count: int) -> None:
        assert (kind, count) == (2, 1)
        if taken:
            raise PermissionError(13, "Permission denied")
        taken.add(descriptor)

    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(LK_NBLCK=2, locking=locking))
    monkeypatch.setattr(sys, "platform", "win32")
    module = ModuleType("locks")
    source = Path(str(locks.__file__)).read_text(encoding="utf-8")
    exec(compile(source, "locks.py", "exec"), vars(module))
    return module, taken


def test_the_same_by_the_locks_of_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module, taken = windows(monkeypatch)
    waits: list[float] = []

    def wait(seconds: float) -> None:
        waits.append(seconds)
        taken.clear()  # the other one ends meanwhile

    monkeypatch.setattr(module.time, "sleep", wait)
    with (tmp_path / "lock").open("w") as file:
        module.lock(file)
        with pytest.raises(BlockingIOError):
            module.lock(file)
        module.lock(file, wait=True)
        module.lock_record(file)
    assert waits == [module.RETRY]


def test_everything_is_imported_where_there_is_no_fcntl() -> None:
    line = [sys.executable, "-c", WITHOUT, str(locks.__file__)]
    run = subprocess.run(line, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    assert int(run.stdout.split()[-1]) > 150
