"""Intervals of recovery cover the truth in simulated studies whose recovery is known."""

import numpy as np
import pandas as pd
import pytest

from nested_agents.core.interface.measures import Measure
from nested_agents.studies.results.analysis import mean_estimate
from nested_agents.studies.results.recovery import FailureCourse, bounded

STUDIES = 300
ONSET = 30
EPISODES = 90


def simulated(rng: np.random.Generator, n_seeds: int) -> FailureCourse:
    """Return a study in which success falls to 0 and comes back at a random time of each seed.

    Levels differ between seeds, and outcomes of episodes are random.
    """
    levels = rng.beta(16.0, 4.0, size=(n_seeds, 1))
    returns = ONSET + rng.gamma(4.0, 4.0, size=(n_seeds, 1))
    episode = np.arange(EPISODES)
    chances = np.where((episode < ONSET) | (episode >= returns), levels, 0.0)
    success = (rng.random((n_seeds, EPISODES)) < chances).astype(float)
    steps = np.full((n_seeds, EPISODES), 50.0)
    return FailureCourse((ONSET,), success, steps, tuple(range(n_seeds)))


@pytest.mark.parametrize("n_seeds", [6, 20])
@pytest.mark.parametrize("name", ["cumulative_loss", "recovery_time", "recovery_decisions"])
def test_nominal_intervals_cover_the_true_mean(name: str, n_seeds: int) -> None:
    rng = np.random.default_rng(11)
    truth = np.nanmean(simulated(rng, 100_000).measured[name])  # seeds with success before
    covered = 0
    for _ in range(STUDIES):
        course = simulated(rng, n_seeds)
        measure: Measure = bounded(name, [course], longest=50)
        values = course.measured[name][course.had_success]
        estimate = mean_estimate(measure, pd.DataFrame(values))
        covered += bool(estimate.low <= truth <= estimate.high)
    assert 0.92 <= covered / STUDIES <= 0.98
