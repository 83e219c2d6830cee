"""research/notebooks/push_n.md says what the committed entries say."""

import re
from pathlib import Path
from typing import Any

import pytest
from programs import main

from research import push_n

pytestmark = pytest.mark.usefixtures("entries_read_once")
TEXT = (Path(__file__).resolve().parents[2] / "research" / "notebooks" / "push_n.md").read_text(
    encoding="utf-8"
)


@pytest.mark.parametrize("measure", ["success", "decisions"])
def test_tables(measure: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["push_n", "table", "--measure", measure, "--format", "markdown"]) == 0
    table = capsys.readouterr().out
    assert table in TEXT, f"research/notebooks/push_n.md: put in\n{table}"


def test_rules_are_those_of_the_code() -> None:
    assert (
        f"{', '.join(f'`{key}`' for key in push_n.FREE[:-1])} and\n   `{push_n.FREE[-1]}`" in TEXT
    )
    assert f"ten episodes of at most {push_n.STEPS} decisions" in TEXT
    assert (push_n.EPISODES, push_n.LEAST_SEEDS) == (10, 5)


def test_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(push_n, "STEPS", 2)
    (script,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    names: dict[str, Any] = {}
    exec(script, names)
    assert set(names["success"]) <= {"0", "1"}
    assert names["steps"] == (2,) * 10
