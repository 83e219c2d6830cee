"""Processor time of reading a large study: ``python -m benchmarks.large_study``.

The study is generated: its results are drawn at random and no episode is simulated.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np

from nested_agents.core.interface.measures import Measure
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.episodes import EpisodeRow
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.trial import TrialResult, trials_of
from nested_agents.studies.workers.runner import save

from .startup import used_by

LIMITS_S = {"status": 0.7, "table": 2.5, "compare": 3.5, "report": 7.8, "export": 3.0}
"""Processor times that must not be exceeded on an idle machine, by command [s]."""
CONDITIONS = 10
EPISODES = 4


def generate(directory: Path, trials: int) -> None:
    """Write a study with random results."""
    os.fsync = lambda _: None  # type: ignore[assignment]
    gammas = [round(0.9 + 0.005 * i, 3) for i in range(CONDITIONS)]
    spec = Spec.of(
        {"seeds": trials // CONDITIONS, "episodes": EPISODES, "steps": 5, "evaluation": 2,
         "sweep": {"learner.discount": gammas}}
    )  # fmt: skip
    planned, measures = trials_of(spec), check_conditions(spec)
    rng = np.random.default_rng(0)
    seconds = dict.fromkeys(("decision", "physics", "sensors", "learning"), 0.1)
    with open_to_run(directory, spec, planned, measures) as store:
        for trial in planned:
            phases = ["training"] * EPISODES + ["evaluation"] * 2
            numbers = [*range(EPISODES), 0, 1]
            rows = [
                EpisodeRow(phase, i, 5, _draw(measures, rng), float(rng.normal()))
                for phase, i in zip(phases, numbers, strict=True)
            ]
            save(store, trial, TrialResult(tuple(rows), measures, {}, seconds), 0.4)


def _draw(measures: tuple[Measure, ...], rng: np.random.Generator) -> dict[str, float]:
    """Draw the measures of an episode."""
    return {m.name: bool(rng.integers(2)) if m.is_rate else rng.random() for m in measures}


def processor_seconds(command: str, directory: Path) -> float:
    """Return the processor time of a command on a study in a new process [s]."""
    used = used_by(["-m", "nested_agents", *command.split(), str(directory)])
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Generate a study and print the least processor time of each command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.large_study", description=__doc__)
    parser.add_argument("--trials", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=3, help="runs of each command")
    parser.add_argument("--directory", type=Path, help="keep the study there, or read it if there")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        directory = options.directory or Path(folder) / "study"
        if not directory.exists():
            generate(directory, options.trials)
        for command, limit in LIMITS_S.items():
            line = f"{command} --overwrite" if command == "export" else command
            seconds = min(processor_seconds(line, directory) for _ in range(options.rounds))
            print(f"{command:8} {seconds:5.2f} s of {limit} s", flush=True)


if __name__ == "__main__":
    main()
