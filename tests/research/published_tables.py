"""Tables of committed results, as the command line prints them."""

from collections.abc import Sequence

import pytest

from nested_agents.research import ROWS
from nested_agents.studies.cli.main import main


def print_table(name: str, columns: Sequence[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return columns of the table of published results, in Markdown."""
    path = ROWS / f"{name}.json"
    assert main(["table", str(path), "--columns", *columns, "--format", "markdown"]) == 0
    return capsys.readouterr().out
