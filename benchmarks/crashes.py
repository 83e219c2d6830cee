"""Kill a study at random moments, continue it, and compare: ``python -m benchmarks.crashes``.

A real, small study runs once undisturbed. Then it runs again and again in new directories, while
its process or one of its workers is killed (SIGKILL) at random moments, and the same command
continues it, until enough have been killed. What each of them ends with must be equal to the
undisturbed one byte by byte, and nothing that was once kept may be missing after a kill.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import MARK, Store


def spec_of(seeds: int) -> Spec:
    """Return the spec of the study, of two conditions."""
    return Spec.of(
        {"seeds": seeds, "episodes": 2, "steps": 100, "evaluation": 1,
         "sweep": {"preset": ["default", "frozen"]}}
    )  # fmt: skip


LONGEST = 1.5
"""Most seconds to a kill from the moment that trials are handed out or that another one is kept."""

WORKERS = {"loky": b"popen_loky_posix", "dask": b"multiprocessing.spawn"}
"""What the command line of a worker holds, by backend."""


@dataclass
class Tally:
    """What happened."""

    kills: Counter[str] = field(default_factory=Counter)
    """How many processes were killed, by what they were."""
    runs: int = 0
    """How often the command was begun."""
    studies: int = 0
    """In how many directories it was."""
    lost: int = 0
    """Trials that had been kept and were missing after a kill."""
    kept: int = 0
    """Trials that had been kept before a kill, summed over kills."""
    failed: int = 0
    """Trials that were given up because their workers had been killed too often."""
    unequal: int = 0
    """Studies that did not end with the bytes of the undisturbed one."""


def disturb(backend: str, kills: int, seed: int, seeds: int, folder: Path) -> Tally:
    """Kill `kills` processes of studies of `seeds` in `folder`, and return what happened."""
    rng = random.Random(seed)
    spec = folder / "spec.toml"
    spec.write_text(dumps(spec_of(seeds).table()))
    assert _begin(["run", spec, "--out", folder / "whole"], "loky", jobs=1).wait() == 0
    expected = _digest(folder / "whole")
    tally = Tally()
    while tally.kills.total() < kills:
        directory = folder / str(tally.studies)
        tally.studies += 1
        command, status = ["run", spec, "--out", directory], -1
        while status != 0:
            tally.runs += 1
            process = _begin(command, backend)
            while process.poll() is None and tally.kills.total() < kills:
                _await(process, directory, another=rng.random() < 0.8)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(rng.uniform(0.0, LONGEST))
                before = _kept(directory)
                victim = rng.choice(["process", "worker"])
                if _kill(process, victim, backend, rng):
                    tally.kills[victim] += 1
                    after = _kept(directory)
                    tally.kept += len(before)
                    tally.lost += len(before - after)
            status = process.wait()
            if status == 2:
                raise RuntimeError(f"{directory}: {' '.join(map(str, command))} was refused")
            if status == 1:
                with Store.open(directory) as store:
                    tally.failed += len(store.failed())
                command = ["retry", directory]
        tally.unequal += _digest(directory) != expected
        print(
            f"{tally.kills.total()} of {kills} killed, {tally.lost} lost, {tally.failed} given up, "
            f"{tally.unequal} of {tally.studies} studies unequal",
            file=sys.stderr,
        )
    return tally


def _begin(command: list[object], backend: str, jobs: int = 2) -> subprocess.Popen[bytes]:
    line = [sys.executable, "-m", "nested_agents", *map(str, command)]
    return subprocess.Popen(
        [*line, "--jobs", str(jobs), "--backend", backend],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def _await(process: subprocess.Popen[bytes], directory: Path, *, another: bool) -> None:
    """Wait until trials are handed out, and then perhaps until another one is kept."""
    recordings = directory / "recordings"

    def count() -> int:
        return len(list(recordings.glob("[!.]*.npz"))) if recordings.exists() else 0

    before = count()
    while process.poll() is None and not (
        (directory / MARK).exists() and (count() > before or not another)
    ):
        time.sleep(0.02)


def _kill(process: subprocess.Popen[bytes], victim: str, backend: str, rng: random.Random) -> bool:
    """Kill the process or one of its workers; tell whether there was one."""
    if process.poll() is not None:
        return False
    if victim == "process":
        process.kill()
        process.wait()
        return True
    workers = [pid for pid in _children(process.pid) if WORKERS[backend] in _line(pid)]
    if not workers:
        return False
    try:
        os.kill(rng.choice(workers), signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def _children(parent: int) -> list[int]:
    children = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            children.append(int(path.parent.name))
    return sorted(children)


def _line(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def _kept(directory: Path) -> set[tuple[object, ...]]:
    """Return what is kept of the finished trials: every row, and the bytes of the recording."""
    try:
        with Store.open(directory) as store:
            store.verify()
            names, rows = store.trials()
            identity, state = names.index("identity"), names.index("state")
            done = [row[identity] for row in rows if row[state] == "done"]
    except SpecError:
        return set()  # killed before the study was noted
    recordings = directory / "recordings"
    return {(name, (recordings / f"{name}.npz").read_bytes()) for name in done}


def _digest(directory: Path) -> str:
    """Return the SHA-256 of all rows and recordings."""
    with Store.open(directory) as store:
        store.verify()
        names, episodes = store.episodes()
        rows, numbers = (names, list(episodes)), store.numbers()
    content = hashlib.sha256(json.dumps([rows, [n[:4] for n in numbers if n[4]]]).encode())
    for path in sorted((directory / "recordings").glob("[!.]*.npz")):
        content.update(path.name.encode() + path.read_bytes())
    return content.hexdigest()


def main() -> int:
    """Kill, compare, print what happened; 1 if anything was lost."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.crashes", description=__doc__)
    parser.add_argument("--kills", type=int, default=100, metavar="N")
    parser.add_argument("--backend", choices=sorted(WORKERS), default="loky")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="of the study")
    options = parser.parse_args()
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        tally = disturb(options.backend, options.kills, options.seed, options.seeds, Path(folder))
    print(f"backend         {options.backend}, seed {options.seed}")
    print(f"killed          {tally.kills['process']} processes, {tally.kills['worker']} workers")
    print(f"studies         {tally.studies}, the command begun {tally.runs} times")
    print(f"kept at a kill  {tally.kept / tally.kills.total():.1f} trials on average")
    print(f"lost            {tally.lost} trials that had been kept")
    print(f"given up        {tally.failed} trials, run again by nested-agents retry")
    print(f"unequal         {tally.unequal} studies of {tally.studies}")
    print(f"time            {time.monotonic() - begin:.0f} s")
    return 1 if tally.lost or tally.unequal else 0


if __name__ == "__main__":
    sys.exit(main())
