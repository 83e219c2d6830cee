"""Machines and moments that are against a study, as `benchmarks.adversary` makes them.

The command runs as a process of its own, in a circumstance, and then where all is well again. Each
time it must end with the rows of an undisturbed study, or refuse in one line that says why; it must
never set a sound study aside.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.store.database import DATABASE

SPEC = """
seeds = 3
episodes = 2
steps = 10
evaluation = 1
keep_teams = true
scenario = { kind = "line-up", carts = 2 }
"""
CLOCK = """
import itertools, random, time
_now, _back = time.time, itertools.count(1)
time.time = lambda: _now() - 3600.0 * next(_back)
time.time_ns = lambda: int(time.time() * 1e9)
"""
"""A clock that goes back by an hour whenever it is read."""
NO_LOCKS = Path(__file__).parents[1] / "tests" / "studies" / "store" / "no_locks.c"
NO_SHARED = """
mkdir {0}; mount -t tmpfs tmpfs {0}; ln -s /proc/self/fd {0}/fd
for name in null zero full random urandom; do
    touch {0}/$name; mount --bind /dev/$name {0}/$name
done
mount --move {0} /dev"""
"""Makes /dev anew, without shared memory."""
LONGEST = 600.0
"""Seconds after which a command counts as one that hangs."""
LINES = ("status", "table", "compare", "results --format csv", "report", "export", "explain")


class Circumstance(NamedTuple):
    """What is against a command."""

    variables: dict[str, str] = {}  # noqa: RUF012
    """Of its environment."""
    prefix: str = ""
    """A command of the shell that comes before, in a name space of its own."""
    most_bytes: int = 0
    """Of its address space; 0: as many as there are."""
    stops: bool = False
    """Whether its processes are stopped for a while, again and again."""


def circumstances(folder: Path) -> Iterator[tuple[str, Circumstance]]:
    """Yield what can be had on this machine, by name."""
    (folder / "clock").mkdir()
    (folder / "clock" / "sitecustomize.py").write_text(CLOCK)
    yield "a clock that goes back", Circumstance({"PYTHONPATH": str(folder / "clock")})
    yield "SIGSTOP", Circumstance(stops=True)
    (folder / "file").touch()
    nowhere = str(folder / "file" / "nowhere")
    homes = ("HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME")
    caches = ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "PYTHONPYCACHEPREFIX")
    yield "no HOME", Circumstance(dict.fromkeys(homes, nowhere))
    yield "no caches", Circumstance(dict.fromkeys((*homes, *caches), nowhere))
    yield "no TMPDIR", Circumstance(dict.fromkeys(("TMPDIR", "JOBLIB_TEMP_FOLDER"), nowhere))
    ascii_only = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    yield "a terminal of ASCII", Circumstance(ascii_only)
    for megabytes in (300, 600, 900, 4000):
        yield f"{megabytes} MB of addresses", Circumstance(most_bytes=megabytes * 10**6)
    if subprocess.run(["unshare", "-m", "true"], check=False, capture_output=True).returncode == 0:
        (folder / "noexec").mkdir()
        mount = f"mount -t tmpfs -o noexec tmpfs {folder}/noexec"
        yield "a noexec TMPDIR", Circumstance({"TMPDIR": f"{folder}/noexec"}, mount)
        yield "no /dev/shm", Circumstance({}, NO_SHARED.format(f"{folder}/dev"))
        read_only = "mount -t tmpfs -o ro,size=4k tmpfs /dev/shm"
        yield "a read-only /dev/shm", Circumstance({}, read_only)
        full = "mount -t tmpfs -o size=4k tmpfs /dev/shm; cat /dev/zero > /dev/shm/x 2>/dev/null"
        yield "a full /dev/shm", Circumstance({}, full)
    if shutil.which("gcc"):
        library = str(folder / "no_locks.so")
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, NO_LOCKS, "-ldl"], check=True)
        for what in ("shared", "busy", "memory", "locks"):
            preload = {"LD_PRELOAD": library, "FOLDER": what}
            yield f"a network folder, {what}", Circumstance(preload)


def attack(rng: random.Random, folder: Path) -> Counter[str]:
    """Run and read studies in circumstances; return what happened."""
    tally = Counter[str]()
    spec = folder / "spec.toml"
    spec.write_text(SPEC)
    sound = _command(["run", str(spec), "--out", str(folder / "sound")], Circumstance())
    assert sound.returncode == 0, sound.stderr
    expected = _rows(folder / "sound")
    for name, circumstance in circumstances(folder):
        place = folder / "no_locks" / name.replace(" ", "_").replace("/", "_")
        place.mkdir(parents=True)
        shutil.copytree(folder / "sound", place / "whole")
        new, jobs = place / "new", ["--jobs", str(rng.choice([1, 2]))]
        lines = [["run", str(spec), "--out", str(new), *jobs]]
        lines += [[*line.split(), str(place / "whole")] for line in rng.sample(LINES, 2)]
        lines += [["run", str(spec), "--out", str(place / "whole"), *jobs]]
        last = ""
        for line in lines:
            became = _became(name, line, circumstance)
            tally["commands"] += 1
            tally[f"commands: {became}"] += 1
            if line[0] == "run" and became != "done":
                last = _command(["run", *line[1:4]], Circumstance()).stderr
        for study in (new, place / "whole"):
            is_aside = any("damaged" in path.name for path in study.iterdir())
            became = "equal" if _rows(study) == expected and not is_aside else "unequal"
            if became == "unequal":
                print(f"{name}: {study.name}: {last[-600:]}", file=sys.stderr)
            tally[f"studies: {became}"] += 1
    for name, harm in OBSTACLES.items():
        shutil.copytree(folder / "sound", folder / "harmed")
        harm(folder / "harmed")
        for line in rng.sample(LINES, 3):
            tally["commands"] += 1
            became = _became(name, [*line.split(), str(folder / "harmed")], Circumstance())
            tally[f"commands: {became}"] += 1
        shutil.rmtree(folder / "harmed")
    return tally


def _pipe(path: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


def _endless(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to("/dev/zero")


def _huge(path: Path) -> None:
    with open(path, "ab") as file:
        file.truncate(2**40)


def _recording(study: Path) -> Path:
    return next((study / "recordings").glob("*.npz"))


OBSTACLES: dict[str, Callable[[Path], None]] = {
    "study.toml is a pipe": lambda study: _pipe(study / "study.toml"),
    "study.toml has no end": lambda study: _endless(study / "study.toml"),
    "the lock is a pipe": lambda study: _pipe(study / ".lock"),
    "the lock has no end": lambda study: _endless(study / ".lock"),
    "a recording is a pipe": lambda study: _pipe(_recording(study)),
    "a recording has no end": lambda study: _endless(_recording(study)),
    "a recording of a terabyte": lambda study: _huge(_recording(study)),
    "the database is a pipe": lambda study: _pipe(study / DATABASE),
    "the database has no end": lambda study: _endless(study / DATABASE),
}


def _command(line: list[str], circumstance: Circumstance) -> subprocess.CompletedProcess[str]:
    """Run a command in a circumstance."""
    command = [sys.executable, "-m", "nested_agents", *line]
    if circumstance.prefix:
        shell = f'{circumstance.prefix}; exec "$@"'
        command = ["unshare", "-m", "sh", "-c", shell, "sh", *command]

    def limit() -> None:
        if circumstance.most_bytes:
            resource.setrlimit(resource.RLIMIT_AS, (circumstance.most_bytes,) * 2)

    process = subprocess.Popen(
        command, env={**os.environ, **circumstance.variables}, text=True, preexec_fn=limit,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=True, errors="replace",
    )  # fmt: skip
    for _ in range(4 if circumstance.stops else 0):
        time.sleep(0.7)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGSTOP)
            time.sleep(0.7)
            os.killpg(process.pid, signal.SIGCONT)
    try:
        out, error = process.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, error = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, out, error)


def _became(name: str, line: list[str], circumstance: Circumstance) -> str:
    """Return what became of a command."""
    done = _command(line, circumstance)
    shown = f"{name}: {line[0]}: {done.returncode}: {done.stderr[-1500:]}"
    if "Traceback" in done.stderr:
        print(shown, file=sys.stderr)
        return "traceback"
    if done.returncode == -signal.SIGKILL:
        print(shown, file=sys.stderr)
        return "hung"
    if done.returncode == 0:
        return "done"
    refusal = [text for text in done.stderr.splitlines() if text.startswith("nested-agents: error")]
    if len(refusal) == 1:
        print(shown, file=sys.stderr)  # to be read: is it the reason?
        return "refused in one line"
    print(shown, file=sys.stderr)
    return "refused at length"


def _rows(study: Path) -> str:
    """Return the rows of a study as text."""
    with contextlib.redirect_stdout(out := io.StringIO()):
        command_line(["results", str(study), "--format", "csv"])
    return out.getvalue()
