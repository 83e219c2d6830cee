"""Resolution of presets, tables, overrides and sweeps into the settings of conditions."""

from dataclasses import replace

import pytest

from nested_agents.core.learners import LEARNERS, LearnerSettings
from nested_agents.core.learners.fitted_q import FittedQSettings
from nested_agents.core.learners.td import FrozenSettings
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS, BurstExploration
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.presets import PRESETS
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.session import Session
from nested_agents.studies.trials.trial import trials_of

ON_GRAPHS = ("variable-elimination", "max-plus")
"""Evaluators that need neighbors."""
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
    usual = LEARNERS.model(kind)(kind=kind)
    if kind != "batch-td":
        assert condition.settings.learner == usual


def test_a_mixed_team_is_chosen_with_its_parts() -> None:
    parts = [{"agents": "*", "learner": {"kind": "frozen"}}]
    Spec.of({"learner": {"kind": "mixed", "parts": parts}})
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


def test_a_table_without_a_kind_changes_the_default_of_its_key() -> None:
    (condition,) = Spec.of(
        {"preset": "own-value", "learner": {"exploration": {"rate": 0.1}}}
    ).conditions()
    assert isinstance(condition.settings.learner, LearnerSettings)
    assert condition.settings.learner.exploration == BurstExploration(rate=0.1)
    learner = FittedQSettings.model_validate({"exploration": {"length": 2.0}})
    assert learner.exploration == BurstExploration(rate=1.0, decay=0.85, floor=0.05, length=2.0)


def test_a_control_is_without_the_keys_that_tune_learning() -> None:
    for control in ({"preset": "frozen"}, {"learner": {"kind": "frozen"}}):
        overrides = [{"name": "trained"}, {"name": "control", **control}]
        spec = Spec.of({"learner": {"ridge": 3.0, "discount": 0.5}, "overrides": overrides})
        settings = spec.conditions()[1].settings.learner
        assert isinstance(settings, FrozenSettings)
        assert settings.discount == 0.5
        assert any(
            line.startswith("learner.ridge: left out for control") for line in spec.warnings()
        )


def test_what_the_user_wrote_is_refused() -> None:
    learner = {"kind": "fitted-q", "decision": {"value_of": "team"}}
    with pytest.raises(ValueError, match=r"learner\.decision\.value_of = 'team': fitted-q"):
        build({"learner": learner})
    swept = {"learner": {"kind": "fitted-q"}, "sweep": {"learner.decision.value_of": ["team"]}}
    with pytest.raises(ValueError, match=r"learner\.decision\.value_of = 'team': fitted-q"):
        build(swept)
    with pytest.raises(SpecError, match=r"learner\.trace_decay = 0.4: unknown key for kind"):
        build({"learner": {"kind": "fitted-q", "trace_decay": 0.4}})
    with pytest.raises(SpecError, match=r"learner\.ridge = 3.0: unknown key for kind 'td-lambda'"):
        Spec.of({"learner": {"ridge": 3.0}, "sweep": {"learner.kind": ["batch-td", "td-lambda"]}})


@pytest.mark.parametrize("kind", EVALUATORS.built_in)
def test_an_evaluator_is_chosen_by_its_kind_alone(kind: str) -> None:
    decision: dict[str, object] = {"evaluator": {"kind": kind}}
    table: dict[str, object] = {"learner": {"decision": decision}}
    if kind in ON_GRAPHS:
        table["topology"] = "coordination-graph:line"
        with pytest.raises(ValueError, match=r"learner\.decision\.value_of = 'team'"):
            build(table)
        decision["value_of"] = "own"
    if kind == "cross-entropy":
        decision["rule"] = "reward"
    build(table)


@pytest.mark.parametrize("kind", EXPLORATIONS.built_in)
def test_an_exploration_is_chosen_by_its_kind_alone(kind: str) -> None:
    build({"learner": {"exploration": {"kind": kind}}})


def test_a_key_of_another_scenario_is_refused() -> None:
    walled = {"kind": "line-up", "reward": {"of": "robot"}}
    with pytest.raises(SpecError, match=r"scenario\.reward"):
        build({"scenario": walled})


def test_a_control_stays_one_whatever_evaluates() -> None:
    spec = Spec.of({"preset": "random", "learner": {"decision": {"evaluator": "max-plus"}}})
    learner = spec.conditions()[0].settings.learner
    assert isinstance(learner, LearnerSettings)
    assert learner.decision.rule == "random"


def test_a_rule_base_too_large_for_a_batch_is_refused() -> None:
    build({"preset": "paper", "learner": {"kind": "batch-td"}})
    written = {
        "kind": "batch-td",
        "rule_base": {"membership": "sigmoid", "memberships": 5, "order": 7},
    }
    with pytest.raises(ValueError, match="78125 rules, allowed up to 4096"):
        build({"preset": "paper", "learner": written})


def test_a_kind_of_the_users_that_allows_less(tmp_path, monkeypatch) -> None:
    (tmp_path / "mine.py").write_text(
        "from typing import Literal\n"
        "from nested_agents.core.learners.batch import BatchTD, BatchTDSettings\n"
        "class Mine(BatchTD):\n"
        "    class Settings(BatchTDSettings):\n"
        "        weights: Literal['own'] = 'own'\n"
    )
    monkeypatch.chdir(tmp_path)
    table = {"scenario": {"robots": 3}, "learner": {"kind": "mine.py:Mine"}}
    build(table)
    with pytest.raises(SpecError, match=r"learner\.weights = 'role': must be 'own'"):
        Spec.of({**table, "learner": {"kind": "mine.py:Mine", "weights": "role"}})


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        ({"learner.ridge": [1.0, 1.0]}, r"sweep\.learner\.ridge = \[1\.0, 1\.0\]: holds the same"),
        ({"learner.ridge": [1, 1.0]}, r"sweep\.learner\.ridge: conditions '1' and '1\.0' are"),
        (
            {"learner.ridge": [1.0, 2.0], "learner": {"ridge": [3.0]}},
            r"sweep\.learner\.ridge = \[1\.0, 2\.0\]: the key stands twice",
        ),
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


def test_keys_of_a_preset_return_to_their_defaults() -> None:
    table = {"preset": "paper", "unset": ["learner.rule_base.memberships"]}
    overrides = [{"name": "even", "unset": ["scenario.action_repeat"]}, {"name": "as it is"}]
    changed, other = Spec.of({**table, "overrides": overrides}).conditions()
    assert changed.settings.learner.rule_base.memberships is None
    assert changed.settings.scenario.action_repeat == 8
    assert other.settings.scenario.action_repeat == 1


@pytest.mark.parametrize("key", ["learner.ridge", "scenario.kind.x", "learner.rule", "nothing", ""])
def test_a_key_that_the_preset_does_not_set_cannot_be_unset(key: str) -> None:
    with pytest.raises(SpecError, match=rf"^unset: .*{key!r}"):
        Spec.of({"preset": "paper", "unset": [key]})
