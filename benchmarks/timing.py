"""Paired timing: every candidate once per round, the medians of times and of ratios."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from time import perf_counter


@dataclass(frozen=True)
class Paired:
    """Times of several candidates, round by round."""

    seconds: Mapping[str, list[float]]
    """Per candidate its time in every round."""

    def median(self, name: str) -> float:
        """Return the median time [s] of a candidate."""
        return median(self.seconds[name])

    def ratio(self, of: str, to: str) -> float:
        """Return the median over rounds of one candidate's time over another's.

        Examples
        --------
        >>> Paired({"slow": [4.0, 9.0, 6.0], "fast": [2.0, 3.0, 3.0]}).ratio("slow", "fast")
        2.0
        """
        pairs = zip(self.seconds[of], self.seconds[to], strict=True)
        return median(one / other for one, other in pairs)


def paired(
    candidates: Mapping[str, Callable[[], object]],
    *,
    budget: float,
    most_rounds: int = 200,
    clock: Callable[[], float] = perf_counter,
) -> Paired:
    """Time candidates in turns until `budget` seconds are spent; at least three rounds.

    On a crowded machine `clock` may be `time.thread_time`, which counts the processor's time only.

    A fast candidate is repeated within its turn until the turn takes a few milliseconds. Every turn
    begins with a call that is not timed, so that nothing is compiled while the clock runs and no
    candidate finds the caches filled by its predecessor.
    """
    repeats = {}
    for name, call in candidates.items():
        call()
        taken = []
        for _ in range(3):  # the first calls also take memory
            begin = perf_counter()
            call()
            taken.append(perf_counter() - begin)
        repeats[name] = max(1, min(1000, int(4.0e-3 / (min(taken) + 1e-9))))
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    start = perf_counter()
    rounds = 0
    while rounds < 3 or (perf_counter() - start < budget and rounds < most_rounds):
        for name, call in candidates.items():
            call()
            begin = clock()
            for _ in range(repeats[name]):
                call()
            seconds[name].append((clock() - begin) / repeats[name])
        rounds += 1
    return Paired(seconds)
