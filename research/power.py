"""Whether studies find what the promised power says: ``python -m research.power``.

Studies of known differences are simulated and tested by the permutation test itself, exact up to 12
seeds and by 2,000 drawn patterns of signs beyond. Differences of single seeds are normal, as the
promise has it, or those of two success rates of ten episodes, whose means differ from seed to
seed: these have ties and bounds. Then the same with the deviation that a study would estimate from
its own seeds, averaged over the studies.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from nested_agents import power
from nested_agents.analysis import LEVEL, deviation_of, paired_permutation

Draw = Callable[[np.random.Generator, int, int], np.ndarray]
"""Draws differences ``(n_studies, n_seeds)``."""

CASES = (
    # seeds, comparisons, effect in deviations of normal differences
    (6, 1, 1.2), (7, 2, 1.2), (8, 1, 1.0), (10, 5, 1.2), (12, 22, 1.5), (20, 1, 0.65),
    (30, 10, 0.7),
)  # fmt: skip
SUCCESS_RATES = ((8, 1, 0.3, 0.8), (12, 2, 0.4, 0.8), (20, 1, 0.6, 0.8), (30, 10, 0.6, 0.85))
"""Seeds, comparisons and compared success rates, on which `SPREAD_OF_RATES` was chosen."""
SPREAD_OF_RATES = 1.07
"""Factor by which `na.power` inflates deviations of rates."""
EPISODES, SPREAD = 10, 6.0
"""Of each seed, and of the Beta distribution of success over seeds: the sum of its parameters."""
OTHERS = (
    (9, 1, 0.2, 0.7, 10, 6.0), (10, 3, 0.5, 0.95, 20, 3.0), (16, 1, 0.5, 0.75, 5, 12.0),
    (15, 4, 0.1, 0.45, 20, 6.0), (24, 2, 0.7, 0.9, 10, 3.0), (30, 1, 0.4, 0.55, 20, 12.0),
)  # fmt: skip
"""Cases on which nothing was chosen, with episodes and spread of their own."""
EXACT_SEEDS, DRAWN = 12, 2000


def normal(effect: float) -> Draw:
    """Return what draws normal differences of this mean, in units of their deviation."""
    return lambda rng, studies, seeds: rng.normal(size=(studies, seeds)) + effect


def rates(first: float, second: float, episodes: int, spread: float) -> Draw:
    """Return what draws differences of two success rates, `first` and `second` in the mean."""

    def draw(rng: np.random.Generator, studies: int, seeds: int) -> np.ndarray:
        draws = [
            rng.binomial(episodes, rng.beta(p * spread, (1 - p) * spread, (studies, seeds)))
            for p in (first, second)
        ]
        return np.asarray((draws[1] - draws[0]) / episodes)

    return draw


def share_of_significant(differences: np.ndarray, comparisons: int) -> float:
    """Return the share of studies ``(n_studies, n_seeds)`` that find their difference."""
    n = differences.shape[1]
    nothing, flips = np.zeros(n), 2**n if n <= EXACT_SEEDS else DRAWN
    ps = [paired_permutation(d, nothing, permutations=flips) for d in differences]
    return float(np.mean(np.array(ps) * comparisons < LEVEL))


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(prog="python -m research.power", description=__doc__)
    parser.add_argument("--studies", type=int, default=10_000, help="simulated studies a case")
    options = parser.parse_args()
    table = Table("differences", box=SIMPLE)
    for heading in ("seeds", "comparisons", "promised", "found", "off by"):
        table.add_column(heading, justify="right")
    begun, worst = time.monotonic(), 0.0
    cases: list[tuple[str, int, int, Draw, bool]] = [
        (f"normal, {effect:g} deviations", n, m, normal(effect), False) for n, m, effect in CASES
    ]
    rates_compared = [(*case, EPISODES, SPREAD) for case in SUCCESS_RATES]
    cases += [
        (f"rates of {p:g}, {q:g} ({k})", n, m, rates(p, q, k, spread), True)
        for n, m, p, q, k, spread in [*rates_compared, *OTHERS]
    ]
    for name, seeds, comparisons, draw, of_rates in cases:
        rng = np.random.default_rng([seeds, comparisons])
        many = draw(rng, 100_000, 1)
        effect, deviation = float(many.mean()), float(many.std())
        deviation *= SPREAD_OF_RATES if of_rates else 1.0
        differences = draw(rng, options.studies, seeds)
        share = share_of_significant(differences, comparisons)
        promises = {"": power(effect, deviation, seeds, comparisons)}
        if of_rates:
            own = [deviation_of([d], of_rates=True) or 0.0 for d in differences[:200]]
            promised = [power(effect, round(d, 3), seeds, comparisons) for d in own]
            promises[", own"] = float(np.mean(promised))
        for how, promised in promises.items():
            off = share - promised
            worst = max(worst, abs(off))
            numbers = (f"{promised:.3f}", f"{share:.3f}", f"{off:+.3f}")
            table.add_row(f"{name}{how}", str(seeds), str(comparisons), *numbers)
    console = Console(width=80)
    console.print(table)
    seconds = time.monotonic() - begun
    console.print(f"{options.studies} studies a case, {seconds:.0f} s; at most off by {worst:.3f}")


if __name__ == "__main__":
    main()
