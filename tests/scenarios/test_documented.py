"""The documentation of worlds: its specs can be built, its code runs, its table is right."""

import re
from pathlib import Path

import pytest

from nested_agents.scenarios.boxes import BOXES
from nested_agents.studies.spec import Spec
from nested_agents.studies.trial import check

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "worlds.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("spec", re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))
def test_specs(spec: str) -> None:
    check(Spec.parse(spec))


@pytest.mark.parametrize("code", re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL))
def test_code(code: str) -> None:
    exec(code, {})


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
