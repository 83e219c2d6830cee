"""The documentation of environments: its specs can be built, its code runs, its table is right."""

import re
from pathlib import Path

import pytest

from nested_agents.scenarios.box_pushing.world.boxes import BOXES
from nested_agents.studies.cli.main import main
from nested_agents.studies.errors import SpecError
from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

DOCS = Path(__file__).resolve().parents[2] / "docs"
TEXT = (DOCS / "environments" / "box_pushing.md").read_text(encoding="utf-8")
PAGES = TEXT + (DOCS / "environments" / "gymnasium_pettingzoo.md").read_text(encoding="utf-8")
TUTORIAL = (DOCS / "tutorials" / "scenario.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("spec", re.findall(r"```toml\n(.*?)```", PAGES, re.DOTALL))
def test_specs(spec: str) -> None:
    if 'kind = "vmas"' in spec:
        pytest.importorskip("vmas", reason="extra [vmas]")
    check_conditions(Spec.parse(spec))


@pytest.mark.parametrize("code", re.findall(r"```python\n(.*?)```", PAGES, re.DOTALL))
def test_code(code: str) -> None:
    exec(code, {"__name__": "example"})


def test_a_scenario_of_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the tutorial has one write is checked by the command and learns as it prints."""
    scenario, training, _ = re.findall(r"```python\n(.*?)```", TUTORIAL, re.DOTALL)
    (printed,) = re.findall(r"```text\n(before training: \d+ of .*?)```", TUTORIAL, re.DOTALL)
    (tmp_path / "tank.py").write_text(scenario)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert "nested-agents check tank.py:Tank\n" in TUTORIAL
    assert main(["check", "tank.py:Tank"]) == 0
    assert capsys.readouterr().out.startswith("passed  Tank: ")
    exec(training, {"__name__": "example"})
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(
    "chosen", ['scenario.kind="tank.py:Tank"', 'learner.kind="mine.py:Learner"']
)
def test_studies_take_no_scenario_and_no_learner_of_ones_own(chosen: str) -> None:
    table, _, value = chosen.partition(".")
    with pytest.raises(SpecError, match=f"{table}.kind"):
        Spec.parse(f"[{table}]\n{value}\n")


def test_mass_properties() -> None:
    rows = re.findall(r"\| (\S+) \| (0\S+) \| (\S+) \| (\S+) \| (\S+) \| (.+) \|", TEXT)
    assert [row[0] for row in rows] == list(BOXES)
    for name, area, mass, inertia, lever, pieces in rows:
        box = BOXES[name]
        assert float(area) == pytest.approx(box.area, abs=5e-5)
        assert float(mass) == box.mass
        assert float(inertia) == pytest.approx(1000 * box.inertia, abs=5e-4)
        assert float(lever) == pytest.approx(box.friction_radius, abs=5e-5)
        assert pieces == str(len(box.fixtures) or "a disc")
