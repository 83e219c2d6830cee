"""Statistics of the field as worked by hand and as rliable 1.2.0 gave them."""

import numpy as np
import pytest

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import draw_profiles
from nested_agents.studies.results.aggregates import (
    aggregate,
    interquartile_mean,
    profiles,
    stratified_bootstrap,
)
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.results import from_arrays
from nested_agents.studies.results.statistics import probability_higher

OWN = np.array([
    [6, 0, 6, 9, 9, 2, 3, 1, 6, 10, 7, 7],
    [3, 8, 7, 8, 0, 9, 4, 7, 4, 7, 4, 5],
    [0, 9, 5, 0, 7, 5, 0, 6, 10, 7, 1, 3],
]) / 10.0  # fmt: skip
BASE = np.array([
    [4, 3, 5, 8, 1, 2, 3, 7, 4, 5, 2, 1],
    [8, 5, 3, 2, 7, 8, 1, 2, 2, 3, 8, 6],
    [8, 3, 4, 6, 7, 1, 4, 0, 1, 6, 3, 8],
]) / 10.0  # fmt: skip
"""Scores of twelve runs in three tasks."""


def test_interquartile_means() -> None:
    # Of eight runs the two highest and the two lowest are left out.
    tasks = [np.array([0.0, 0.0, 0.2, 0.4]), np.array([0.6, 0.8, 1.0, 1.0])]
    assert interquartile_mean(tasks) == pytest.approx((0.2 + 0.4 + 0.6 + 0.8) / 4)


def test_probabilities_of_improvement() -> None:
    own, base = np.array([1.0, 1.0, 0.0]), np.array([1.0, 0.0])
    # In pairs: 2 ties and 2 wins of the ones, 1 loss and 1 tie of the zero.
    assert float(probability_higher([(own, base)]).value) == pytest.approx((2 + 3 * 0.5) / 6)
    several = float(probability_higher([(own, base), (own, own)]).value)
    assert several == pytest.approx((3.5 / 6 + 0.5) / 2), "the mean over tasks"


def test_estimates_and_intervals_are_those_of_rliable() -> None:
    iqm = stratified_bootstrap(list(OWN), interquartile_mean)
    assert iqm.value == pytest.approx(0.55)
    assert [iqm.low, iqm.high] == pytest.approx([0.41111111, 0.66666667], abs=0.02)
    better = probability_higher(list(zip(OWN, BASE, strict=True)))
    assert better.value == pytest.approx(0.59375)
    assert [better.low, better.high] == pytest.approx([0.45598958, 0.72337963], abs=0.02)


TIME = Measure("time", "time", "s", better="lower")
COLUMNS = {
    f"{name}, {task}": {"learner.kind": name, "task": task}
    for task in ("easy", "hard")
    for name in ("a", "b")
}


def results(seeds=3):
    """Results of two learners in two tasks: b solves the hard one sooner."""
    rng = np.random.default_rng(0)
    phases = {
        phase: {
            label: {
                "success": np.full((seeds, n), float("easy" in label or "b" in label)),
                "time": rng.random((seeds, n)) - 2.0 * ("b" in label),
                "steps": np.ones((seeds, n)),
            }
            for label in COLUMNS
        }
        for phase, n in (("training", 4), ("evaluation", 2))
    }
    own = {label: tuple(range(seeds)) for label in COLUMNS}
    nothing = {label: {} for label in COLUMNS}
    return from_arrays(phases, own, nothing, nothing, COLUMNS, (SUCCESS, TIME))


def test_groups_of_a_comparison_are_tasks() -> None:
    compared = compare_conditions(results(), by="kind")
    lines, notes = aggregate(compared)
    assert [(line.condition, line.seeds) for line in lines] == [("a", 6), ("b", 6)]
    a, b = (line.estimates for line in lines)
    assert (a["interquartile mean"].value, b["interquartile mean"].value) == (0.5, 1.0)
    assert b["P(improvement)"].value == 0.75, "a tie in one task, always in the other"
    assert "P(improvement)" not in a
    assert "within 2 of 2 tasks" in notes[0]
    _, shares = profiles(compared)
    assert shares["a"].value[[0, -2, -1]].tolist() == [0.5, 0.5, 0.0]
    assert shares["b"].value[[0, -2, -1]].tolist() == [1.0, 1.0, 0.0]
    assert len(draw_profiles(compared).axes) == 1


def test_lower_may_be_better() -> None:
    line = aggregate(compare_conditions(results(), "time", by="kind"))[0][1]
    assert line.estimates["P(improvement)"].value == 1.0


def test_a_seed_each_is_too_few() -> None:
    with pytest.raises(SpecError, match="statistics: no two conditions have two seeds"):
        aggregate(compare_conditions(results(seeds=1), by="kind"))
