"""Code that came with a study is run only for who has run it from a spec, or says --trust."""

import shutil
import sys
from pathlib import Path

import pytest

from nested_agents.core.plugins import sources
from nested_agents.studies.cli.main import main
from nested_agents.studies.store.database import SPEC_FILE

SPEC = """
study = "mine.py:STUDY"
seeds = 1
episodes = 1
steps = 2
evaluation = 0
topology = "mine.py:ring"
[learner]
kind = "frozen"
[scenario]
kind = "line-up"
"""
MINE = """
from pathlib import Path
from types import SimpleNamespace

from nested_agents.studies.catalogue import learning_curve

Path({mark!r}).touch()


def ring(agents, groups):
    return list(zip(agents, agents[1:]))


STUDY = learning_curve
"""
RUNNING = ("explain", "retry", "report", "table")
HARMLESS = ("status", "results", "export")


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Who has run a study: a folder with what they have written, trusted and made."""
    folder = tmp_path_factory.mktemp("theirs")
    (folder / "mine.py").write_text(MINE.format(mark=str(folder / "mark")))
    (folder / "spec.toml").write_text(SPEC)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        line = ["run", str(folder / "spec.toml"), "--out", str(folder / "study"), "--jobs", "1"]
        assert main(line) == 0
    return folder


@pytest.fixture
def mark(theirs: Path) -> Path:
    """Exists once the file has been run."""
    mark = theirs / "mark"
    mark.unlink(missing_ok=True)
    return mark


@pytest.fixture
def foreign(theirs: Path, mark: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A study that somebody else has run."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "ours"))
    monkeypatch.setattr(sources, "_here", set())
    forget_modules()
    return shutil.copytree(theirs / "study", tmp_path / "study")


def forget_modules() -> None:
    for name in [name for name in sys.modules if name.startswith("_nested_agents_")]:
        del sys.modules[name]


def test_nothing_that_came_with_a_study_is_run_unasked(
    foreign: Path, mark: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in HARMLESS:
        assert main([command, str(foreign)]) == 0
    again = ["run", str(foreign / SPEC_FILE), "--out", str(foreign)]
    capsys.readouterr()
    for line in (*([command, str(foreign)] for command in RUNNING), again):
        assert main(line) == 2, line
        _, error = capsys.readouterr()
        assert error.count("\n") == 1
        assert "mine.py came with" in error
        assert "--trust" in error
    # A spec of one's own that names another file of that name.
    (tmp_path / "mine.py").write_text("def ring(agents, groups): return []\n")
    (tmp_path / "spec.toml").write_text(SPEC.replace('"mine.py:STUDY"', '"learning-curve"'))
    assert main(["run", str(tmp_path / "spec.toml"), "--out", str(foreign)]) == 2
    assert "mine.py has changed since" in capsys.readouterr().err
    assert not mark.exists()


def test_trust_is_said_once_and_kept(
    foreign: Path, mark: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", str(foreign), "--trust"]) == 0
    assert f"mine.py, which came with {foreign}, is trusted" in capsys.readouterr().err
    assert mark.exists()
    monkeypatch.setattr(sources, "_here", set())  # as in another process
    forget_modules()
    for command in RUNNING:
        assert main([command, str(foreign)]) == 0, command
    assert main(["run", str(foreign / SPEC_FILE), "--out", str(foreign)]) == 0
    assert "is trusted" not in capsys.readouterr().err


def test_who_has_run_a_file_trusts_it_wherever_it_is(
    foreign: Path, theirs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(theirs / "state"))
    foreign.rename(tmp_path / "elsewhere")
    assert main(["table", str(tmp_path / "elsewhere")]) == 0


def test_without_a_list_trust_lasts_as_long_as_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert not sources.is_trusted("x = 8")
    sources.trust("x = 8")
    assert sources.is_trusted("x = 8")
    assert not sources.is_trusted("x = 9")


def test_the_kept_spec_runs_elsewhere_with_the_copies_beside_it(
    foreign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = ["run", str(foreign / SPEC_FILE), "--out", str(tmp_path / "again"), "--jobs", "1"]
    assert main(again) == 2
    assert f"mine.py came with {foreign}" in capsys.readouterr().err
    assert main([*again, "--trust"]) == 0
