"""Conditions compared by any measure, all with one or level by level."""

import pytest
from made_up_results import hierarchies, scaling

from nested_agents.studies.catalogue.study import analyse_as
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.contrasts import contrasts
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
    assert "team, robots=8: evaluation success, less that of chain:\n  worse: star" in text
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
    assert contrasts(results).notes == (
        "Nothing to compare: no two conditions have two seeds each.",
    )


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
