"""Layers of a condition's settings: what a preset says gives way to a kind that has it not."""

from dataclasses import replace

import pytest

from nested_agents.core.learners import LEARNERS, LearnerSettings
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.presets import PRESETS
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

ON_GRAPHS = ("variable-elimination", "max-plus")
"""Evaluators that need neighbours."""
BUILT = [
    kind
    for kind in LEARNERS.built_in
    if issubclass(LEARNERS.model(kind), LearnerSettings) and kind != "q-learning"
]
"""Learners that can be built without extras, in a scenario whose states hold no actions."""


def build(table: dict[str, object]) -> Spec:
    """Return the spec of a table whose first trial can begin."""
    spec = Spec.of({**table, "seeds": 1})
    Session(replace(trials_of(spec)[0], episodes=1, steps=1, evaluation=0))
    return spec


@pytest.mark.parametrize("kind", sorted({*LEARNERS.built_in} - {"mixed", "written"}))
def test_every_learner_is_chosen_by_its_kind_alone(kind: str) -> None:
    table = {"learner": {"kind": kind}}
    spec = build(table) if kind in BUILT else Spec.of(table)
    (condition,) = spec.conditions()
    assert condition.settings.learner.kind == kind
    remarks = [line for line in spec.warnings() if "set by default, left out" in line]
    assert len(remarks) == (kind != "batch-td")
    assert all(line.endswith(f"left out for learner.kind = {kind!r}") for line in remarks)


def test_a_mixed_team_is_chosen_with_its_parts() -> None:
    parts = [{"agents": "*", "learner": {"kind": "frozen"}}]
    (remark,) = Spec.of({"learner": {"kind": "mixed", "parts": parts}}).warnings()
    assert remark.endswith("left out for learner.kind = 'mixed'")
    parts[0]["learner"] = {"kind": "frozen", "rigde": 3.0}
    with pytest.raises(SpecError, match=r"^learner\.parts\[0\]\.learner\.rigde = 3\.0: unknown"):
        Spec.of({"learner": {"kind": "mixed", "parts": parts}})


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", ["batch-td", "fitted-q", "td-lambda", "frozen", "mappo"])
def test_a_learner_is_chosen_over_any_preset(preset: str, kind: str) -> None:
    table = {"preset": preset, "learner": {"kind": kind}}
    spec = build(table) if kind in BUILT else Spec.of(table)
    assert spec.conditions()[0].settings.learner.kind == kind


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", ["kinematic-chain", "line-up"])
def test_every_preset_is_of_other_scenarios_too(preset: str, kind: str) -> None:
    spec = build({"preset": preset, "scenario": {"kind": kind}})
    assert spec.conditions()[0].settings.scenario.kind == kind


def test_the_product_of_the_paper_is_that_of_all_variables_there_are() -> None:
    (condition,) = Spec.of({"preset": "paper"}).conditions()
    assert condition.settings.learner.rule_base.order == 7
    (condition,) = Spec.of({"preset": "paper", "scenario": {"kind": "line-up"}}).conditions()
    assert condition.settings.learner.rule_base.order == "full"
    table = {"rule_base": {"order": 1}}
    spec = Spec.of({"preset": "paper", "scenario": {"kind": "line-up"}, "learner": table})
    assert spec.conditions()[0].settings.learner.rule_base.order == 1


def test_what_the_user_did_not_write_gives_way_with_one_remark() -> None:
    spec = build({"learner": {"kind": "fitted-q"}})
    (condition,) = spec.conditions()
    assert isinstance(condition.settings.learner, LearnerSettings)
    assert condition.settings.learner.decision.value_of == "own"
    assert condition.settings.learner.weights == "own"  # the scenario's, for two robots
    assert spec.warnings() == (
        "learner.decision.value_of, learner.regression_iterations: set by default, left out for "
        "learner.kind = 'fitted-q'",
    )
    swept = Spec.of({"sweep": {"learner.kind": ["batch-td", "fitted-q", "td-lambda"]}})
    (remark,) = swept.warnings()
    assert remark.endswith("for learner.kind = 'fitted-q', learner.kind = 'td-lambda'")
    assert not Spec.of({"preset": "fitted-q"}).warnings()
    slow = {"kind": "gymnasium", "id": "CartPole-v1", "predictor": "copy", "success": "terminated"}
    assert not Spec.of({"preset": "own-value", "scenario": slow}).warnings()
    assert not Spec.of({}).warnings()


def test_what_the_user_wrote_is_refused() -> None:
    learner = {"kind": "fitted-q", "decision": {"value_of": "team"}}
    with pytest.raises(ValueError, match=r"learner\.decision\.value_of = 'team': fitted-q"):
        build({"learner": learner})
    swept = {"learner": {"kind": "fitted-q"}, "sweep": {"learner.decision.value_of": ["team"]}}
    with pytest.raises(ValueError, match=r"learner\.decision\.value_of = 'team': fitted-q"):
        build(swept)
    with pytest.raises(SpecError, match=r"learner\.trace_decay = 0.4: unknown key for kind"):
        build({"learner": {"kind": "fitted-q", "trace_decay": 0.4}})


@pytest.mark.parametrize("kind", EVALUATORS.built_in)
def test_an_evaluator_is_chosen_by_its_kind_alone(kind: str) -> None:
    decision: dict[str, object] = {"evaluator": {"kind": kind}}
    table: dict[str, object] = {"learner": {"decision": decision}}
    if kind in ON_GRAPHS:
        table["topology"] = "coordination-graph:line"
    if kind == "cross-entropy":
        decision["rule"] = "reward"
    spec = build(table)
    gives_way = kind in ON_GRAPHS
    assert any("learner.decision.value_of" in line for line in spec.warnings()) == gives_way


def test_the_kind_of_a_part_drops_what_is_another_ones() -> None:
    for kind in EXPLORATIONS.built_in:
        spec = build({"learner": {"exploration": {"kind": kind}}})
        assert bool(spec.warnings()) == (kind != "burst")
    paper = build({"preset": "paper", "learner": {"decision": {"evaluator": "best-response"}}})
    assert paper.warnings() == (
        "learner.decision.teammates: set by default, left out for "
        "learner.decision.evaluator.kind = 'best-response'",
    )
    assert not build({"scenario": {"kind": "line-up"}}).warnings()
    walled = {"kind": "line-up", "reward": {"of": "robot"}}
    with pytest.raises(SpecError, match=r"scenario\.reward"):
        build({"scenario": walled})


def test_a_control_stays_one_whatever_evaluates() -> None:
    spec = Spec.of({"preset": "random", "learner": {"decision": {"evaluator": "max-plus"}}})
    learner = spec.conditions()[0].settings.learner
    assert isinstance(learner, LearnerSettings)
    assert learner.decision.rule == "random"


def test_a_rule_base_too_large_for_a_batch_gives_way() -> None:
    spec = build({"preset": "paper", "learner": {"kind": "batch-td"}})
    assert "learner.rule_base.order" in spec.warnings()[0]
    written = {"kind": "batch-td", "rule_base": {"order": 7}}
    with pytest.raises(ValueError, match="78125 rules, allowed up to 4096"):
        build({"preset": "paper", "learner": written})


def test_a_kind_of_the_users_that_allows_less_is_given_less(tmp_path, monkeypatch) -> None:
    (tmp_path / "mine.py").write_text(
        "from typing import Literal\n"
        "from nested_agents.core.learners.batch import BatchTD, BatchTDSettings\n"
        "class Mine(BatchTD):\n"
        "    class Settings(BatchTDSettings):\n"
        "        weights: Literal['own'] = 'own'\n"
    )
    monkeypatch.chdir(tmp_path)
    table = {"scenario": {"robots": 3}, "learner": {"kind": "mine.py:Mine"}}
    spec = build(table)
    assert "learner.weights" in spec.warnings()[0]
    with pytest.raises(SpecError, match=r"learner\.weights = 'role': must be 'own'"):
        Spec.of({**table, "learner": {"kind": "mine.py:Mine", "weights": "role"}})


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        ({"learner.ridge": [1.0, 1.0]}, r"sweep\.learner\.ridge = \[1\.0, 1\.0\]: holds the same"),
        ({"learner.ridge": [1, 1.0]}, r"sweep\.learner\.ridge: conditions '1' and '1\.0' are"),
        (
            {"learner.discount": [0.5, 0.9], "topology": ["chain", "chain:listed"]},
            r"^sweep\.topology: conditions ",
        ),
    ],
)
def test_a_sweep_of_equal_values_names_its_key(sweep: dict[str, object], message: str) -> None:
    with pytest.raises(SpecError, match=message):
        Spec.of({"sweep": sweep})


@pytest.mark.parametrize(
    "table",
    [
        {"topology": "gone.json"},
        {"overrides": [{"name": "a", "topology": "gone.json"}]},
        {"sweep": {"topology": ["chain", "gone.json"]}},
        {"evaluations": {"a": {"topology": "gone.json"}}},
    ],
)
def test_a_file_that_is_not_there_names_its_key(table: dict[str, object]) -> None:
    with pytest.raises(SpecError, match=r"^topology\.path = 'gone\.json': No such file or dir"):
        Spec.of(table)
