"""Every key of a spec is told of: type, default, what is allowed, meaning."""

from pkgutil import resolve_name

import pytest

from nested_agents.core.agents.peer import PeerSettings
from nested_agents.core.learners import LEARNERS
from nested_agents.core.plugins.models import Plugged
from nested_agents.core.plugins.registry import Registry
from nested_agents.core.plugins.settings import Settings
from nested_agents.core.search import EVALUATORS
from nested_agents.core.search.exploration import EXPLORATIONS
from nested_agents.scenarios import SCENARIOS
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.conditions import ConditionSettings
from nested_agents.studies.spec.keys import (
    OWN_FUNCTION,
    Key,
    Table,
    keys_below,
    tables,
)
from nested_agents.topologies import TOPOLOGIES

TABLES = tables()


def subclasses(cls: type) -> set[type]:
    return {cls}.union(*(subclasses(below) for below in cls.__subclasses__()))


def built_in_models() -> set[type[Settings]]:
    """All settings models of ours that have fields, however they are reached.

    Not those of controllers of one scenario, which are named by module and class, nor those of
    faults of other environments, nor entries of a benchmark; nor those that other tests have made
    of a function; nor those of peers, which only learners of users inherit.
    """
    found = subclasses(Settings) - {Settings, ConditionSettings, PeerSettings}
    return {
        model
        for model in found
        if model.__module__.startswith("nested_agents.")
        and not model.__module__.endswith((".scripted", ".bayesian", ".wrappers", ".push_n"))
        and set(model.model_fields) - {"kind"}
        and resolve_name(f"{model.__module__}:{model.__qualname__}") is model
    }


def test_the_fields_of_all_models_are_the_keys_that_are_listed() -> None:
    listed = {key.name for table in TABLES for key in table.keys}
    models = {table.model for table in TABLES}
    for model in built_in_models():
        heirs = {heir.__name__ for heir in subclasses(model)}
        assert heirs & models, f"{model.__name__} is no part of a spec"
        assert {*model.model_fields} <= listed | {"kind"}, f"{model.__name__}"


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.heading)
def test_every_key_has_a_meaning(table: Table) -> None:
    assert not table.model or table.summary.endswith((".", ":")) or "``" in table.summary
    for key in table.keys:
        assert len(key.meaning) > 12, f"{table.heading}: {key.name} has no docstring"
        assert key.type
        assert key.default


def test_registries_are_walked() -> None:
    (metadata,) = [
        item for item in ConditionSettings.model_fields["learner"].metadata
        if isinstance(item, Plugged)
    ]  # fmt: skip
    kinds = {table.kind for table in TABLES if table.name == "learner"}
    assert kinds == {"", *metadata.registry.built_in, OWN_FUNCTION}


def the_key(name: str) -> Key:
    table, *_ = keys_below(name)  # scenarios and learners share some
    (key,) = table.keys
    return key


@pytest.mark.parametrize(
    ("name", "kind", "default", "allowed", "unit"),
    [
        ("scenario.termination_radius", "number", "1.5", "> 0", "m"),
        ("scenario.start", "text", '"medium"', '"fixed", "easy", "medium", "hard"', ""),
        ("scenario.robots", "whole number", "2", ">= 1", ""),
        ("scenario.box.holes", "list of list of pair of number", "[]", "at least 3 of them", "m"),
        ("learner.rule_base.memberships", "whole number", "none", ">= 2, <= 15", ""),
        ("topology.members", "nested lists of text", "none", "", ""),
        ("overrides.name", "text", "required", "", ""),
        ("learner.predictor.kind", "text", '"given"', "given, static, learned, poses", ""),
    ],
)
def test_a_key(name: str, kind: str, default: str, allowed: str, unit: str) -> None:
    key = the_key(name)
    assert (key.type, key.default, key.allowed, key.unit) == (kind, default, allowed, unit)


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("scenario.kind", SCENARIOS),
        ("learner.kind", LEARNERS),
        ("topology.kind", TOPOLOGIES),
        ("learner.exploration.kind", EXPLORATIONS),
        ("learner.decision.evaluator.kind", EVALUATORS),
    ],
)
def test_a_kind_is_a_key(name: str, known: Registry) -> None:
    key = the_key(name)
    kinds, _, own = key.allowed.partition("; ")
    assert kinds.split(", ") == list(known.built_in)
    assert own == "or your own, file.py:NAME"
    assert key.default.strip('"') in known.built_in


def test_the_command(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["keys", "scenario.infrared.reach"]) == 0
    assert capsys.readouterr().out == (
        '[scenario.infrared], of "box-pushing"\n'
        "reach = 0.06: number, > 0, [m]\n"
        "    Distance beyond which the sensors read 0 [m]. Those of the e-Puck reach\n"
        "    about 6 cm.\n"
    )
    assert main(["keys", "lerner"]) == 2
    assert "lerner: unknown key; did you mean 'learner'?" in capsys.readouterr().err
    assert main(["keys"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 60
    assert "[scenario.infrared]  reach, decay, noise" in lines
