"""research/notebooks/signals.md holds what the committed results and theory give."""

from pathlib import Path

import pytest
from nested_agents_signals.theory import cascade, majority
from published_tables import print_table

from nested_agents.studies.results.notation import format_number

PAGE = (Path(__file__).resolve().parents[2] / "research" / "notebooks" / "signals.md").read_text(
    encoding="utf-8"
)


def test_the_table_of_results(capsys: pytest.CaptureFixture[str]) -> None:
    columns = ("share right", "last right", "vote right")
    rows = print_table("signals", columns, capsys).splitlines()[2:]
    for row in rows:
        if row.startswith(("| 4 ", "| 16 ")):
            assert row in PAGE, f"research/notebooks/signals.md: put in\n{row}"


@pytest.mark.parametrize("agents", [2, 4, 16, 1024])
def test_the_table_of_theory(agents: int) -> None:
    told = cascade(agents, 0.7)
    cells = [0.7, majority(agents, 0.7), float(told.right[-1]), told.vote]
    shown = " | ".join(map(format_number, cells))
    assert f"| {agents:,} | {shown} |" in PAGE
