"""The schema of specs: all specs that there are fit it, and it refuses what they refuse."""

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.keys import OWN_FUNCTION, tables
from nested_agents.studies.spec.schema import schema

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "examples").rglob("*.toml"))
SPECS = [
    path
    for folder in ("research/specs", "studies/catalogue")
    for path in sorted((ROOT / folder).rglob("*.toml"))
]


def problems(table: Any, given: Any = None) -> list[str]:
    errors = Draft202012Validator(schema() if given is None else given).iter_errors(table)
    return [f"{error.json_path}: {error.message}" for error in errors]


def test_it_is_a_schema_of_every_spec() -> None:
    whole = schema()
    Draft202012Validator.check_schema(whole)
    validator = Draft202012Validator(whole)
    assert len(SPECS) > 90
    for path in [*SPECS, *EXAMPLES]:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        assert [*validator.iter_errors(table)] == [], path


def test_the_committed_schema_is_that_of_the_code() -> None:
    committed = (ROOT / "examples" / "spec.schema.json").read_text(encoding="utf-8")
    assert json.loads(committed) == json.loads(json.dumps(schema())), "run ./dev generate"


def test_the_examples_name_one_that_fits() -> None:
    for path in EXAMPLES:
        first, _, rest = path.read_text(encoding="utf-8").partition("\n")
        named = json.loads((path.parent / first.removeprefix("#:schema ")).read_text("utf-8"))
        assert problems(tomllib.loads(rest), named) == [], path


@pytest.mark.parametrize(
    ("table", "where"),
    [
        ({"seedz": 3}, "seedz"),
        ({"episodes": 0}, "$.episodes: 0 is less than the minimum of 1"),
        ({"scenario": {"kind": "line-up", "robots": 3}}, "$.scenario"),
        ({"learner": {"kind": "td-lambda", "step_size": "fast"}}, "$.learner"),
        ({"overrides": [{"learner": {"kind": "frozen"}}]}, "'name' is a required property"),
        ({"sweep": {"scenario.robots": 4}}, "$.sweep"),
    ],
)
def test_what_a_spec_refuses_is_marked(table: dict[str, Any], where: str) -> None:
    assert any(where in problem for problem in problems(table)), problems(table)


@pytest.mark.parametrize(
    "table",
    [
        {"scenario": "mine.py:World"},
        {"scenario": {"kind": "mine.py:World", "anything": 1}},
        {"topology": "tree:3", "learner": {"rule_base": {"memberships": 3}}},
        {"seeds": [3, 5], "sweep": {"scenario": {"robots": [2, 4]}, "preset": ["default"]}},
    ],
)
def test_what_users_write_fits(table: dict[str, Any]) -> None:
    assert problems(table) == []


def test_every_key_has_its_text() -> None:
    definitions = schema()["$defs"]
    for table in tables():
        if table.name in ("scenario", "learner") and table.kind not in ("", OWN_FUNCTION):
            (known,) = (
                one["properties"]
                for one in definitions[table.name]["anyOf"]
                if one.get("properties", {}).get("kind", {}).get("const") == table.kind
            )
            for key in table.keys:
                assert known[key.name].get("description") == (key.meaning or None), key


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
    assert main(["schema", "--out", str(tmp_path / "spec.json")]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'spec.json'}\n"
    assert json.loads((tmp_path / "spec.json").read_text(encoding="utf-8")) == schema()
