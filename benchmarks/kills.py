"""Commands that write, killed at random moments, for `benchmarks.adversary`."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import sys
import time
from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.spec.tables import dumps
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.workers.runner import save

from .victim import SPEC, Adversary, inline, without_figures


def kills(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Kill the command that runs a study, again and again; return what happened."""
    adversary, tally = Adversary(folder, rng), Counter[str]()
    spec = folder / "spec.toml"
    spec.write_text(dumps(SPEC.table()))
    without_figures()  # so that most kills fall into the run itself
    with inline(adversary.repeat):
        begin = time.monotonic()
        assert _wait(_child(["run", str(spec), "--out", str(folder / "timed")])) == 0
        whole = time.monotonic() - begin
        while tally["kills"] < number:
            directory = folder / str(tally["studies"])
            tally["studies"] += 1
            _run_killed(
                number, whole, adversary, ["run", str(spec), "--out", str(directory)], tally
            )
            is_equal = adversary.content(directory) == adversary.expected
            tally["studies: equal" if is_equal else "studies: unequal"] += 1
    return tally


def _run_killed(
    number: int, whole: float, adversary: Adversary, line: list[str], tally: Counter[str]
) -> None:
    """Begin a command that takes `whole` seconds until none kills it; note what happened."""
    kept: set[str] = set()
    while True:
        child = _child(line)
        if tally["kills"] < number and adversary.rng.random() < 0.8:
            time.sleep(adversary.rng.uniform(0.0, whole))
            os.kill(child, signal.SIGKILL)
        status = _wait(child)
        now = _kept(Path(line[-1]))
        tally["lost trials"] += len(kept - now)
        kept = now
        if status != -signal.SIGKILL:
            tally["refused"] += status != 0
            return
        tally["kills"] += 1
        is_amid = 0 < len(kept) < len(adversary.trials)
        tally["kills with trials kept, and others left"] += is_amid


OTHERS = {
    "compare": ["--out", "page.html", "--plot", "plot.svg"],
    "explain": [],
    "export": ["--out", "out"],
    "fit": ["--measure", "return", "--plot", "plot.png"],
    "report": ["--out", "page.html"],
    "retry": [],
    "tune": ["--trials", "4", "--seeds", "4"],
}
"""Commands that write, beside `run`, with what they are given beside a study."""
PLACE = "place"
"""Where they all work: pages name the folder of their study."""
TUNED = {"tune": {"learner.discount": [0.2, 0.4, 0.6, 0.8]}}


class Line(NamedTuple):
    """A command that writes, undisturbed."""

    words: list[str]
    seconds: float
    written: dict[str, bytes]
    """What it writes beside the study, by path."""
    content: object
    """Of the study afterwards."""


def kills_of_others(number: int, rng: random.Random, folder: Path) -> Counter[str]:
    """Kill commands that write beside a study, `retry` and `tune`; return what happened."""
    adversary, tally = Adversary(folder, rng), Counter[str]()
    tuned = {"episodes": 2, "steps": 10, "evaluation": 1} | TUNED
    (folder / "tuned.toml").write_text(dumps(Spec.of(tuned).table()))
    with open_to_run(folder / "failed", SPEC, adversary.trials, adversary.measures) as store:
        for trial in adversary.trials[:5]:
            store.fail(trial.planned, "Traceback: a fault")
        for trial in adversary.trials[5:]:
            save(store, trial, adversary.result(trial), 1.0)
    with inline(adversary.repeat):
        undisturbed = cache(lambda name: _undisturbed(name, adversary, folder))
        while tally["kills"] < number:
            name = rng.choice([*OTHERS])
            tally["kills"] += 1
            tally[f"{name}: {_killed(name, undisturbed(name), adversary, folder)}"] += 1
    return tally


def _words(name: str, folder: Path) -> list[str]:
    """Return a command on a fresh copy of a study, which it writes beside."""
    place = folder / PLACE
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    study = place / "study"
    options = [str(place / word) if word == "out" or "." in word else word for word in OTHERS[name]]
    if name == "tune":
        return [name, str(folder / "tuned.toml"), "--out", str(study), *options]
    shutil.copytree(folder / ("failed" if name == "retry" else "sound"), study)
    return [name, str(study), *options]


def _undisturbed(name: str, adversary: Adversary, folder: Path) -> Line:
    """Run a command, and return what it does."""
    words, place = _words(name, folder), folder / PLACE
    begin = time.monotonic()
    assert _wait(_child(words)) == 0, name
    seconds = time.monotonic() - begin
    return Line(words, seconds, _written(place), adversary.content(place / "study"))


def _killed(name: str, line: Line, adversary: Adversary, folder: Path) -> str:
    """Kill a command, give it once more, and return what became of it."""
    words, place = _words(name, folder), folder / PLACE
    child = _child(words)
    time.sleep(adversary.rng.uniform(0.0, line.seconds))
    os.kill(child, signal.SIGKILL)
    _wait(child)
    before = _written(place)
    halves = {path for path, data in before.items() if line.written.get(path) != data}
    # What is there whole before the kill is not written over: that is refused.
    is_whole = before == line.written and name in ("export", "report")
    status = 0 if is_whole else _wait(_child(words))
    is_equal = adversary.content(place / "study") == line.content
    if not (halves or status) and is_equal and _written(place) == line.written:
        return "equal"
    print(f"{name}: {halves}, status {status}, study equal {is_equal}", file=sys.stderr)
    return "torn"


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
