"""research/notebooks/model_free.md says what the committed results say."""

import re
from pathlib import Path

import pytest
from programs import main
from published_tables import print_table

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "research" / "notebooks" / "model_free.md").read_text(encoding="utf-8")
COLUMNS = ("evaluation success", "messages")


def test_specs_can_be_run() -> None:
    for spec in re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL):
        check_conditions(Spec.parse(spec))


@pytest.mark.parametrize("name", ["fit", "fit-landmarks", "fit-arms", "fit-games"])
def test_tables(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, COLUMNS, capsys)
    assert table in TEXT, f"research/notebooks/model_free.md: put in\n{table}"


def test_the_claims_of_action_dependency_graphs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["claims", "--of", "action-dependency-graphs", "--format", "markdown"]) == 0
    assert capsys.readouterr().out.strip() in TEXT


@pytest.mark.parametrize("path", re.findall(r"nested-agents run (\S+\.toml)", TEXT))
def test_commands_name_specs_that_are(path: str) -> None:
    assert Spec.load(ROOT / path).conditions()
