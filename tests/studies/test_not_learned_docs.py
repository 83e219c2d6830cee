"""docs/troubleshooting.md: its tables are of committed results, its example and specs run."""

import csv
import re
from pathlib import Path

import pytest

from nested_agents.studies.api.tuning import USUAL
from nested_agents.studies.cli.main import main
from nested_agents.studies.results import published
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
COLUMNS = ("success last 5", "evaluation success", "evaluation steps")
RESULTS = ("pursuit_steps", "pursuit_frozen", "pursuit_tuned", "pursuit_tuned_as_written")


@pytest.mark.parametrize("name", RESULTS)
def test_tables(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(EXAMPLES / f"{name}.json")
    assert main(["table", path, "--columns", *COLUMNS, "--format", "markdown"]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert all(row in PAGE for row in rows[2:]), f"docs/troubleshooting.md: put in\n{rows}"


def test_the_results_are_of_the_specs() -> None:
    for name in ("pursuit_steps", "pursuit_frozen"):
        table = Spec.load(EXAMPLES / f"{name}.toml").table()
        table.pop("title", None)  # the comment of the spec, which old results do not have
        assert published.load(EXAMPLES / f"{name}.json").outline.table == table
    own = Spec.load(EXAMPLES / "pursuit.toml")
    for name, alike in (("pursuit_tuned", True), ("pursuit_tuned_as_written", False)):
        tuned = published.load(EXAMPLES / f"{name}.json").outline.table
        assert tuned["scenario"].get("alike", False) == alike
        for key in ("seeds", "episodes", "steps", "evaluation"):
            assert tuned[key] == own.table()[key]
        with (EXAMPLES / f"{name}.csv").open() as file:
            best, *others = csv.DictReader(file)
        assert len(others) == 19
        for key in USUAL:
            if best.get(key):
                section, *rest = key.split(".")
                value = tuned[section]
                for part in rest:
                    value = value[part]
                assert str(value) == best[key]


def test_the_example_keeps_its_promises(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(EXAMPLES / "pursuit.py:Pursuit")]) == 0
    assert capsys.readouterr().out.startswith("passed  Pursuit: ")
    check_conditions(Spec.load(EXAMPLES / "pursuit_steps.toml"))


def test_specs_of_the_page() -> None:
    for text in re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL):
        assert Spec.parse(text).tune
    for code in re.findall(r"```py\n(class .*?)```", PAGE, re.DOTALL):
        names: dict[str, object] = {}
        exec(f"import nested_agents as na\n{code}", names)
        settings = names["Settings"]()  # type: ignore[operator]
        assert settings.scenario_defaults("default") == {"learner": {"discount": 0.9}}
