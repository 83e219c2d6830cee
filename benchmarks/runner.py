"""What running trials costs beside the trials: ``python -m benchmarks.runner``.

The same trials run with one and with two worker processes, in turns. On a machine that others use
too, the clock on the wall tells little; so it is only asked which part of the time the workers were
busy, while work itself is counted in processor seconds:

overhead = (processor seconds of the runner, and of the workers outside trials) / those of trials

efficiency = busy part of the workers' time x processor seconds of the trials with one process /
those with two

Starting workers and importing modules is over before the clock starts.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from joblib.externals.loky import get_reusable_executor

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.store.store import Store
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.session import run_trial
from nested_agents.studies.trials.trial import Trial, TrialResult, trials_of
from nested_agents.studies.workers.runner import run_trials
from nested_agents.studies.workers.workers import LokyWorkers

TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Round:
    """What one run took."""

    trials: float
    """Processor seconds of the trials."""
    outside: float
    """Processor seconds of runner and workers beside them."""
    busy: float
    """Part of the workers' time in which they ran trials."""


def timed(trial: Trial) -> TrialResult:
    """Run a trial, and note when, on which process, and with how many processor seconds."""
    begin, cpu = time.monotonic(), time.process_time()
    result = run_trial(trial)
    usage = {"cpu": time.process_time() - cpu, "begin": begin, "end": time.monotonic()}
    return replace(result, usage={**usage, "pid": float(os.getpid())})


def measure(spec: Spec, jobs: int) -> Round:
    """Run the trials of a spec with warm workers."""
    trials = trials_of(spec)
    warm = [replace(trial, seed=10**6 + i) for i, trial in enumerate(trials[: 2 * jobs])]
    measures = check_conditions(spec)
    with tempfile.TemporaryDirectory() as folder:
        workers = LokyWorkers(jobs)
        with open_to_run(Path(folder) / "warm", spec, trials, measures) as store:
            for _ in run_trials(warm, store, timed, workers):
                pass
            pids = _pids(store)
        before, own = sum(map(_cpu, pids)), time.process_time()
        with open_to_run(Path(folder) / "study", spec, trials, measures) as store:
            for outcome in run_trials(trials, store, timed, workers):
                assert outcome.error is None, outcome.error
            own = time.process_time() - own
            assert _pids(store) <= pids, "a worker was started anew"
            by_name: dict[str, list[float]] = {}
            for _, _, name, value, _ in store.numbers():
                by_name.setdefault(name, []).append(value)
        worked = sum(map(_cpu, pids)) - before
    get_reusable_executor().shutdown()
    inside = sum(by_name["cpu"])
    span = max(by_name["end"]) - min(by_name["begin"])
    spent = sum(by_name["end"]) - sum(by_name["begin"])
    return Round(inside, own + max(worked - inside, 0.0), spent / (jobs * span))


def _pids(store: Store) -> set[int]:
    return {int(value) for _, _, name, value, _ in store.numbers() if name == "pid"}


def _cpu(pid: int) -> float:
    """Return the processor seconds that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def main() -> None:
    """Measure in turns and print medians."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.runner")
    parser.add_argument("--trials", type=int, default=16, metavar="N")
    parser.add_argument("--rounds", type=int, default=3, metavar="N")
    parser.add_argument("--episodes", type=int, default=10, metavar="N")
    parser.add_argument("--steps", type=int, default=450, metavar="N")
    options = parser.parse_args()
    lengths = {"episodes": options.episodes, "steps": options.steps, "evaluation": 0}
    spec = Spec.of({"seeds": options.trials, **lengths})
    load = os.getloadavg()[0]
    rounds = [(measure(spec, 1), measure(spec, 2)) for _ in range(options.rounds)]
    for i, jobs in enumerate((1, 2)):
        trial = median(pair[i].trials for pair in rounds) / options.trials
        each = 1e3 * median(pair[i].outside for pair in rounds) / options.trials
        share = [100 * pair[i].outside / pair[i].trials for pair in rounds]
        busy = median(pair[i].busy for pair in rounds)
        print(
            f"jobs {jobs}: {trial:.3g} processor seconds a trial, overhead {each:.1f} ms or "
            f"{median(share):.2f} % ({min(share):.2f} to {max(share):.2f}), busy {busy:.3f}"
        )
    efficiencies = [two.busy * one.trials / two.trials for one, two in rounds]
    print(
        f"efficiency of 2 jobs: {median(efficiencies):.3f} "
        f"({min(efficiencies):.3f} to {max(efficiencies):.3f})"
    )
    print(
        f"{options.rounds} rounds of {options.trials} trials in turns, load {load:.1f} before and "
        f"{os.getloadavg()[0]:.1f} after on {os.cpu_count()} cores"
    )


if __name__ == "__main__":
    main()
