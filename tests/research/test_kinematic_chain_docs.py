"""The pages on arms hold the tables that the committed results give, and specs that are."""

import re
from pathlib import Path

import pytest
from published_tables import print_table

from nested_agents.studies.spec.spec import Spec
from nested_agents.studies.trials.arrangement import check_conditions

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "docs" / "environments" / "arms.md", ROOT / "research" / "notebooks" / "arms.md")
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in PAGES)
REACHED = ("success last 5", "evaluation success")


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("arms", REACHED),
        ("long-arms", REACHED),
        ("arm-transfer", ("evaluation success", "success, eight", "success, sixteen")),
        (
            "thousand-arms",
            ("evaluation success", *(f"success, {n}" for n in ("128", "256", "512", "1,024"))),
        ),
        ("locked-joint", ("success before", "success just after", "success at the end")),
    ],
)
def test_tables(name: str, columns: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    table = print_table(name, columns, capsys)
    assert table in TEXT, f"research/notebooks/arms.md: put in\n{table}"


@pytest.mark.parametrize("spec", re.findall(r"```toml\n(.*?)```", TEXT, flags=re.DOTALL))
def test_specs_can_be_built(spec: str) -> None:
    check_conditions(Spec.parse(spec))


@pytest.mark.parametrize("path", re.findall(r"nested-agents run ((?:studies|research)/\S+)", TEXT))
def test_the_catalogue_has_what_it_names(path: str) -> None:
    check_conditions(Spec.load(ROOT / path))
