"""Attack studies and inputs, and count what survives: ``python -m benchmarks.adversary``.

Campaigns, each drawn from a seed:

- *kills*: the command that runs a study is killed (SIGKILL) at a random moment, the same command
  continues, and what it ends with must be equal byte by byte. Trials run in the process of the
  command and take no time, so that a hundred kills do not take an hour; `benchmarks.crashes` kills
  real workers;
- *kills of others*: explain, export, report, retry and tune are killed. What they have written is
  whole or not there; the study is as it was, or the same command goes on, with the same end;
- *edits* and *published files*, see `benchmarks.edits`: what somebody else has made of results;
- *environments*, see `benchmarks.environments`: refused, or perceived as they are;
- *circumstances*, see `benchmarks.circumstances`: clocks, disks, memory and signals;
- *flips*: one bit of one file of a finished study is flipped. Commands that read, and Python that
  loads a trained team, must give what they gave before, or name the file; a run must end with the
  rows and recordings of the sound study. `explain`, which draws, reads every tenth, and a run every
  fourth. A file may also be cut short or be a folder. With ``--every-byte`` every byte of a small
  database is tried;
- *hostile input*: specs, topologies in files and in Python, polygons, mutated or absurd. Each is
  accepted or refused in one line, within seconds;
- *scenarios* that misbehave, see `benchmarks.misbehaving`: they are told, and others go on.

Silence (other output, nothing said) and tracebacks are failures.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from nested_agents.scenarios.box_pushing.world.boxes import BoxSpec
from nested_agents.studies.api import running as studies_run
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store import durable
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import LOCK
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.workers.runner import save

from . import circumstances, edits, environments, misbehaving
from .victim import EXPLAIN, LINES, SPEC, Adversary, Here, mended, read

SLOW, BLOCKED = 10.0, 60.0
"""Seconds, of the processor and by the clock, after which an input counts as one that stalls."""


def kills(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Kill the command that runs a study, again and again; return what happened."""
    adversary, tally = Adversary(folder, rng), Counter[str]()
    spec = folder / "spec.toml"
    spec.write_text(dumps(SPEC.table()))
    # Figures are no results; without them most kills fall into the run itself.
    learning_curve.draw = lambda analysis: {}
    studies_run.start_workers = (  # in the children too, which are copies of this process
        lambda *_: contextlib.nullcontext(Here(adversary))
    )
    begin = time.monotonic()
    assert _wait(_child(["run", str(spec), "--out", str(folder / "timed")])) == 0
    whole = time.monotonic() - begin
    while tally["kills"] < number:
        directory = folder / str(tally["studies"])
        tally["studies"] += 1
        kept: set[str] = set()
        while True:
            child = _child(["run", str(spec), "--out", str(directory)])
            if tally["kills"] < number and rng.random() < 0.8:
                time.sleep(rng.uniform(0.0, whole))
                os.kill(child, signal.SIGKILL)
            status = _wait(child)
            now = _kept(directory)
            tally["lost trials"] += len(kept - now)
            kept = now
            if status == -signal.SIGKILL:
                tally["kills"] += 1
                tally["kills with trials kept, and others left"] += (
                    0 < len(kept) < len(adversary.trials)
                )
            else:
                tally["refused"] += status != 0
                break
        equal = adversary.content(directory) == adversary.expected
        tally["studies: equal" if equal else "studies: unequal"] += 1
    return tally


OTHERS = ("explain", "export", "report", "retry", "tune")
"""Commands that write, beside `run`."""
TUNED = {"tune": {"learner.discount": [0.2, 0.4, 0.6, 0.8]}}


def kills_of_others(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Kill commands that write beside a study, `retry` and `tune`; return what happened."""
    adversary, tally = Adversary(folder, rng), Counter[str]()
    studies_run.start_workers = lambda *_: contextlib.nullcontext(Here(adversary))
    failed, spec = folder / "failed", folder / "tuned.toml"
    spec.write_text(dumps(Spec.of({"episodes": 2, "steps": 10, "evaluation": 1} | TUNED).table()))
    with open_to_run(failed, SPEC, adversary.trials, adversary.measures) as store:
        for trial in adversary.trials[:5]:
            store.fail(trial.planned, "Traceback: a fault")
        for trial in adversary.trials[5:]:
            save(store, trial, adversary.result(trial), 1.0)

    def line(name: str, place: Path) -> list[str]:
        """Return a command on a fresh copy of the study, which it writes beside."""
        study, out = str(place / "study"), place / ("page.html" if name == "report" else "out")
        if name == "tune":
            return [name, str(spec), "--out", study, "--trials", "4", "--seeds", "4"]
        shutil.copytree(failed if name == "retry" else adversary.sound, study)
        return [name, study, *([] if name in ("retry", "explain") else ["--out", str(out)])]

    whole: dict[str, tuple[float, dict[str, bytes], object]] = {}
    for name in OTHERS:
        place = folder / "whole" / name
        place.mkdir(parents=True)
        command, begin = line(name, place), time.monotonic()
        assert _wait(_child(command)) == 0, name
        seconds = time.monotonic() - begin
        whole[name] = seconds, _written(place), adversary.content(place / "study")
    while tally["kills"] < number:
        name, place = rng.choice([*whole]), folder / f"k{tally['kills']}"
        place.mkdir()
        tally["kills"] += 1
        seconds, expected, content = whole[name]
        command = line(name, place)
        child = _child(command)
        time.sleep(rng.uniform(0.0, seconds))
        os.kill(child, signal.SIGKILL)
        _wait(child)
        halves = {path for path, data in _written(place).items() if expected.get(path) != data}
        # What is there whole before the kill is not written over: that is refused.
        is_whole = expected and _written(place) == expected and name in ("export", "report")
        status = 0 if is_whole else _wait(_child(command))
        is_equal = adversary.content(place / "study") == content
        if halves or status or not is_equal or _written(place) != expected:
            print(f"{name}: {halves}, status {status}, study equal {is_equal}", file=sys.stderr)
            tally[f"{name}: torn"] += 1
        else:
            tally[f"{name}: equal"] += 1
        shutil.rmtree(place)
    return tally


def _written(place: Path) -> dict[str, bytes]:
    """Return what a command has written, by path, but a study itself and hidden files."""
    paths = [path for path in place.rglob("*") if path.is_file() and path.name[0] != "."]
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in paths
        if not path.name.startswith((DATABASE, "running.json", "study.toml"))
        and path.parent.name not in ("recordings", "figures", "sources")
    }


def _child(line: list[str]) -> int:
    """Begin a command in a copy of this process; return its number."""
    child = os.fork()
    if child == 0:
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        os._exit(command_line(line))
    return child


def _wait(child: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _kept(directory: Path) -> set[str]:
    """Return the identities of the trials that are kept, and sound."""
    try:
        with Store.open(directory) as store:
            store.verify()
            names, rows = store.trials()
            return {row[names.index("identity")] for row in rows}
    except SpecError as error:
        if re.search("holds no study", str(error)):
            return set()  # killed before the study was noted
        raise


def flips(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Flip bits one by one, read the study, and mend it every fourth time; return what happened."""
    learning_curve.draw = lambda analysis: {}  # of rows that have been verified; takes most time
    adversary, tally = Adversary(folder, rng, (*LINES, EXPLAIN)), Counter[str]()
    for attempt in range(number):
        tally["flips"] += 1
        path = adversary.damage()
        lines = [*LINES, *([EXPLAIN] if attempt % 10 == 0 else [])]
        for line in lines:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
        if attempt % 4 == 0:
            tally["runs"] += 1
            tally[mended(adversary, path)] += 1
        adversary.restore()
    return tally


def every_byte(rng: random.Random, folder: Path) -> Counter[str]:
    """Flip a bit in every byte of the database, one after the other, and read the study."""
    adversary, tally = Adversary(folder, rng), Counter[str]()
    path = adversary.study / DATABASE
    sound = path.read_bytes()
    for at in range(len(sound)):
        tally["flips"] += 1
        data = bytearray(sound)
        data[at] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        for line in LINES[:2]:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
    return tally


def obstacles(rng: random.Random, folder: Path) -> Counter[str]:
    """Put folders in place of files, and the other way round, and cut files short."""
    adversary, tally = Adversary(folder, rng), Counter[str]()

    def attack(path: Path, how: Callable[[], object]) -> None:
        how()
        for line in LINES:
            tally["reads"] += 1
            tally[read(adversary, line, path)] += 1
        adversary.restore()

    for name in (LOCK, DATABASE, f"{DATABASE}-wal", f"{DATABASE}-shm"):
        path = adversary.study / name
        attack(path, lambda path=path: (path.unlink(missing_ok=True), path.mkdir()))
    for source in adversary.files:
        path, size = adversary.study / source.relative_to(adversary.sound), source.stat().st_size
        for cut in (1, size // 2, size):
            attack(path, lambda path=path, to=size - cut: path.write_bytes(path.read_bytes()[:to]))
    return tally


def hostile(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Offer specs, topologies and polygons in turn; return what became of them."""
    makers = {
        "specs": _specs(rng),
        "topologies": _topologies(rng),
        "polygons": _polygons(rng),
        "functions": misbehaving.topologies(rng),
    }
    tally = Counter[str]()
    for attempt in range(number):
        kind = list(makers)[attempt % len(makers)]
        tally[kind] += 1
        attack = next(makers[kind])
        begin, used = time.monotonic(), time.process_time()
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                became = attack(folder)
            except BaseException:
                print(f"{kind}:\n{traceback.format_exc()}", file=sys.stderr)
                became = "traceback"
        if time.monotonic() - begin > BLOCKED or time.process_time() - used > SLOW:
            became = "stalled"
        if any(issubclass(w.category, RuntimeWarning) for w in warned):
            became = "warned"
        tally[f"{kind}: {became}"] += 1
    return tally


Attack = Callable[[Path], str]
VALUES = (
    "-1", "0", "1e999", "nan", "true", '""', "[]", "{}", '"\\u0000"', '"' + "x" * 5000 + '"',
    "[[[[[1]]]]]", "99999999999999999999", '"chain:a,a"', '"nothing.py:x"', "1979-05-27",
)  # fmt: skip
KEYS = (
    "seeds", "episodes", "steps", "evaluation", "preset", "study", "topology", "scenario.robots",
    "scenario.box", "scenario.robot", "scenario.failures", "learner.kind", "learner.discount",
    "learner.decision", "sweep.preset", "overrides", "evaluations.x", "k" * 5000,
    "scenario.x\\u001b",
)  # fmt: skip


def _specs(rng: random.Random) -> Iterator[Attack]:
    """Yield specs that are mutated byte by byte, or hold a strange value."""
    sound = (
        b'study = "learning-curve"\nseeds = 2\nepisodes = 3\n[scenario]\nrobots = 2\nbox = "L"\n'
        b'[topology]\nkind = "tree"\n[learner]\nridge = 3.0\n'
        b'[sweep]\npreset = ["default", "paper"]\n'
    )
    while True:
        data = bytearray(sound)
        kind = rng.randrange(3)
        if kind == 0:
            for _ in range(rng.randrange(1, 4)):
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif kind == 1:
            key = rng.choice(KEYS)
            head, _, tail = key.rpartition(".")
            table = f"[{head}]\n" if head else ""
            data = bytearray(f'{table}"{tail}" = {rng.choice(VALUES)}\n'.encode())
        else:
            depth = rng.choice([10, 1000, 100_000])
            data = bytearray(b"seeds = " + b"[" * depth + b"]" * depth + b"\n")

        def attack(folder: Path, data: bytes = bytes(data)) -> str:
            (folder / "spec.toml").write_bytes(data)
            try:
                Spec.load(folder / "spec.toml")
            except SpecError as error:
                return "refused in one line" if "\n" not in str(error) else "refused at length"
            return "accepted"

        yield attack


def _topologies(rng: random.Random) -> Iterator[Attack]:
    """Yield files of graphs."""
    names = [
        "a",
        "b",
        "c",
        1,
        None,
        0.5,
        True,
        "",
        "\x1b[31m",
        "x\ny",
        "\ud800",
        "n" * 5000,
        [],
        {},
    ]
    names += ["a", "b", "c", "d"] * 5
    graphml = (
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns"><graph edgedefault="directed">'
        '<node id="a"/><node id="b"/><edge source="a" target="b"/></graph></graphml>'
    )
    while True:
        kind, suffix = rng.randrange(4), "json"
        pairs = [[rng.choice(names), rng.choice(names)] for _ in range(rng.randrange(1, 4))]
        if kind == 0:
            text = json.dumps({"edges": pairs}).replace("0.5", rng.choice(["NaN", "1e999", "0.5"]))
        elif kind == 1:
            nodes = [{"id": rng.choice(names)} if rng.random() < 0.7 else rng.choice(names)]
            links = [{"source": a, "target": b} if rng.random() < 0.8 else [a, b] for a, b in pairs]
            text = json.dumps({"nodes": nodes * rng.randrange(1, 3), "links": links})
        elif kind == 2:
            depth = rng.choice([100, 100_000])
            text = '{"edges": ' + "[" * depth + "]" * depth + "}"
        else:
            data, suffix = bytearray(graphml.encode()), "graphml"
            at = rng.randrange(len(data))
            data[at : at + rng.randrange(1, 9)] = rng.randbytes(rng.randrange(3))
            text = data.decode("utf-8", "replace")

        def attack(folder: Path, text: str = text, suffix: str = suffix) -> str:
            path = folder / f"graph.{suffix}"
            path.write_bytes(text.encode("utf-8", "surrogatepass"))
            out, error = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
                status = command_line(["topology", "show", str(path)])
            message = error.getvalue()
            if status == 0:
                return "accepted" if out.getvalue().replace("\n", "").isprintable() else "raw"
            one_line = (
                message.count("\n") == 1 and message[:-1].isprintable() and path.name in message
            )
            return "refused in one line" if one_line else "refused at length"

        yield attack


def _polygons(rng: random.Random) -> Iterator[Attack]:
    """Yield outlines of boxes."""
    while True:
        count = rng.choice([1, 2, 3, 5, 12, 50, 300, 1000, 1001, 20_000])
        size = 10.0 ** rng.choice([-12, -4, -1, -1, -1, -1, -1, 0, 0, 2, 9, 308])
        radii = [rng.uniform(0.3, 1.0) * size for _ in range(count)]
        angles = [2 * math.pi * i / count for i in range(count)]
        ring = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]
        change = rng.randrange(9)
        if change == 0:
            ring.append(ring[0])
        elif change == 1:
            ring.insert(rng.randrange(count), rng.choice(ring))
        elif change == 2:
            ring[rng.randrange(count)] = (rng.choice([math.nan, math.inf, -1e308]), 0.0)
        elif change == 3:
            rng.shuffle(ring)

        def attack(folder: Path, ring: object = tuple(ring)) -> str:
            try:
                box = BoxSpec("attack", ring)  # type: ignore[arg-type]
            except ValueError as error:
                return "refused in one line" if "\n" not in str(error) else "refused at length"
            area = sum(_area(piece.tolist()) for piece in box.fixtures)
            return "accepted" if math.isclose(area, box.area, rel_tol=1e-6) else "unlike its pieces"

        yield attack


def _area(ring: list[list[float]]) -> float:
    following = [*ring[1:], ring[0]]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(ring, following, strict=True)) / 2


Campaign = Callable[[int, random.Random, Path], Counter[str]]
"""Attacks so many times, drawn from a generator, in a folder; returns what happened."""
ATTEMPTS = (
    "kills", "edits", "published files", "environments", "commands", "flips", "reads", "runs",
    "studies", "specs", "topologies", "polygons", "functions", "scenarios",
)  # fmt: skip
FINE = (
    "equal", "told", "run: equal", "studies: equal", "kills with trials kept, and others left",
    "accepted", "refused in one line", ": told", "right", "done", "not reached",
)  # fmt: skip


def _failures(tally: Counter[str]) -> int:
    return sum(n for name, n in tally.items() if name not in ATTEMPTS and not name.endswith(FINE))


def main() -> int:
    """Attack, print the table; 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.adversary", description=__doc__)
    parser.add_argument("--kills", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--flips", type=int, default=2000, metavar="N", help="0: none")
    parser.add_argument("--hostile", type=int, default=800, metavar="N", help="0: none")
    parser.add_argument("--others", type=int, default=60, metavar="N", help="kills; 0: none")
    parser.add_argument("--scenarios", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--every-byte", action="store_true", help="takes a quarter of an hour")
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--edits", type=int, default=300, metavar="N", help="by SQL; 0: none")
    parser.add_argument("--published", type=int, default=100, metavar="N", help="0: none")
    parser.add_argument("--environments", type=int, default=200, metavar="N", help="0: none")
    parser.add_argument("--circumstances", action="store_true", help="takes some minutes")
    options = parser.parse_args()
    durable.os.fsync = lambda _: None  # type: ignore[attr-defined]  # no power fails here
    campaigns: dict[str, tuple[int, Campaign]] = {
        "kill -9": (options.kills, kills),
        "kill -9 of others that write": (options.others, kills_of_others),
        "flipped bits": (options.flips, flips),
        "files cut short, folders in their place": (
            options.flips, lambda _, rng, folder: obstacles(rng, folder)
        ),
        "edits by SQL": (options.edits, edits.sql),
        "published files": (options.published, edits.published),
        "hostile input": (options.hostile, hostile),
        "scenarios that misbehave": (options.scenarios, misbehaving.scenarios),
        "environments": (
            options.environments, lambda number, rng, _: environments.attack(number, rng)
        ),
        "circumstances": (
            options.circumstances, lambda _, rng, folder: circumstances.attack(rng, folder)
        ),
        "a bit of every byte of the database": (
            options.every_byte, lambda _, rng, folder: every_byte(rng, folder)
        ),
    }  # fmt: skip
    begin, failed = time.process_time(), 0
    print("| attack | attempts | what became of them | failures |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        for title, (number, campaign) in campaigns.items():
            if not number:
                continue
            folder = Path(name) / title.replace(" ", "-")
            folder.mkdir()
            tally = campaign(number, random.Random(options.seed), folder)
            failed += _failures(tally)
            tried = ", ".join(f"{tally[what]} {what}" for what in ATTEMPTS if tally[what])
            became = ", ".join(
                f"{what} {n}" for what, n in sorted(tally.items()) if what not in ATTEMPTS
            )
            print(f"| {title} | {tried} | {became} | {_failures(tally)} |", flush=True)
    print(f"\nseed {options.seed}, {time.process_time() - begin:.0f} s of processor time, ", end="")
    print(f"{failed} failures")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
