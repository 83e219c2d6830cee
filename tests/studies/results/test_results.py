"""Numbers of whole trials and phases of a study's own, from the store to arrays.

Numbers of trials have units wherever they are shown.
"""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import made_up
import numpy as np
import pytest
from made_up import MEASURES, SPEC, TRIALS, measure
from made_up_results import ablation, hierarchies, scaling

import nested_agents as na
from nested_agents.studies.errors import SpecError
from nested_agents.studies.results.choices import choose_trials
from nested_agents.studies.results.joining import combine
from nested_agents.studies.results.results import NUMBERS, read
from nested_agents.studies.spec.studies import NAMES
from nested_agents.studies.workers.runner import save


def test_phases_numbers_and_usage_are_read_by_condition(tmp_path: Path) -> None:
    with made_up.opened(tmp_path / "study", SPEC, MEASURES) as store:
        for trial in TRIALS[:-1]:
            result = measure(trial)
            further = tuple(
                r._replace(phase="evaluation:circle") for r in result.rows if r.phase != "training"
            )
            result = replace(
                result,
                rows=(*result.rows, *further),
                numbers={"messages": 6.0 + trial.seed},
                usage={"peak_bytes": 10.0 * trial.seed},
            )
            save(store, trial, result, 2.0)
        results = read(store)
    assert {c: results.seeds(c) for c in results.conditions} == {
        "default": (0, 1, 2), "frozen": (0, 1),
    }  # fmt: skip
    assert results.phases == ("training", "evaluation", "evaluation:circle")
    assert results.other_evaluations("default") == {"circle": "evaluation:circle"}
    circle = results.success("default", "evaluation:circle")
    assert (circle == results.success("default", "evaluation")).all()
    assert results.numbers("default")["messages"].tolist() == [6.0, 7.0, 8.0]
    assert results.numbers("frozen")["peak_bytes"].tolist() == [0.0, 10.0]
    assert results.numbers("frozen")["seconds.total"].tolist() == [2.0, 2.0]
    assert len(results.numbers("default")["seconds.decision"]) == 3
    assert "peak_bytes" in results.usage
    assert "messages" not in results.usage


SETTINGS = {"scenario": {"robots": 8, "box": "square"}, "learner": {"kind": "batch-td"}}


def is_chosen(text: str, settings=SETTINGS) -> bool:
    whole = ablation({"no replay": 0.5}, seeds=4).frames()
    columns = {"no replay": {"learner.self_model.enabled": "true"}}
    part = choose_trials(replace(whole, columns=columns), text, {"no replay": settings})
    return 3 in part.seeds("no replay")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("robots == 8", True),
        ("`scenario.robots` != 8", False),
        ("robots in [2, 8] and seed < 5", True),
        ("not (box == 'circle' or seed >= 3)", False),
        ("kind == 'batch-td'", True),
        ("enabled == True", True),
        ('condition == "no replay"', True),
        ("robots > 8 or seed == 3", True),
    ],
)
def test_a_choice_is_made_by_settings_condition_and_seed(text: str, expected: bool) -> None:
    assert is_chosen(text) == expected


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("robots = 8", "must be such as"),
        ("robots", "must be such as"),
        ("seed", "must be such as"),
        ("1 == 1", "must be such as"),
        ("robts == 8", r"no key is called 'robts' \(did you mean 'robots'\?\); trials"),
        ("width == 8", "no key is called 'width'; trials differ in condition, seed, enabled$"),
        ("scenario.robots == 8", "write `scenario.robots` in backticks, or robots; trials"),
        ("box < 3", "must be such as"),
        ("__import__('os') == 1", "must be such as"),
        ("", "must be such as"),
    ],
)
def test_what_is_no_choice_is_refused_in_one_line(text: str, complaint: str) -> None:
    with pytest.raises(SpecError, match=complaint):
        is_chosen(text)


def test_a_name_of_several_settings_must_be_told_apart() -> None:
    settings = {"learner": {"kind": "a"}, "scenario": {"kind": "b"}}
    with pytest.raises(SpecError, match=r"'kind' alone, but `learner.kind`, `scenario.kind`"):
        is_chosen("kind == 'b'", settings)
    assert is_chosen("`scenario.kind` == 'b'", settings)


def test_selected_trials_keep_their_values() -> None:
    whole, condition = scaling({2: 0.9, 4: 0.5}).frames(), "sums, robots=2"
    small = "condition in ['sums, robots=2', 'sampling, robots=2']"
    part = choose_trials(whole, f"{small} and seed in {list(range(0, 20, 2))}", {})
    assert part.conditions == ("sums, robots=2", "sampling, robots=2")
    assert part.seeds(condition) == tuple(range(0, 20, 2))
    there = whole.success(condition, "evaluation")[::2]
    np.testing.assert_array_equal(part.success(condition, "evaluation"), there)
    assert len(part.numbers(condition)["seconds.learning"]) == 10
    assert choose_trials(whole, "seed < 0", {}).conditions == ()


def test_studies_together_name_what_would_be_confused() -> None:
    key = ("chain", "team", 2)
    first, second = hierarchies({key: 0.9}), hierarchies({key: 0.1, ("star", "team", 2): 0.2})
    one, other = first.frames(), second.frames()
    whole, labels = combine([("one", one), ("other", other)])
    label = "topology=chain, value_of=team, robots=2"
    assert labels[0] == {label: f"{label} (one)"}
    assert whole.columns[f"{label} (other)"]["directory"] == "other"
    assert whole.conditions[2] == "topology=star, value_of=team, robots=2"
    there = whole.success(f"{label} (one)", "evaluation")
    np.testing.assert_array_equal(there, one.success(label, "evaluation"))
    assert set(whole.trials["directory"]) == {"one", "other"}
    assert (
        whole.episodes["topology"].tolist()
        == whole.episodes["condition"].str.extract(r"topology=(\w+)", expand=False).tolist()
    )


@pytest.mark.parametrize("study", NAMES)
def test_every_number_of_a_study_is_told(study: str) -> None:
    module = import_module(f"nested_agents.studies.catalogue.{study.replace('-', '_')}")
    assert set(getattr(module, "NUMBERS", ())) <= set(NUMBERS)


def test_frames_tell_the_units_of_numbers(tmp_path: Path) -> None:
    pytest.importorskip("pandas", reason="extra [pandas]")
    spec = {
        "study": "scaling", "seeds": 2, "episodes": 1, "steps": 3, "evaluation": 1,
        "preset": "own-value", "scenario": {"kind": "line-up"}, "sweep": {"scenario.carts": [2, 3]},
    }  # fmt: skip
    study = na.run(spec, tmp_path / "out", jobs=1, progress=False)
    columns = study.trials.attrs["columns"]
    assert columns["decision_median"]["unit"] == "s"
    assert columns["scenario.carts"]["meaning"] == "a swept key"
