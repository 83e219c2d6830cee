"""How many trials a minute many workers finish, by simulation: ``python -m benchmarks.workers``.

First it is measured what the store takes: made-up trials are saved one after the other, as a study
saves them, each safely on the disk. Then workers are simulated that take the next trial as soon as
their last one is saved; trials last as long as drawn (gamma, a deviation of a third of the mean),
and the runner hands out and saves one at a time. So the throughput is that of workers who wait only
for the store: this machine has two cores, and memory, caches and starting workers are left out.
"""

from __future__ import annotations

import argparse
import heapq
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions
from nested_agents.studies.trials.keeping import open_to_run
from nested_agents.studies.trials.trial import trials_of
from nested_agents.studies.workers.runner import save

from .memory import made_up
from .tables import Row, show

WORKERS = (1, 2, 4, 8, 16, 64, 256)
SECONDS = (0.1, 1.2, 20.0)
"""How long a trial takes in the mean [s]."""
COLUMNS = {"workers": "workers"} | {f"{s:g}": f"trials of {s:g} s\n\\[1/s]" for s in SECONDS}


def saved_per_second(trials: int, episodes: int) -> float:
    """Return how many made-up trials a second the store takes."""
    spec = Spec.of(
        {"seeds": trials, "episodes": episodes, "steps": 8, "evaluation": 0,
         "scenario": {"kind": "line-up"}}
    )  # fmt: skip
    all_trials = trials_of(spec)
    with (
        tempfile.TemporaryDirectory() as folder,
        open_to_run(Path(folder) / "study", spec, all_trials, check_conditions(spec)) as store,
    ):
        results = [made_up(trial, store) for trial in all_trials]
        begun = perf_counter()
        for trial, result in zip(all_trials, results, strict=True):
            save(store, trial, result, total=1.0)
        return trials / (perf_counter() - begun)


def throughput(workers: int, trials: Sequence[float], saving: float) -> float:
    """Return how many trials a second workers finish, by simulating when each one is done.

    Examples
    --------
    >>> throughput(1, [1.0] * 2, 0.25), throughput(2, [1.0] * 4, 0.25), throughput(4, [0.0], 0.5)
    (0.8, 1.4545454545454546, 2.0)
    """
    running = [(0.0, w) for w in range(workers)]
    ends = [(start + seconds, w) for (start, w), seconds in zip(running, trials, strict=False)]
    heapq.heapify(ends)
    free, begun = 0.0, len(ends)
    while ends:
        end, worker = heapq.heappop(ends)
        free = max(free, end) + saving
        if begun < len(trials):
            heapq.heappush(ends, (free + trials[begun], worker))
            begun += 1
    return len(trials) / free


def main() -> None:
    """Measure the store, simulate, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.workers", description=__doc__)
    parser.add_argument("--trials", type=int, default=2000, metavar="N")
    parser.add_argument("--episodes", type=int, default=20, metavar="N", help="of a trial")
    options = parser.parse_args()
    limit = saved_per_second(options.trials, options.episodes)
    rng, rows = np.random.default_rng(0), list[Row]()
    for workers in WORKERS:
        lengths = rng.gamma(9.0, 1.0 / 9.0, size=100 * workers).tolist()
        each = ([mean * length for length in lengths] for mean in SECONDS)
        rates = (throughput(workers, trials, 1.0 / limit) for trials in each)
        by_length = zip((f"{s:g}" for s in SECONDS), rates, strict=True)
        rows.append({"workers": workers, **dict(by_length)})
    console = Console(width=80)
    console.print(
        f"the store saves {limit:.0f} trials of {options.episodes} episodes a second, each safely"
    )
    show(console, "Trials a second, simulated", COLUMNS, rows)


if __name__ == "__main__":
    main()
