"""Kill a study at random moments, continue it, and compare: ``python -m benchmarks.crashes``.

A real, small study runs once undisturbed. Then it runs again and again in new directories, while
its process or one of its workers is killed (SIGKILL) at random moments, and the same command
continues it, until enough have been killed. What each of them ends with must be equal to the
undisturbed one byte by byte, and nothing that was once kept may be missing after a kill.

The command runs in a copy of this process, which has imported what it needs; its workers are
processes that start from nothing, as ever.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path

from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import MARK
from nested_agents.studies.trials.arrangement import check_conditions


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


def disturb(backend: str, kills: int, seed: int, spec: Path, expected: str) -> Tally:
    """Kill `kills` processes of studies beside a spec that must end with a digest of `expected`."""
    rng, tally = random.Random(seed), Tally()
    while tally.kills.total() < kills:
        directory = spec.parent / f"{backend}-{tally.studies}"
        tally.studies += 1
        command, status = ["run", spec, "--out", directory], -1
        while status != 0:
            tally.runs += 1
            process = _begin(command, backend)
            while process.is_alive() and tally.kills.total() < kills:
                _await(process, directory, another=rng.random() < 0.8)
                process.join(rng.uniform(0.0, LONGEST))
                before = _kept(directory)
                victim = rng.choice(["process", "worker"])
                if _kill(process, victim, backend, rng):
                    tally.kills[victim] += 1
                    after = _kept(directory)
                    tally.kept += len(before)
                    tally.lost += len(before - after)
            status = _status(process)
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


def _begin(command: list[object], backend: str, jobs: int = 2) -> BaseProcess:
    line = [*map(str, command), "--jobs", str(jobs), "--backend", backend]
    process = multiprocessing.get_context("fork").Process(target=_command, args=(line,))
    process.start()
    return process


def _command(line: list[str]) -> None:
    """Be the command ``nested-agents``, in a copy of this process, which has imported much."""
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    os._exit(command_line(line))


def _status(process: BaseProcess) -> int:
    process.join()
    assert process.exitcode is not None
    return process.exitcode


def _await(process: BaseProcess, directory: Path, *, another: bool) -> None:
    """Wait until trials are handed out, and then perhaps until another one is kept."""
    recordings = directory / "recordings"

    def count() -> int:
        return len(list(recordings.glob("[!.]*.npz"))) if recordings.exists() else 0

    before = count()
    while process.is_alive() and not (
        (directory / MARK).exists() and (count() > before or not another)
    ):
        time.sleep(0.02)


def _kill(process: BaseProcess, victim: str, backend: str, rng: random.Random) -> bool:
    """Kill the process or one of its workers; tell whether there was one."""
    if not process.is_alive():
        return False
    if victim == "process":
        process.kill()
        process.join()
        return True
    workers = [pid for pid in _children(process.pid or 0) if WORKERS[backend] in _line(pid)]
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
    parser.add_argument("--backend", choices=sorted(WORKERS), nargs="+", default=["loky"])
    parser.add_argument("--kills", type=int, nargs="+", default=[100], help="of each backend")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="of the study")
    options = parser.parse_args()
    if len(options.kills) != len(options.backend):
        parser.error("--kills: must be one number for each backend")
    with tempfile.TemporaryDirectory() as folder:
        study, spec = spec_of(options.seeds), Path(folder) / "spec.toml"
        spec.write_text(dumps(study.table()))
        check_conditions(
            study
        )  # loads what every command needs, so that each is a copy that has it
        assert _status(_begin(["run", spec, "--out", spec.parent / "whole"], "loky", jobs=1)) == 0
        expected, is_fine = _digest(spec.parent / "whole"), True
        for backend, kills in zip(options.backend, options.kills, strict=True):
            begin = time.monotonic()
            tally = disturb(backend, kills, options.seed, spec, expected)
            _print(tally, backend, options.seed, time.monotonic() - begin)
            is_fine &= not (tally.lost or tally.unequal)
    return 0 if is_fine else 1


def _print(tally: Tally, backend: str, seed: int, seconds: float) -> None:
    print(f"backend         {backend}, seed {seed}")
    print(f"killed          {tally.kills['process']} processes, {tally.kills['worker']} workers")
    print(f"studies         {tally.studies}, the command begun {tally.runs} times")
    print(f"kept at a kill  {tally.kept / tally.kills.total():.1f} trials on average")
    print(f"lost            {tally.lost} trials that had been kept")
    print(f"given up        {tally.failed} trials, run again by nested-agents retry")
    print(f"unequal         {tally.unequal} studies of {tally.studies}")
    print(f"time            {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    sys.exit(main())
