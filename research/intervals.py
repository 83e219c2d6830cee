"""How often 95% intervals cover the truth, by skewness: ``python -m research.intervals``.

The intervals of tables, Student's, those of BCa (Efron 1987; SciPy's), and Student's after a cubic
transformation that takes the skewness out (Hall 1992), of values whose mean is known.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from scipy import special, stats

from nested_agents import bootstrap

SEEDS = (5, 8, 12, 20, 40)
DRAWS: dict[str, tuple[Callable[[np.random.Generator, int], np.ndarray], float]] = {
    "normal": (lambda rng, n: rng.normal(size=n), 0.0),
    "gamma (4)": (lambda rng, n: rng.gamma(4.0, size=n), 4.0),
    "exponential": (lambda rng, n: rng.exponential(size=n), 1.0),
    "log-normal (1)": (lambda rng, n: rng.lognormal(size=n), float(np.exp(0.5))),
}
"""By name, what draws values, and their mean."""
Interval = tuple[float, float]


def of_tables(values: np.ndarray) -> Interval:
    """Return the interval that tables have."""
    estimate = bootstrap(values)
    return float(estimate.low), float(estimate.high)


def students(values: np.ndarray) -> Interval:
    """Return Student's interval."""
    n = len(values)
    half = special.stdtrit(n - 1, 0.975) * values.std(ddof=1) / np.sqrt(n)
    return values.mean() - half, values.mean() + half


def bca(values: np.ndarray) -> Interval:
    """Return the interval of the bias-corrected and accelerated bootstrap."""
    result = stats.bootstrap((values,), np.mean, n_resamples=1000, rng=0)
    return tuple(result.confidence_interval)


def halls(values: np.ndarray) -> Interval:
    """Return Student's interval after Hall's transformation."""
    n = len(values)
    skewness = float(stats.skew(values)) or 1e-9
    y = special.stdtrit(n - 1, 0.975) / np.sqrt(n) * np.array([1.0, -1.0])
    turned = 3.0 / skewness * (np.cbrt(1.0 + skewness * (y - skewness / (6.0 * n))) - 1.0)
    low, high = values.mean() - values.std(ddof=1) * turned
    return low, high


WAYS = {"tables": of_tables, "Student": students, "BCa": bca, "Hall": halls}


def main() -> None:
    """Print the share of studies whose interval covers the mean."""
    parser = argparse.ArgumentParser(prog="python -m research.intervals", description=__doc__)
    parser.add_argument("--studies", type=int, default=2000)
    studies = parser.parse_args().studies
    warnings.simplefilter("ignore")  # BCa of values that are all alike
    table = Table("values", "seeds", *WAYS, box=SIMPLE)
    for name, (draw, mean) in DRAWS.items():
        for seeds in SEEDS:
            rng = np.random.default_rng(0)
            samples = [draw(rng, seeds) for _ in range(studies)]
            shares = []
            for way in WAYS.values():
                ends = [way(sample) for sample in samples]
                shares.append(np.mean([low <= mean <= high for low, high in ends]))
            table.add_row(name, str(seeds), *(f"{share:.3f}" for share in shares))
    Console().print(table)


if __name__ == "__main__":
    main()
