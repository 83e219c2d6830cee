"""Conditions compared by any measure, all with one or level by level."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_results import hierarchies, scaling

from nested_agents.core.interface.measures import NO_SUCCESS
from nested_agents.studies.catalogue.study import analyse_as
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.comparison import compare_conditions
from nested_agents.studies.results.permutation_tests import LEVEL

CHANCES = {
    ("chain", "team", 2): 0.9,
    ("star", "team", 2): 0.9,
    ("chain", "team", 8): 0.8,
    ("star", "team", 8): 0.1,
}


def test_levels_are_compared_where_all_else_is_equal() -> None:
    found = compare_conditions(hierarchies(CHANCES).frames(), by="topology")
    assert [(g.setting, g.reference) for g in found.groups] == [
        ("team, robots=2", "chain"), ("team, robots=8", "chain"),
    ]  # fmt: skip
    assert [d.condition for d in found.differences if d.p < LEVEL] == ["star"]
    assert found.groups[1].differences[0].estimate.value == pytest.approx(-0.7, abs=0.15)
    text = "\n".join(found.notes)
    assert "team, robots=8: evaluation success, minus that of chain:\n  worse: star" in text
    assert "adjusted over 2 comparisons" in text
    assert "Power: 20 seeds detect a difference of" in text
    assert "(p adjusted over 2 comparisons)" in " ".join(text.split())


def test_the_reference_is_the_first_condition_or_a_named_one() -> None:
    results = hierarchies(CHANCES).frames()
    first = next(iter(results.columns))
    assert compare_conditions(results).groups[0].reference == first
    assert len(compare_conditions(results).differences) == 3
    last = list(results.columns)[-1]
    found = compare_conditions(results, reference=last)
    significant = [d.condition for d in found.differences if d.p < LEVEL]
    assert significant[0] == first
    assert set(significant) == set(list(results.columns)[:3])


@pytest.mark.parametrize("ends_early", [False, True])
def test_failed_episodes_count_with_all_steps_that_are_allowed(ends_early: bool) -> None:
    """A team that breaks off at once is not better."""
    made = hierarchies(CHANCES)
    if ends_early:
        for own in made.evaluation.values():
            own["steps"][own["success"] == 0] = 1
    results = replace(made.frames(), step_limits=(450, 450))
    found = compare_conditions(results, "steps", by="topology")
    text = "\n".join(found.notes)
    assert "evaluation steps to success, minus that of chain:\n  worse: star" in text
    assert "better" not in text
    star, _ = found.groups[1].differences[0].values
    (condition,) = (c for c in results.conditions if "star" in c and "8" in c)
    success, steps = (results.values(condition, n, "evaluation") for n in ("success", "steps"))
    assert star == pytest.approx(np.where(success, steps, 450).mean(axis=1))


def test_steps_are_refused_where_the_length_of_failures_is_unknown() -> None:
    with pytest.raises(SpecError, match=r"measure = 'steps': .* compare success"):
        compare_conditions(hierarchies(CHANCES).frames(), "steps")


def test_longer_episodes_without_success_are_neither_better_nor_worse() -> None:
    results = replace(hierarchies(CHANCES).frames(), measures=(NO_SUCCESS,))
    text = "\n".join(compare_conditions(results, "steps", by="topology").notes)
    assert "higher: star" in text
    assert "worse" not in text


def test_numbers_of_whole_trials_are_compared_too() -> None:
    results = scaling({2: 0.9})
    for condition in results.training:
        results.columns[condition] = {"name": condition.partition(",")[0]}
    found = compare_conditions(results.frames(), "decision_ms")
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
        compare_conditions(hierarchies(CHANCES).frames(), **options)


def test_too_few_shared_seeds_leave_nothing_to_compare() -> None:
    results = hierarchies(CHANCES, seeds=1).frames()
    assert compare_conditions(results).notes == (
        "Nothing to compare: no two conditions have two runs each, on common items if any.",
    )


def test_what_is_compared_goes_by_any_of_its_names() -> None:
    results = hierarchies({("chain", "team", n): 0.5 for n in (2, 4)}).frames()
    for name in ("robots=4", "4", "scenario.robots=4", results.conditions[1]):
        assert (
            compare_conditions(results, by="robots", reference=name).groups[0].reference
            == "robots=4"
        )
    label = results.conditions[1]
    for name in (label, "chain, team, 4"):
        assert compare_conditions(results, reference=name).groups[0].reference == label
    with pytest.raises(SpecError, match="reference = 'chain'"):
        compare_conditions(results, reference="chain")
    times = compare_conditions(results, "decision_ms")
    title = "decision time [ms]"
    assert times.title == compare_conditions(results, title).title == title
    with pytest.raises(SpecError, match=r"did you mean 'decision_ms'"):
        compare_conditions(results, "decisions_ms")
    times = scaling({2: 0.9, 4: 0.8}).frames()
    for name in ("seconds.learning", "learning", "seconds.learning [s]"):
        assert compare_conditions(times, name).title == "seconds.learning [s]"


def test_conditions_that_are_identical_in_every_episode_are_said_to_be() -> None:
    results = hierarchies(CHANCES)
    star, chain = (f"topology={t}, value_of=team, robots=2" for t in ("star", "chain"))
    for arrays in (results.training, results.evaluation):
        arrays[star] = {name: values.copy() for name, values in arrays[chain].items()}
    said = "Identical in every episode, by every measure:"
    notes = compare_conditions(results.frames(), by="topology").notes
    own = notes[notes.index(said) + 1 :]
    assert " ".join(map(str.strip, own)) == f"{chain} = {star}"
    assert analyse_as("learning-curve", results.frames()).notes == (said, *own)
    results.evaluation[star]["final_distance_m"][3, 2] += 1e-9
    assert said not in compare_conditions(results.frames()).notes
    assert analyse_as("learning-curve", results.frames()).notes == ()


def test_what_was_published_in_part_is_not_called_identical() -> None:
    results = hierarchies(CHANCES)
    for arrays in (*results.training.values(), *results.evaluation.values()):
        arrays["success"][:], arrays["steps"][:] = 0, 450
        for name in [*arrays][1:]:
            if name != "steps":
                del arrays[name]
    assert results.frames().identical == ()


def test_where_nothing_can_be_a_success_it_is_not_compared() -> None:
    results = replace(hierarchies(CHANCES).frames(), measures=(NO_SUCCESS,))
    with pytest.raises(SpecError, match="nothing is a success in these results; known: steps"):
        compare_conditions(results, "success")


def test_success_that_nobody_had_is_said_to_be_none() -> None:
    found = compare_conditions(hierarchies(dict.fromkeys(CHANCES, 0.0)).frames())
    assert "No run has any evaluation success." in found.notes


def test_effect_sizes_stand_in_the_table() -> None:
    found = compare_conditions(hierarchies(CHANCES).frames(), by="topology")
    worse = found.groups[1].table[1].estimates
    (difference,) = found.groups[1].differences
    own, base = difference.values
    higher = np.mean([(a > b) + 0.5 * (a == b) for a in own for b in base])
    assert float(worse["P(improvement)"].value) == pytest.approx(higher)
    assert float(worse["Cliff's delta"].value) == pytest.approx(2.0 * higher - 1.0)
    assert (worse["p"].value, worse["p unadjusted"].value) == (difference.p, difference.raw)
    limited = replace(hierarchies(CHANCES).frames(), step_limits=(450, 450))
    steps = compare_conditions(limited, "steps", by="topology")
    own, base = steps.groups[1].differences[0].values
    lower = np.mean([(a < b) + 0.5 * (a == b) for a in own for b in base])
    improvement = steps.groups[1].table[1].estimates["P(improvement)"]
    assert float(improvement.value) == pytest.approx(lower)
    assert improvement.low <= improvement.value <= improvement.high
