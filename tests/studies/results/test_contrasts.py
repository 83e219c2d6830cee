"""Conditions compared; statistics of the field as worked by hand and as rliable 1.2.0 gave them."""

import numpy as np
import pytest
from made_up_results import hierarchies, scaling

from nested_agents.core.interface.measures import SUCCESS, Measure
from nested_agents.studies.catalogue.study import analyse_as
from nested_agents.studies.errors import SpecError
from nested_agents.studies.presentation.figures import draw_profiles
from nested_agents.studies.results.contrasts import (
    _curve,
    _profile,
    aggregate,
    contrasts,
    interquartile_mean,
    probability_of_improvement,
    stratified_bootstrap,
)
from nested_agents.studies.results.results import from_arrays
from nested_agents.studies.results.statistics import LEVEL

CHANCES = {
    ("chain", "team", 2): 0.9,
    ("star", "team", 2): 0.9,
    ("chain", "team", 8): 0.8,
    ("star", "team", 8): 0.1,
}


def test_levels_are_compared_where_all_else_is_equal() -> None:
    found = contrasts(hierarchies(CHANCES).frames(), by="topology")
    assert [(g.setting, g.reference) for g in found.groups] == [
        ("team, robots=2", "chain"), ("team, robots=8", "chain"),
    ]  # fmt: skip
    assert [d.condition for d in found.differences if d.p < LEVEL] == ["star"]
    assert found.groups[1].differences[0].estimate.value == pytest.approx(-0.7, abs=0.15)
    text = "\n".join(found.notes)
    assert "team, robots=8: success, evaluation, less that of chain:\n  worse: star" in text
    assert "adjusted over 2 comparisons" in text
    assert "Power: with 20 seeds and 2 comparisons, a difference of" in text


def test_the_reference_is_the_first_condition_or_a_named_one() -> None:
    results = hierarchies(CHANCES).frames()
    first = next(iter(results.columns))
    assert contrasts(results).groups[0].reference == first
    assert len(contrasts(results).differences) == 3
    last = list(results.columns)[-1]
    found = contrasts(results, reference=last)
    significant = [d.condition for d in found.differences if d.p < LEVEL]
    assert significant[0] == first
    assert set(significant) == set(list(results.columns)[:3])


def test_what_is_better_depends_on_the_measure() -> None:
    # Failed episodes take all their steps, which is worse.
    text = "\n".join(contrasts(hierarchies(CHANCES).frames(), "steps", by="topology").notes)
    assert "worse: star" in text
    assert "better" not in text


def test_numbers_of_whole_trials_are_compared_too() -> None:
    results = scaling({2: 0.9})
    for condition in results.training:
        results.columns[condition] = {"name": condition.partition(",")[0]}
    found = contrasts(results.frames(), "decision_median")
    assert found.phase == ""
    assert [d.condition for d in found.differences if d.p < LEVEL] == ["sampling, robots=2"]
    assert "worse: sampling" in "\n".join(found.notes)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"measure": "sucess"}, "measure = 'sucess': did you mean 'success'"),
        ({"phase": "evaluating"}, "phase = 'evaluating': did you mean 'evaluation'"),
        ({"by": "topolgy"}, "by = 'topolgy': did you mean 'topology'"),
        ({"by": "topology", "reference": "ring"}, "reference = 'ring': known: chain, star"),
    ],
)
def test_what_there_is_not_is_refused(options: dict, complaint: str) -> None:
    with pytest.raises(SpecError, match=complaint):
        contrasts(hierarchies(CHANCES).frames(), **options)


def test_too_few_shared_seeds_leave_nothing_to_compare() -> None:
    results = hierarchies(CHANCES, seeds=1).frames()
    assert contrasts(results).notes == ("Nothing to compare: no two conditions share two seeds.",)


def test_what_is_compared_goes_by_any_of_its_names() -> None:
    results = hierarchies({("chain", "team", n): 0.5 for n in (2, 4)}).frames()
    for name in ("robots=4", "4", "scenario.robots=4", results.conditions[1]):
        assert contrasts(results, by="robots", reference=name).groups[0].reference == "robots=4"
    label = results.conditions[1]
    for name in (label, "chain, team, 4"):
        assert contrasts(results, reference=name).groups[0].reference == label
    with pytest.raises(SpecError, match="reference = 'chain'"):
        contrasts(results, reference="chain")
    times = contrasts(results, "decision_median")
    assert times.title == contrasts(results, "decision [ms]").title == "decision [ms]"
    times = scaling({2: 0.9, 4: 0.8}).frames()
    for name in ("seconds.learning", "learning", "seconds.learning [s]"):
        assert contrasts(times, name).title == "seconds.learning [s]"


def test_conditions_that_are_identical_in_every_episode_are_said_to_be() -> None:
    results = hierarchies(CHANCES)
    star, chain = (f"topology={t}, value_of=team, robots=2" for t in ("star", "chain"))
    for arrays in (results.training, results.evaluation):
        arrays[star] = {name: values.copy() for name, values in arrays[chain].items()}
    said = "Identical in every episode, by every measure:"
    notes = contrasts(results.frames(), by="topology").notes
    own = notes[notes.index(said) + 1 :]
    assert " ".join(map(str.strip, own)) == f"{chain} = {star}"
    assert analyse_as("learning-curve", results.frames()).notes == (said, *own)
    results.evaluation[star]["final_distance_m"][3, 2] += 1e-9
    assert said not in contrasts(results.frames()).notes
    assert analyse_as("learning-curve", results.frames()).notes == ()


def test_what_was_published_in_part_is_not_called_identical() -> None:
    results = hierarchies(CHANCES)
    for arrays in (*results.training.values(), *results.evaluation.values()):
        arrays["success"][:], arrays["steps"][:] = 0, 450
        for name in [*arrays][1:]:
            if name != "steps":
                del arrays[name]
    assert results.frames().identical == ()


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
    assert probability_of_improvement([own, base]) == pytest.approx((2 + 3 * 0.5) / 6)
    several = probability_of_improvement([own, own, base, own])
    assert several == pytest.approx((3.5 / 6 + 0.5) / 2), "the mean over tasks"


def test_estimates_and_intervals_are_those_of_rliable() -> None:
    iqm = stratified_bootstrap(list(OWN), interquartile_mean)
    assert iqm.value == pytest.approx(0.55)
    assert [iqm.low, iqm.high] == pytest.approx([0.41111111, 0.66666667], abs=0.02)
    better = stratified_bootstrap([*OWN, *BASE], probability_of_improvement)
    assert better.value == pytest.approx(0.59375)
    assert [better.low, better.high] == pytest.approx([0.45598958, 0.72337963], abs=0.02)
    profile = _profile(list(OWN), np.array([0.0, 0.25, 0.5, 0.75]))
    assert profile.value == pytest.approx([0.86111111, 0.77777778, 0.52777778, 0.22222222])
    assert profile.low == pytest.approx([0.75, 0.63888889, 0.36111111, 0.11111111], abs=0.03)
    assert profile.high == pytest.approx([0.94444444, 0.88888889, 0.69444444, 0.36111111], abs=0.03)
    # Two episodes of training: sample efficiency.
    curve = _curve([np.stack([own, base], axis=1) for own, base in zip(OWN, BASE, strict=True)])
    assert curve.value == pytest.approx([0.55, 0.39444444])
    assert curve.low == pytest.approx([0.41111111, 0.28888889], abs=0.02)
    assert curve.high == pytest.approx([0.66111111, 0.52222222], abs=0.02)


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
    found = aggregate(contrasts(results(), by="kind"))
    assert [(line.condition, line.seeds) for line in found.table] == [("a", 6), ("b", 6)]
    a, b = (line.estimates for line in found.table)
    assert (a["interquartile mean"].value, b["interquartile mean"].value) == (0.5, 1.0)
    assert b["P(improvement)"].value == 0.75, "a tie in one task, always in the other"
    assert "P(improvement)" not in a
    assert found.curves["b"].value == pytest.approx(np.ones(4))
    assert "within 2 of 2 tasks" in found.notes[0]
    figure = draw_profiles(found)
    assert len(figure.axes) == 2


def test_lower_may_be_better() -> None:
    line = aggregate(contrasts(results(), "time", by="kind")).table[1]
    assert line.estimates["P(improvement)"].value == 1.0


def test_a_seed_each_is_too_few() -> None:
    with pytest.raises(SpecError, match="statistics: no two conditions have two seeds"):
        aggregate(contrasts(results(seeds=1), by="kind"))
