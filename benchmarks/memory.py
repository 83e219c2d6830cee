"""What processes and large studies take of memory and time: ``python -m benchmarks.memory``.

First a worker: its resident memory after each thing that it imports, up to a trial of two steps.
Then a study of many made-up trials: processor time and greatest memory of the commands that read
it. Its rows are written as those of any study, but not waited for.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np
from rich.console import Console

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.episodes import EpisodeRow
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.trial import Trial, TrialResult, trials_of
from nested_agents.studies.workers.runner import save

from .startup import used_by
from .tables import Row, show

STAGES = {
    "Python": "",
    "numpy": "import numpy",
    "pydantic": "import pydantic",
    "session of a trial": "import nested_agents.studies.trials.session",
    "Box2D": "import Box2D",
    "scenario": "import nested_agents.scenarios.box_pushing.scenario",
    "numba": "import numba",
    "scipy.linalg": "import scipy.linalg",
    "a trial of two steps": (
        "from nested_agents.studies.spec.spec import Spec\n"
        "from nested_agents.studies.trials.session import run_trial\n"
        "from nested_agents.studies.trials.trial import trials_of\n"
        "spec = Spec.of({'seeds': 1, 'episodes': 1, 'steps': 2, 'evaluation': 1})\n"
        "run_trial(trials_of(spec)[0])"
    ),
}
"""What a worker does, one after the other."""

RESIDENT = """
import sys
for stage in sys.argv[1:]:
    exec(stage)
    lines = open("/proc/self/smaps_rollup").read().splitlines()[1:]
    kilobytes = {name: int(rest.split()[0]) for name, rest in (l.split(":", 1) for l in lines)}
    private = kilobytes["Private_Clean"] + kilobytes["Private_Dirty"]
    print(kilobytes["Rss"] / 1024, private / 1024)
"""

RUN = ["run", "DIR/study.toml", "--out", "DIR"]
COMMANDS = (
    ["status", "DIR"], ["table", "DIR"], ["compare", "DIR"], ["compare", "DIR", "--statistics"],
    ["results", "DIR", "--format", "csv"], ["export", "DIR", "--overwrite"],
    ["export", "DIR", "--format", "json", "--overwrite"], ["report", "DIR"], RUN,
)  # fmt: skip
LOAD = "import sys, nested_agents as na; na.load(sys.argv[1])"
WORKER = {"after": "after", "resident": "resident\n\\[MB]", "private": "private\n\\[MB]"}
STUDY = {
    "command": "command", "wall": "time\n\\[s]", "s": "processor\n\\[s]",
    "peak": "greatest\n\\[MB]",
}  # fmt: skip


def worker() -> list[Row]:
    """Return the memory of a process after each stage; kernels are compiled beforehand."""
    rows: list[Row] = []
    for _ in range(2):
        line = [sys.executable, "-c", RESIDENT, *STAGES.values()]
        output = subprocess.run(line, capture_output=True, text=True, check=True).stdout
        sizes = [map(float, line.split()) for line in output.splitlines()]
        rows = [
            {"after": name, "resident": round(resident), "private": round(private)}
            for name, (resident, private) in zip(STAGES, sizes, strict=True)
        ]
    return rows


def fill(directory: Path, conditions: int, seeds: int, episodes: int) -> None:
    """Make a study whose results are random numbers."""
    steps = np.linspace(0.01, 0.9, conditions).round(4).tolist()
    spec = Spec.of(
        {
            "seeds": seeds, "episodes": episodes, "steps": 8, "evaluation": 5,
            "scenario": {"kind": "line-up"}, "sweep": {"learner.discount": steps},
        }
    )  # fmt: skip
    trials = trials_of(spec)
    opened = open_to_run(directory, spec, trials, check_conditions(spec))
    with mock.patch("os.fsync"), opened as store:
        store._db.execute("PRAGMA synchronous = OFF")
        for trial in trials:
            save(store, trial, made_up(trial, store), total=1.0)


def made_up(trial: Trial, store: Store) -> TrialResult:
    """Return random numbers as the result of a trial."""
    rng = np.random.default_rng(int(trial.identity, 16))
    measures = store.measures()
    rows = tuple(
        EpisodeRow(
            phase, episode, int(rng.integers(1, trial.steps + 1)),
            {m.name: bool(rng.random() < 0.5) if m.is_rate else rng.random() for m in measures},
            rng.random(),
        )
        for phase, many in (("training", trial.episodes), ("evaluation", trial.evaluation))
        for episode in range(many)
    )  # fmt: skip
    seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), 0.1)
    return TrialResult(rows, measures, {}, seconds)


def commands(directory: Path) -> list[Row]:
    """Return what each command takes, and `nested_agents.load`."""
    lines = {
        " ".join(word for word in words if "DIR" not in word): _line(words, directory)
        for words in COMMANDS
    }
    lines["na.load"] = ["-c", LOAD, str(directory)]
    rows: list[Row] = []
    for name, line in lines.items():
        begin = time.perf_counter()
        used = used_by(line, stderr=subprocess.DEVNULL)
        wall = time.perf_counter() - begin
        spent = used.ru_utime + used.ru_stime
        peak = round(used.ru_maxrss / 1024)
        rows.append({"command": name, "wall": wall, "s": spent, "peak": peak})
    return rows


def _line(words: list[str], directory: Path) -> list[str]:
    return ["-m", "nested_agents", *(word.replace("DIR", str(directory)) for word in words)]


def going_on(directory: Path) -> Row:
    """Return what `run` takes until it goes on with the trials that are left: here none."""
    words = [sys.executable, *_line(RUN, directory)]
    begin = time.perf_counter()
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        while "were run before" not in (line := process.stderr.readline()):
            assert line
        wall = time.perf_counter() - begin
        status = Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
        times = Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").split()
        process.stderr.read()
    ticks = int(times[13]) + int(times[14])
    peak = next(int(x.split()[1]) for x in status.splitlines() if x.startswith("VmHWM"))
    seconds = ticks / os.sysconf("SC_CLK_TCK")
    peak = round(peak / 1024)
    return {"command": "run, until it goes on", "wall": wall, "s": seconds, "peak": peak}


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.memory", description=__doc__)
    parser.add_argument("--conditions", type=int, default=10, metavar="N")
    parser.add_argument("--seeds", type=int, default=1000, metavar="N", help="of each condition")
    parser.add_argument("--episodes", type=int, default=10, metavar="N", help="of a trial")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="where the study is kept")
    options = parser.parse_args()
    console = Console(width=80)
    if options.keep is None:
        show(console, "A worker", WORKER, worker())
    with tempfile.TemporaryDirectory() as folder:
        directory = options.keep or Path(folder) / "study"
        if not directory.exists():
            fill(directory, options.conditions, options.seeds, options.episodes)
        rows = [*commands(directory), going_on(directory)]
    size = f"{options.conditions} conditions x {options.seeds} seeds x {options.episodes} episodes"
    show(console, size, STUDY, rows)


if __name__ == "__main__":
    main()
