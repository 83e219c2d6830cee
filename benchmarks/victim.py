"""A finished study that is harmed again and again, and what commands make of it."""

from __future__ import annotations

import contextlib
import io
import random
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from pathlib import Path

from nested_agents.core.interface.measures import Measure
from nested_agents.studies.api import explaining, running
from nested_agents.studies.api.loading import load
from nested_agents.studies.catalogue import learning_curve
from nested_agents.studies.cli.main import main as command_line
from nested_agents.studies.errors import SpecError
from nested_agents.studies.report import page
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.database import DATABASE
from nested_agents.studies.store.store import Store
from nested_agents.studies.store.writer import LOCK
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.keeping import open_to_run, pending, spec_of
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import Trial, TrialResult, trials_of
from nested_agents.studies.workers.runner import Outcome, RunTrial, Workers, attempt, save

SPEC = Spec.of(
    {"seeds": 3, "episodes": 2, "steps": 10, "evaluation": 1, "keep_teams": True,
     "sweep": {"scenario.robots": [1, 2, 3]}}
)  # fmt: skip
EXPLAIN = "explain"
TEAM = "na.load(...).team()"
"""No command: what a user reads in Python."""
LINES = (
    "results --format csv", "status", "table --format csv", "compare", "compare --statistics",
    "fit --measure return", "report", "export", "export --format json", TEAM,
)  # fmt: skip
"""The commands that read."""

Answer = tuple[int, str, str]
"""Exit status, output and errors of a command."""
ANSWERS: dict[str, Answer] = {}
"""What commands make of the sound study; the same wherever it is."""


def without_figures() -> None:
    """Draw nothing: figures are of what has been verified, and take most time."""
    learning_curve.draw = lambda analysis: {}
    explaining.draw = lambda explanation: {}
    page.hierarchy_pictures = lambda *_: ([], "")


@cache
def _run_once() -> tuple[tuple[Measure, ...], tuple[Trial, ...], dict[str, TrialResult]]:
    """Return what the study measures, its trials, and by identity what they measured."""
    measures, trials = check_conditions(SPEC), trials_of(SPEC)
    return measures, trials, {trial.identity: run_trial(trial) for trial in trials}


class Adversary:
    """A finished study, which is damaged and mended again and again.

    Parameters
    ----------
    folder
        Where to work.
    rng
        Draws the damage.
    lines
        The commands whose answers of the sound study are needed.
    """

    def __init__(self, folder: Path, rng: random.Random, lines: Sequence[str] = ()) -> None:
        self.sound, self.study, self.rng = folder / "sound", folder / "study", rng
        self.measures, self.trials, self.results = _run_once()
        self.finish(self.sound)
        self.expected = self.content(self.sound)
        shutil.copytree(self.sound, self.study)
        for line in lines:
            if line not in ANSWERS:
                ANSWERS[line] = self.command(line)
        self.files = [p for p in sorted(self.sound.rglob("*")) if p.is_file() and p.stat().st_size]

    def command(self, line: str) -> Answer:
        """Run a command on the study in this process; say `here` for where it is."""
        status, out, error = self.team() if line == TEAM else self._command(line)
        place = str(self.study.parent)
        return status, out.replace(place, "here"), error.replace(place, "here")

    def _command(self, line: str) -> Answer:
        name, *options = line.split()
        out, error = io.StringIO(), io.StringIO()
        if name in ("report", "export"):
            shutil.rmtree(self.study.parent / "written", ignore_errors=True)
            written = self.study.parent / "written"
            written.mkdir()
            options += ["--out", str(written / "page.html" if name == "report" else written)]
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = command_line([name, str(self.study), *options])
        text = out.getvalue()
        if name in ("report", "export") and status == 0:
            text += "".join(p.read_text() for p in sorted(written.iterdir()))
        if name == EXPLAIN and status == 0:
            text += next(self.study.glob("explain/*/explanation.txt")).read_text()
        return status, text, error.getvalue()

    def team(self) -> Answer:
        """Load the team that was trained first, as a user's script does."""
        try:
            with contextlib.redirect_stderr(error := io.StringIO()):
                _, team = load(self.study).team()
        except SpecError as refusal:
            return 2, "", str(refusal)
        arrays = {name: array.tolist() for name, array in team.state_dict().items()}
        return 0, str(arrays), error.getvalue()

    def finish(self, directory: Path) -> list[str]:
        """Run what is left of a study; return what had to be said."""
        with open_to_run(directory, SPEC, self.trials, self.measures) as store:
            for trial in pending(store, self.trials):
                save(store, trial, self.result(trial), 1.0)
            return store.notes

    def result(self, trial: Trial) -> TrialResult:
        """Return what a trial measures: a function of it, so that it is run once only."""
        if trial.identity not in self.results:
            self.results[trial.identity] = run_trial(trial)
        return self.results[trial.identity]

    def repeat(self, _: RunTrial, trial: Trial) -> Outcome:
        """Return in a moment what came of a trial, for `inline`."""
        time.sleep(0.08)
        return Outcome(trial, None, 1.0, self.result(trial))

    def content(self, directory: Path) -> object:
        """Return all that a study has found."""
        with Store.open(directory) as store:
            store.verify()
            names, episodes = store.episodes()
            kept = names, list(episodes)
            rows = kept, store.planned(), store.columns(), spec_of(store) == SPEC
        paths = sorted((directory / "recordings").glob("[!.]*.npz"))
        return rows, [(path.name, path.read_bytes()) for path in paths]

    def damage(self) -> Path:
        """Flip a bit of a file, mostly where it is not empty; return the file."""
        weights = [p.stat().st_size ** 0.5 for p in self.files]
        source = self.rng.choices(self.files, weights)[0]
        data = bytearray(source.read_bytes())
        places = [i for i, byte in enumerate(data) if byte] if self.rng.random() < 0.7 else data
        at = self.rng.choice(places) if places is not data else self.rng.randrange(len(data))
        data[at] ^= 1 << self.rng.randrange(8)
        path = self.study / source.relative_to(self.sound)
        path.write_bytes(data)
        return path

    def restore(self) -> None:
        """Make the study sound again."""
        shutil.rmtree(self.study)
        shutil.copytree(self.sound, self.study)


class Inline(Workers):
    """Workers that are a thread of this process.

    Parameters
    ----------
    run
        Runs a trial.
    """

    processes = 1

    def __init__(self, run: Callable[[RunTrial, Trial], Outcome] = attempt) -> None:
        self._run = run
        self._thread = ThreadPoolExecutor(1)

    def submit(self, run_trial: RunTrial, trial: Trial) -> Future[Outcome]:
        """See `Workers.submit`."""
        return self._thread.submit(self._run, run_trial, trial)

    def fetch(self, future: Future[Outcome], trial: Trial) -> Outcome:
        """See `Workers.fetch`."""
        return future.result()

    def stop(self, futures: Sequence[Future[Outcome]]) -> None:
        """See `Workers.stop`."""
        self._thread.shutdown(cancel_futures=True)


@contextlib.contextmanager
def inline(run: Callable[[RunTrial, Trial], Outcome] = attempt) -> Iterator[None]:
    """Let studies run by a thread of this process; in forked children, too."""
    usual = running.start_workers
    running.start_workers = lambda *_: contextlib.nullcontext(Inline(run))
    try:
        yield
    finally:
        running.start_workers = usual


def read(adversary: Adversary, line: str, path: Path) -> str:
    """Return what a command that reads makes of a study of which a file is harmed."""
    try:
        answer = adversary.command(line)
    except BaseException:
        print(f"{line}, {path.name}:\n{traceback.format_exc()}", file=sys.stderr)
        return "traceback"
    if answer == ANSWERS[line]:
        return "equal"
    is_reported = (
        path.name in answer[1] + answer[2] or "recording is missing or damaged" in answer[1]
    )
    if is_reported:
        return "told"
    print(f"{line}, {path.name}: silence: {answer[2]}", file=sys.stderr)
    return "silence"


def mended(adversary: Adversary, path: Path) -> str:
    """Return what a run makes of a study of which a file is damaged.

    A run repeats damaged trials. It refuses a database that is damaged as a whole and changes
    nothing then.
    """
    study = adversary.study
    before = _files(study)
    try:
        adversary.finish(study)
        is_equal = adversary.content(study) == adversary.expected
        is_equal &= not adversary.finish(study)  # one run is enough
    except SpecError as refusal:
        is_named = path.name == DATABASE and DATABASE in str(refusal)
        return "run: refused" if is_named and _files(study) == before else "run: unequal"
    except BaseException:
        print(f"run, {path.name}:\n{traceback.format_exc()}", file=sys.stderr)
        return "run: traceback"
    return "run: equal" if is_equal else "run: unequal"


def _files(directory: Path) -> dict[Path, bytes]:
    """Return the content of each file of a study except its lock."""
    return {p: p.read_bytes() for p in directory.rglob("*") if p.is_file() and p.name != LOCK}
