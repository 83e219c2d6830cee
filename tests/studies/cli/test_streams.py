"""Closed standard streams, and paths that look like options."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from nested_agents.studies.cli.main import main

COMMAND = Path(sys.executable).with_name("nested-agents")
SPEC = """
seeds = 1
episodes = 1
steps = 2
learner.kind = "frozen"
scenario.kind = "line-up"
"""


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&- <&-"])
@pytest.mark.parametrize("line", ["presets", "keys scenario", "--help"])
def test_a_closed_stream_is_like_the_null_device(line: str, closed: str, tmp_path: Path) -> None:
    shell = f"{shlex.quote(str(COMMAND))} {line} {closed}"
    done = subprocess.run(shell, shell=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not done.stderr


def test_a_study_is_whole_that_was_run_without_streams(tmp_path: Path) -> None:
    (tmp_path / "spec.toml").write_text(SPEC)
    shell = f"{shlex.quote(str(COMMAND))} run spec.toml --out out --jobs 1 >&- 2>&- <&-"
    assert subprocess.run(shell, shell=True, cwd=tmp_path, check=False).returncode == 0
    assert main(["table", str(tmp_path / "out")]) == 0


def test_a_reader_that_goes_away_ends_a_command_in_silence() -> None:
    shell = f"{shlex.quote(str(COMMAND))} keys scenario | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 141)
    assert not done.stderr


def test_printed_commands_work_where_a_path_begins_with_a_dash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spec.toml").write_text(SPEC)
    assert main(["run", "spec.toml", "--out=-my out", "--jobs", "1"]) == 0
    lines = [line.partition("nested-agents ")[2] for line in capsys.readouterr().out.splitlines()]
    commands = list(map(shlex.split, filter(None, lines)))
    assert {command[0] for command in commands} == {"results", "report"}
    for command in commands:
        assert main(command) == 0, command
