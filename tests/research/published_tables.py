"""Tables of committed results, as the command line prints them."""

from collections.abc import Sequence

import pytest
from programs import main

from research import RESULTS


def print_table(name: str, columns: Sequence[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return columns of the table of published results, in Markdown."""
    path = RESULTS / f"{name}.json"
    assert main(["table", str(path), "--columns", *columns, "--format", "markdown"]) == 0
    return capsys.readouterr().out
