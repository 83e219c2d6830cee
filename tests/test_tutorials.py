"""The tutorials: everything that they have a reader type is typed, on a smaller scale."""

import re
import shlex
from pathlib import Path

import pytest

from nested_agents.core.plugins.sources import Sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.spec.spec import Spec

TUTORIALS = Path(__file__).resolve().parent.parent / "docs" / "tutorials"
PAGES = sorted(path.stem for path in TUTORIALS.glob("*.md") if path.stem != "index")
SMALL = ("seeds=2", "episodes=2", "steps=8", "evaluation=1")
ELSEWHERE = ("--backend dask", "cp -r", "pip install", "dask ", "--measured")
"""What takes a cluster, or long: tests/studies/workers and tests/studies/cost have these."""
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def test_the_list_of_tutorials_is_complete() -> None:
    (listed,) = re.findall(
        r"```{toctree}\n:maxdepth: 1\n\n(.*?)\n```", (TUTORIALS / "index.md").read_text(), re.DOTALL
    )
    assert sorted(listed.split()) == PAGES


def typed(line: str, page: str) -> list[str]:
    """Return the arguments of a command; a study is made small."""
    arguments = shlex.split(line, comments=True)[1:]
    if arguments[0] != "run":
        return arguments
    arguments = [part for part in arguments if part not in ("--jobs", "1", "2")]
    changes = [*SMALL]
    if page == "wheel_failures":
        failure = '{kind="reversed",wheels="robot1.front-left",episode=5}'
        changes = ["seeds=2", "episodes=10", "steps=4", f"scenario.failures=[{failure}]"]
    if page == "pettingzoo":
        changes = ["seeds=2", "decisions=4096", "steps=8", "evaluation=1"]
    shown = ["--set"] if "--set" not in arguments else []
    return [*arguments, *shown, *changes, "--jobs", "1"]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_a_tutorial_can_be_typed(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    names: dict[str, object] = {"__name__": "tutorial"}
    for language, text in BLOCK.findall((TUTORIALS / f"{page}.md").read_text(encoding="utf-8")):
        file = re.match(r"# (\w+\.\w+)\n", text)
        if file:
            Path(file[1]).write_text(text)
        if file and language == "python":
            compile(text, file[1], "exec")
        elif file:
            Spec.parse(text, sources=Sources(tmp_path))
        elif language == "python":
            exec(text, names)
        elif language == "sh":
            for line in text.splitlines():
                if not any(word in line for word in ELSEWHERE):
                    assert main(typed(line, page)) == 0, line
                    assert capsys.readouterr().out
